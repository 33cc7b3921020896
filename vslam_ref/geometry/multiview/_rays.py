"""Rays: the plane across a bearing, and the largest angle of a bundle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array


def across(bearings: Array) -> Array:
    """Two unit vectors across each bearing and across each other, (..., 3) -> (..., 2, 3).

    The coordinate axis that is least along b is made perpendicular to it; the cross product is the other.
    """
    least = np.argmin(np.abs(bearings), axis=-1)
    axis = np.eye(3)[least]
    first = axis - np.sum(axis * bearings, axis=-1, keepdims=True) * bearings
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([first, np.cross(bearings, first)], axis=-2)


def largest_angle(directions: Array, used: NDArray[np.bool_]) -> Array:
    """Largest angle between two of the unit vectors (N, V, 3) that are used (N, V); 0 for fewer than two.

    From the chord, 2 asin(|a - b| / 2): the arc cosine would lose the small angles that matter here.
    """
    chord = np.zeros(len(directions))
    for v in range(directions.shape[1]):
        length = np.linalg.norm(directions - directions[:, v : v + 1], axis=-1)
        both = used & used[:, v : v + 1]
        chord = np.maximum(chord, np.where(both, length, 0.0).max(axis=1, initial=0.0))
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0)))
