"""Which 256 pairs tell patches apart: tests that are often right and often wrong, and no two that agree.

A pair is worth more the nearer its test is to being true for half of all patches: then its bit varies most.
And a pair that says what others said already is worth nothing.  So the candidates are sorted by the
distance of their mean from one half, and taken in this order, each unless its correlation with one that was
taken is at or above a limit.  Where too few are left, the limit is raised, and all begins anew.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.hamming import Words, bit_count, words
from vslam_ref.features.levels import Bytes
from vslam_ref.features.orb.description import smooth, turned_pixels
from vslam_ref.features.orb.direction import moments, towards
from vslam_ref.features.orb.extraction import located, shares
from vslam_ref.features.orb.scales import octave_images
from vslam_ref.features.orb.settings import OrbSettings

REACH = 13
"""Pairs lie within so many pixels of the centre, to each side: turned, they reach 18."""
GRID = np.stack(np.meshgrid(np.arange(-REACH, REACH + 1), np.arange(-REACH, REACH + 1)), -1).reshape(-1, 2)
"""Offsets (729, 2) of all pixels (x, y) that may be compared, row by row."""
FIRST_LIMIT, STEP = 0.20, 0.04
PORTION = 1000


class LearnedPairs(NamedTuple):
    """A table of pairs and how it came about.

    Attributes
    ----------
    pairs : ndarray of int64, shape (wanted, 4)
        x, y of the first pixel and of the second, in the order in which they were taken.
    limit : float
        The limit of the correlation that let enough pass.
    mean : ndarray, shape (wanted,)
        Share of the patches for which the first pixel is darker.
    """

    pairs: IntArray
    limit: float
    mean: Array


def patches(image: ArrayLike, settings: OrbSettings) -> Bytes:
    """Smoothed grey levels around the features of a picture, turned by their angles.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    settings : OrbSettings

    Returns
    -------
    ndarray of uint8, shape (n, 729)
        At the offsets ``GRID``, pixels of the octave.
    """
    found = [np.zeros((0, len(GRID)), np.uint8)]
    images = octave_images(image, settings.octaves, settings.scale)
    for octave, wanted in zip(images, shares(settings), strict=False):
        xy = located(octave, wanted, settings).xy
        if len(xy):
            found.append(turned_pixels(smooth(octave), xy, towards(moments(octave, xy)), GRID))
    return np.concatenate(found)


def drawn(count: int, rng: np.random.Generator) -> IntArray:
    """``count`` different pairs (count, 2) of numbers in ``GRID``, without unit, the first one smaller."""
    size = len(GRID)
    at = rng.choice(size * (size - 1) // 2, count, replace=False)
    first, second = np.triu_indices(size, 1)
    return np.stack([first[at], second[at]], 1)


def learn(patch: Bytes, candidate: IntArray, wanted: int = 256) -> LearnedPairs:
    """Choose pairs by the rule of ORB: spread means first, then little correlation.

    Implements :eq:`eq-orb-learn`.

    Parameters
    ----------
    patch : ndarray of uint8, shape (n, 729)
        As :func:`patches` gives them.
    candidate : ndarray of int64, shape (m, 2)
        Pairs of numbers in ``GRID``, without a unit.
    wanted : int

    Returns
    -------
    LearnedPairs

    Raises
    ------
    ValueError
        If there are fewer candidates than wanted, or fewer than two patches.

    Examples
    --------
    >>> patch = np.random.default_rng(0).integers(0, 256, (500, 729), dtype=np.uint8)
    >>> found = learn(patch, drawn(40, np.random.default_rng(1)), 8)
    >>> found.pairs.shape, found.limit
    ((8, 4), 0.2)
    """
    if len(candidate) < wanted or len(patch) < 2:
        raise ValueError(
            f"{len(candidate)} candidates and {len(patch)} patches: need {wanted} candidates and 2 patches"
        )
    taken, limit, mean = choose(patch, candidate, wanted)
    chosen = candidate[taken]
    return LearnedPairs(np.concatenate([GRID[chosen[:, 0]], GRID[chosen[:, 1]]], 1), limit, mean)


def choose(value: Bytes | Array, candidate: IntArray, wanted: int) -> tuple[IntArray, float, Array]:
    """Choose comparisons of values (n, k), grey levels, by the rule of ORB.

    Implements :eq:`eq-orb-learn`.

    Parameters
    ----------
    value : ndarray, shape (n, k)
        Of any unit.
    candidate : ndarray of int64, shape (m, 2)
        Pairs of columns; a comparison is true where the first is the smaller.
    wanted : int

    Returns
    -------
    taken : ndarray of int64, shape (wanted,)
        Numbers of candidates, in the order in which they were taken.
    limit : float
        The limit of the correlation that let enough pass.
    mean : ndarray, shape (wanted,)
        Share of the n for which each is true.

    Raises
    ------
    ValueError
        If fewer candidates than wanted are ever true and ever false and differ from each other.

    Examples
    --------
    >>> value = np.random.default_rng(0).normal(size=(500, 9))
    >>> choose(value, np.array([[0, 1], [2, 3], [4, 5]]), 2)[1]
    0.2
    """
    packed, count = _bits(value, candidate)
    order = np.argsort(np.abs(2 * count - len(value)), kind="stable")
    packed, count = packed[order], count[order]
    known: dict[int, Array] = {}
    limit, taken = FIRST_LIMIT, _greedy(packed, count, len(value), FIRST_LIMIT, wanted, known)
    while len(taken) < wanted:
        if limit > 1:
            raise ValueError(f"{len(taken)} comparisons tell values apart: need {wanted}")
        limit = round(limit + STEP, 2)
        taken = _greedy(packed, count, len(value), limit, wanted, known)
    return order[taken], limit, count[taken] / len(value)


def _bits(patch: Bytes | Array, candidate: IntArray) -> tuple[Words, IntArray]:
    """Answers of all candidates, packed as words of 64 patches (m, words), and how often each is true."""
    pixel = np.ascontiguousarray(patch.T)
    found = []
    for low in range(0, len(candidate), PORTION):
        first, second = candidate[low : low + PORTION].T
        found.append(words(np.packbits(pixel[first] < pixel[second], axis=1)))
    packed = np.concatenate(found)
    return packed, _counted(packed)


def _counted(packed: Words) -> IntArray:
    """Bits that are set in each row."""
    parts = [packed[k : k + PORTION] for k in range(0, len(packed), PORTION)]
    return np.concatenate([bit_count(part).sum(1, dtype=np.int64) for part in parts])


def _greedy(
    packed: Words, count: IntArray, n: int, limit: float, wanted: int, known: dict[int, Array]
) -> list[int]:
    """Take candidates in their order; strike out all that are too much correlated with one taken."""
    left = count % n > 0  # what is always true, or never, tells nothing
    taken: list[int] = []
    while left.any() and len(taken) < wanted:
        k = int(np.argmax(left))
        taken.append(k)
        if k not in known:
            both = _counted(packed & packed[k])
            spread = np.sqrt((count * (n - count)).astype(np.float64) * float(count[k] * (n - count[k])))
            known[k] = np.abs(n * both - count * count[k]) / np.maximum(spread, 1.0)
        left &= known[k] < limit  # eq-orb-learn
    return taken
