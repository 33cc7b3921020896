"""Is this a place that was seen before?  Words propose, geometry decides, the picture before is asked.

::

    query of the inverted index            pictures that share words, none of the last few
      enough common words, score           against that of the picture before: how alike two of one place are
      groups of neighbours                 a place is seen by several pictures: their scores add up
    for each of the best groups' best picture
      pairs under common nodes             nearest, by far, mutual, turned alike
      fundamental matrix                   inliers of the epipolar geometry, their squares, their share
    much support, or less and a place near this one was recognised in the picture before

Two look-alikes share words, and even geometry: one door, or one poster, has as many inliers in two pictures
of different places as in two of one.  But they crowd on that thing, and the rest of the pictures is paired by
accident, so that the geometry explains a smaller share of the pairs.  The support of a candidate is therefore
the number of squares of the picture that hold an inlier, times the share of the pairs that are inliers.

After a recognised place a place near it needs less, since a walk does not jump.  Two pictures that are
doubtful alone are no more certain together: a look-alike is seen in several pictures one after the other.
How much is asked for is chosen on rendered look-alikes: see ``recognition_settings``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.vocabulary import (
    Bag,
    Database,
    QueryResult,
    Vocabulary,
    bag,
    descend,
    match,
    nodes_at_level,
    score,
    turned_alike,
)
from vslam_ref.geometry.multiview.two_views import fundamental_consensus
from vslam_ref.systems.orbslam.recognition_settings import RecognitionSettings


class WordedPicture(NamedTuple):
    """Features of a picture, and their words.

    Attributes
    ----------
    uv : ndarray, shape (N, 2)
        Pixels of a lens without distortion.
    angle : ndarray, shape (N,)
        Radians.
    descriptor : ndarray of uint8, shape (N, 32)
    node : ndarray of int, shape (N,)
        Node of each on the level of the direct index.
    bag : Bag
    """

    uv: Array
    angle: Array
    descriptor: NDArray[np.uint8]
    node: IntArray
    bag: Bag


class Verified(NamedTuple):
    """Pairs of two pictures that one epipolar geometry explains.

    Attributes
    ----------
    entry : int
        The other picture; -1 for none.
    first, second : ndarray of int, shape (m,)
        Features of the picture and of the other one.
    squares : int
        Of the picture in which they crowd more: how many squares hold one.
    support : float
        Squares, times the share of all pairs of the two pictures that are among these.
    """

    entry: int
    first: IntArray
    second: IntArray
    squares: int
    support: float


class Recognition(NamedTuple):
    """What was recognised in a picture.

    Attributes
    ----------
    entry : int
        The picture of the same place; -1 for none.
    best : Verified
        The candidate with most support, accepted or not.
    candidates : ndarray of int, shape (m,)
        Pictures that were verified, the best group first.
    """

    entry: int
    best: Verified
    candidates: IntArray


NOTHING = Verified(-1, np.zeros(0, np.int64), np.zeros(0, np.int64), 0, 0.0)


def described(
    vocabulary: Vocabulary, uv: Array, angle: Array, descriptor: NDArray[np.uint8], level: int
) -> WordedPicture:
    """Give features ``uv (N, 2)``, pixels, with ``angle (N,)``, radians, and ``descriptor (N, 32)`` words."""
    leaf = descend(vocabulary, descriptor).node
    seen = bag(vocabulary, vocabulary.word[leaf])
    return WordedPicture(uv, angle, descriptor, nodes_at_level(vocabulary, leaf, level), seen)


def proposed(
    index: Database, query: Bag, least: float, allowed: NDArray[np.bool_], settings: RecognitionSettings
) -> QueryResult:
    """Candidates of a picture: of each of the best groups of neighbours the best picture.

    Parameters
    ----------
    index : Database
        Pictures in the order in which they were seen.
    query : Bag
    least : float
        Score below which a picture is no candidate; no unit.
    allowed : ndarray of bool, shape (entries,)
        Pictures that may be candidates; no unit.
    settings : RecognitionSettings

    Returns
    -------
    QueryResult
        Scores are those of the groups, growing no more.
    """
    found = index.query(query, allowed)
    if len(found.entry) == 0:
        return found
    good = (found.common >= settings.common * found.common.max()) & (found.score >= least)
    score_of, total = np.zeros(len(index)), np.zeros(len(index))
    score_of[found.entry[good]] = found.score[good]
    for shift in range(-settings.reach, settings.reach + 1):
        total[max(shift, 0) : len(total) + min(shift, 0)] += score_of[
            max(-shift, 0) : len(total) - max(shift, 0)
        ]
    total[score_of == 0] = 0.0
    chosen: list[int] = []
    most = total.max(initial=0.0)
    for entry in np.argsort(-total, kind="stable").tolist():
        if len(chosen) == settings.candidates or total[entry] < max(settings.group * most, 1e-12):
            break
        around = slice(max(entry - settings.reach, 0), entry + settings.reach + 1)
        best = int(np.argmax(score_of[around])) + around.start
        if best not in chosen:
            chosen.append(best)
    common = np.zeros(len(index), np.int64)
    common[found.entry] = found.common
    at = np.array(chosen, np.int64)
    return QueryResult(at, total[at], common[at])


def verified(
    a: WordedPicture,
    b: WordedPicture,
    entry: int,
    rng: np.random.Generator,
    settings: RecognitionSettings,
) -> Verified:
    """Pairs of two pictures that agree on an epipolar geometry; no camera is needed."""
    pairs = match(a.descriptor, b.descriptor, a.node, b.node, settings.matching)
    alike = turned_alike(a.angle[pairs.first], b.angle[pairs.second], settings.matching)
    first, second = pairs.first[alike], pairs.second[alike]
    if len(first) <= 7:
        return NOTHING
    sigma = settings.pixels / 1.959963984540054  # so that the consensus counts pairs up to ``pixels``
    found = fundamental_consensus(a.uv[first], b.uv[second], rng, sigma=sigma, draws=settings.draws)
    if found.reason:
        return NOTHING
    first, second = first[found.inliers], second[found.inliers]
    squares = min(occupied(a.uv[first], settings.square), occupied(b.uv[second], settings.square))
    return Verified(entry, first, second, squares, squares * len(first) / len(pairs.first))


def occupied(uv: Array, square: float) -> int:
    """How many squares of a side, pixels, hold one of the pixels ``uv (N, 2)``; a count.

    >>> occupied(np.array([[1.0, 2.0], [9.0, 3.0], [11.0, 3.0]]), 10.0)
    2
    """
    return len(np.unique(np.floor(uv / square), axis=0))


class Recogniser:
    """Pictures one after the other: each is compared with those before, and becomes one of them.

    Parameters
    ----------
    vocabulary : Vocabulary
    rng : numpy.random.Generator
        Draws the samples of the geometry.
    settings : RecognitionSettings, optional
    """

    def __init__(
        self, vocabulary: Vocabulary, rng: np.random.Generator, settings: RecognitionSettings | None = None
    ) -> None:
        self.vocabulary, self.rng = vocabulary, rng
        self.settings = settings or RecognitionSettings()
        self.index = Database(vocabulary.words)
        self.pictures: list[WordedPicture] = []
        self._before = -1  # the place recognised in the picture before

    def see(self, uv: Array, angle: Array, descriptor: NDArray[np.uint8]) -> Recognition:
        """Recognise a picture by its features, and remember it.

        Parameters
        ----------
        uv : ndarray, shape (N, 2)
            Pixels of a lens without distortion.
        angle : ndarray, shape (N,)
            Radians.
        descriptor : ndarray of uint8, shape (N, 32)

        Returns
        -------
        Recognition
        """
        how = self.settings
        now = described(self.vocabulary, uv, angle, descriptor, how.level)
        allowed = np.arange(len(self.pictures)) < len(self.pictures) - how.gap
        least = how.relative * score(now.bag, self.pictures[-1].bag) if self.pictures else 0.0
        candidates = proposed(self.index, now.bag, least, allowed, how).entry
        best = NOTHING
        for entry in candidates.tolist():
            one = verified(now, self.pictures[entry], entry, self.rng, how)
            best = one if one.support > best.support else best
        follows = self._before >= 0 and abs(best.entry - self._before) <= how.near
        accepted = best.support >= how.sure or (follows and best.support >= how.likely)
        self._before = best.entry if accepted else -1
        self.index.add(now.bag)
        self.pictures.append(now)
        return Recognition(self._before, best, candidates)
