r"""Features near places where points should appear, and among them the one described most alike.

A place has a window, a range of octaves and a descriptor.  Of the features in the window on these octaves,
the one with the smallest Hamming distance answers, the first of equals.  It must be clearly nearer than the
*second*, the next one on its own octave: the same corner on the octave beside it is no rival.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.hamming import differing
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.systems.visual_map.keyframe_map import Bytes

FAR = 257
"""Bits: farther than any descriptor."""


class Places(NamedTuple):
    """Where features are expected.

    Attributes
    ----------
    uv : ndarray, shape (m, 2)
        Pixels of level 0.
    radius : ndarray, shape (m,)
        Half side of the window, pixels of level 0.
    low, high : ndarray of int64, shape (m,)
        Octaves.
    descriptor : ndarray of uint8, shape (m, 32)
    """

    uv: Array
    radius: Array
    low: IntArray
    high: IntArray
    descriptor: Bytes


class Answers(NamedTuple):
    """Best ``feature (m,)`` of each place, or -1; its ``distance (m,)`` and the ``second (m,)``, in bits."""

    feature: IntArray
    distance: IntArray
    second: IntArray


def search_windows(places: Places, features: OrbFeatures) -> Answers:
    """Find the feature most alike in the window of each place.

    Implements :eq:`eq-window-answer`, pixels of level 0.
    """
    return Answers(
        *_search(
            places.uv,
            np.asarray(places.radius, np.float64),
            places.low,
            places.high,
            np.ascontiguousarray(places.descriptor),
            features.uv,
            features.octave,
            np.ascontiguousarray(features.descriptor),
        )
    )


def assigned(answers: Answers, *, limit: int, ratio: float, room: int) -> IntArray:
    """Feature (m,) of each place, or -1: near enough, clearly nearest, and no feature twice.

    Parameters
    ----------
    answers : Answers
    limit : int
        Largest distance, bits.
    ratio : float
        The second must be farther than the distance over this.
    room : int
        How many features there are.
    """
    ok = (answers.feature >= 0) & (answers.distance <= limit) & (answers.distance <= ratio * answers.second)
    rows = np.flatnonzero(ok)
    rows = rows[np.argsort(answers.distance[rows], kind="stable")[::-1]]
    owner = np.full(room, -1)
    owner[answers.feature[rows]] = rows  # the nearest, and of equals the first, is written last
    feature = np.full(len(ok), -1)
    taken = np.flatnonzero(owner >= 0)
    feature[owner[taken]] = taken
    return feature


@accelerated("windows:search")
def _search(
    uv: Array,
    radius: Array,
    low: IntArray,
    high: IntArray,
    descriptor: Bytes,
    feature_uv: Array,
    octave: IntArray,
    feature_descriptor: Bytes,
) -> tuple[IntArray, IntArray, IntArray]:
    """Fields of :class:`Answers` for places (m,) and features (n,)."""
    best, least, second = np.full(len(uv), -1), np.full(len(uv), FAR), np.full(len(uv), FAR)
    apart = np.abs(uv[:, None] - feature_uv).max(-1, initial=0.0)
    close = (apart <= radius[:, None]) & (octave >= low[:, None]) & (octave <= high[:, None])
    row, column = np.nonzero(close)
    bits = differing(descriptor[row], feature_descriptor[column])
    order = np.lexsort((column, bits, row))
    row, column, bits = row[order], column[order], bits[order]
    rows, first = np.unique(row, return_index=True)
    best[rows], least[rows] = column[first], bits[first]
    rival = (octave[column] == octave[best[row]]) & (column != best[row])
    rows, first = np.unique(row[rival], return_index=True)
    second[rows] = bits[rival][first]
    return best, least, second
