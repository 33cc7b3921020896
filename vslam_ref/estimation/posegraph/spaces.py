"""The three spaces in which the poses of a graph live, by the names that the house uses for them.

========  =============================  ====================  ========  =============================
name      an element                     a pose graph of       tangents  its module
========  =============================  ====================  ========  =============================
``se2``   (x, y, theta)                  a robot on a floor    3         :mod:`~vslam_ref.geometry.se2`
``se3``   4 x 4, rotation                anything in space     6         :mod:`~vslam_ref.geometry.se3`
``sim3``  4 x 4, scale times rotation    one camera's views    7         :mod:`~vslam_ref.geometry.sim3`
========  =============================  ====================  ========  =============================

Tangent vectors are (translation, rotation, log-scale), metres and radians.
"""

from __future__ import annotations

from types import ModuleType
from typing import Literal

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import se2, se3, sim3, so2

Space = Literal["se2", "se3", "sim3"]
GROUPS: dict[str, ModuleType] = {"se2": se2, "se3": se3, "sim3": sim3}
WORDS: dict[str, str] = {"se2": "SE(2)", "se3": "SE(3)", "sim3": "Sim(3)"}


def tangent_size(space: Space) -> int:
    """Number of coordinates of a step: 3, 6 or 7.

    Examples
    --------
    >>> [tangent_size(space) for space in ("se2", "se3", "sim3")]
    [3, 6, 7]
    """
    return int(GROUPS[space].DOF)


def element_shape(space: Space) -> tuple[int, ...]:
    """Shape of one element.

    Examples
    --------
    >>> element_shape("se2"), element_shape("se3")
    ((3,), (4, 4))
    """
    return (3,) if space == "se2" else (4, 4)


def rotations(space: Space, T: Array) -> Array:
    """Rotation matrices of elements, (..., 2, 2) or (..., 3, 3)."""
    return so2.exp(T[..., 2]) if space == "se2" else np.asarray(GROUPS[space].rotation(T))


def translations(space: Space, T: Array) -> Array:
    """Translations of elements, (..., 2) or (..., 3), metres."""
    return T[..., :2] if space == "se2" else T[..., :3, 3]


def scales(space: Space, T: Array) -> Array:
    """Scales of elements, (...); ones where the space has none."""
    return sim3.scale(T) if space == "sim3" else np.ones(T.shape[: T.ndim - len(element_shape(space))])


def joined(space: Space, R: Array, t: Array, s: Array) -> Array:
    """Elements from rotations R (..., k, k), translations t (..., k) in metres, and scales s (...)."""
    if space == "se2":
        return np.concatenate([t, so2.log(R)[..., None]], -1)
    return se3.from_rt(R, t) if space == "se3" else sim3.from_srt(s, R, t)


def moved(space: Space, T: Array, step: Array) -> Array:
    """T Exp(step), elements (..., k) or (..., 4, 4) and tangent vectors (..., d).

    The step is on the *right*, in the body's own frame.
    """
    group = GROUPS[space]
    return np.asarray(group.compose(T, group.exp(step)))
