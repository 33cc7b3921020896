"""Recognition in rendered look-alikes, and how its two thresholds are chosen there.

    python -m vslam_ref.experiments.orbslam.lookalikes        # print the choice, and what it rests on

The rule: ``sure`` is a tenth more than the most support of a wrong candidate, one whose picture shares no
scene point with the query; ``likely`` is a tenth more than the most with which a wrong candidate would be
accepted on the word of the picture before; both rounded up.  The seeds here are for choosing only.
"""

from __future__ import annotations

import math
import sys
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.datasets.vocabulary_files import shipped_vocabulary
from vslam_ref.features.orb import OrbSettings, extract
from vslam_ref.features.vocabulary import Vocabulary
from vslam_ref.systems.orbslam.recognition import Recogniser, Recognition, RecognitionSettings
from vslam_ref.worlds.rendered import Effects
from vslam_ref.worlds.rendered.lookalikes import lookalikes, overlap
from vslam_ref.worlds.rendered.record import RenderedScene

CHOOSING = (*range(21, 29), *range(41, 49))
EFFECTS = Effects(noise=3.0, exposure=0.15, shutter=0.01, blur_samples=3)
HARDER = Effects(noise=5.0, exposure=0.3, shutter=0.02, blur_samples=3)
"""Of the buildings that choose; their pictures are two metres apart, so that revisits look less alike."""
PICTURES, GAP = 45, 4
FEATURES = OrbSettings(features=1000)
MARGIN = 1.1
SEEN = 0.2
"""Share of a picture that an earlier one must show, too, for the place to count as seen before."""
Bytes = NDArray[np.uint8]


class SeenPictures(NamedTuple):
    """Pictures one after the other, what was best in each, and whether it was right.

    Attributes
    ----------
    entry : ndarray of int, shape (K,)
        The best candidate of each picture, -1 without one.
    support : ndarray, shape (K,)
        Of its pairs, squares.
    accepted : ndarray of bool, shape (K,)
    right, wrong : ndarray of bool, shape (K,)
        Whether it shows the same place; whether it shares no scene point.  Some do neither.
    first : ndarray of int, shape (K,)
        The picture with the highest score of the words, -1 without one.
    score : ndarray, shape (K,)
        Its score.
    """

    entry: IntArray
    support: Array
    accepted: BoolArray
    right: BoolArray
    wrong: BoolArray
    first: IntArray
    score: Array


class PictureFeatures(NamedTuple):
    """Of a picture: pixels (N, 2), angles (N,), radians, and descriptors (N, 32)."""

    uv: Array
    angle: Array
    descriptor: Bytes


def features(image: Bytes) -> PictureFeatures:
    """Features of a picture (H, W)."""
    found = extract(image, FEATURES)
    return PictureFeatures(found.uv, found.angle, found.descriptor)


def world(seed: int, pictures: int = 90, effects: Effects = EFFECTS) -> RenderedScene:
    """The look-alikes of a seed."""
    return lookalikes(seed, pictures=pictures, effects=effects)


def recognised(
    given: list[PictureFeatures], vocabulary: Vocabulary, settings: RecognitionSettings, seed: int
) -> tuple[list[Recognition], IntArray, Array]:
    """Recognise pictures in their order; with them the first by score of each, and its score."""
    recogniser = Recogniser(vocabulary, np.random.default_rng(seed), settings)
    found, first, score = [], np.full(len(given), -1), np.zeros(len(given))
    for k, one in enumerate(given):
        found.append(recogniser.see(*one))
        allowed = np.arange(k + 1) < k - settings.gap
        by_score = recogniser.index.query(recogniser.pictures[k].bag, allowed)
        if len(by_score.entry):
            best = int(np.argmax(by_score.score))
            first[k], score[k] = by_score.entry[best], by_score.score[best]
    return found, first, score


def judged_by(
    recognitions: tuple[list[Recognition], IntArray, Array], right: BoolArray, wrong: BoolArray
) -> SeenPictures:
    """What was recognised, beside the truth: ``right`` and ``wrong`` (K, K), picture and candidate."""
    found, first, score = recognitions
    entry = np.array([one.best.entry for one in found])
    rows, there = np.arange(len(found)), entry >= 0
    return SeenPictures(
        entry,
        np.array([one.best.support for one in found]),
        np.array([one.entry >= 0 for one in found]),
        there & right[rows, entry],
        there & wrong[rows, entry],
        first,
        score,
    )


def truth(shared: Array) -> tuple[BoolArray, BoolArray]:
    """Pairs (K, K) of one place, and pairs without a common scene point, from shares (K, K)."""
    most = np.maximum(shared, shared.T)
    return most >= SEEN, most == 0.0


def choose(worlds: list[SeenPictures], near: int) -> tuple[int, int]:
    """The two thresholds, by the rule above, from the best candidates of worlds.

    Examples
    --------
    >>> none, good = np.zeros(4, bool), np.array([True, False, False, True])
    >>> one = SeenPictures(np.array([5, 9, 10, 5]), np.array([60, 12, 19, 50]), none, good, ~good, none, none)
    >>> choose([one], 3)
    (21, 14)
    """
    sure = max(float(one.support[one.wrong].max(initial=0)) for one in worlds)
    together = 0.0
    for one in worlds:
        both = np.minimum(one.support[1:], one.support[:-1])
        close = np.abs(np.diff(one.entry)) <= near
        together = max(together, float(both[one.wrong[1:] & close & (one.entry[:-1] >= 0)].max(initial=0)))
    return math.ceil(MARGIN * sure), math.ceil(MARGIN * together)


def main() -> int:
    """Print the choice."""
    settings, vocabulary, worlds = RecognitionSettings(gap=GAP), shipped_vocabulary(), []
    for seed in CHOOSING:
        made = world(seed, PICTURES, HARDER)
        given = [features(made.frame(k)) for k in range(len(made))]
        right, wrong = truth(overlap(made))
        seen = judged_by(recognised(given, vocabulary, settings, seed), right, wrong)
        worlds.append(seen)
        back = right[np.arange(len(made)), : len(made) // 2].any(1) & (np.arange(len(made)) >= len(made) // 2)
        top = sorted(seen.support[seen.wrong].tolist(), reverse=True)[:5]
        sure, likely = choose(worlds, settings.near)
        low = np.percentile(seen.support[seen.right & back], [0, 10, 50])
        print(
            f"seed {seed}: revisits {back.sum()}, right {(seen.right & back).sum()} with support {low}; "
            f"wrong {seen.wrong.sum()}, most {top}; so far sure {sure}, likely {likely}",
            flush=True,
        )
    for one in worlds:
        both = np.minimum(one.support, np.concatenate([[0], one.support[:-1]]))
        near = np.abs(one.entry - np.concatenate([[-99], one.entry[:-1]])) <= settings.near
        found = (one.support >= sure) | (near & (both >= likely))
        print(f"found {(found & one.right).sum()}, wrong {(found & one.wrong).sum()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
