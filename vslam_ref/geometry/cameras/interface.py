"""What every camera model offers, and the shapes of its answers.

A projection has two steps.  The *lens* maps a point in the camera's frame to a distorted normalised
position ``xd``: where it appears, in focal lengths from the centre.  The *sensor* turns this into pixels::

    X_cam (..., 3)  -- lens, parameters k -->  xd (..., 2)  -- fx, fy, cx, cy -->  uv (..., 2)

What cannot be computed is flagged, never NaN: where ``valid`` is False, a projection is the principal point,
a ray is the optical axis, and all Jacobians are zero.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array

MAX_TAN = 1e6
"""Largest x/z and y/z of the models that go through the plane z = 1.

No lens shows a ray 1e-6 rad from that plane; inside the bound no power of a model overflows.
"""
MIN_DEPTH = 1e-100
"""Depth, in the unit of X, above which 1/z and its square are ordinary numbers."""


class Projection(NamedTuple):
    """Pixels (..., 2) and whether each is the image of its point (...)."""

    uv: Array
    valid: BoolArray


class ProjectionJacobians(NamedTuple):
    """``uv (..., 2)`` in pixels, ``valid (...)``, ``J_point (..., 2, 3)``, ``J_intrinsics (..., 2, n)``."""

    uv: Array
    valid: BoolArray
    J_point: Array
    J_intrinsics: Array


class WorldProjectionJacobians(NamedTuple):
    """Projection of a world point: ``uv (..., 2)`` in pixels, ``valid (...)``, and its Jacobians.

    ``J_pose (..., 2, 6)`` is for T <- Exp(xi) T with xi = (rho, phi); ``J_point (..., 2, 3)``;
    ``J_intrinsics (..., 2, n)``.
    """

    uv: Array
    valid: BoolArray
    J_pose: Array
    J_point: Array
    J_intrinsics: Array


class Rays(NamedTuple):
    """Unit ``bearing (..., 3)`` in the camera's frame; ``valid (...)``: the model has a ray for the pixel."""

    bearing: Array
    valid: BoolArray

    @property
    def xn(self) -> Array:
        """Normalised positions (x/z, y/z), shape (..., 2); zero for rays that do not cross z = 1."""
        return normalise(self.bearing)[0]


class RayJacobians(NamedTuple):
    """Unit ``bearing (..., 3)``, ``valid (...)``, and ``J_pixel (..., 3, 2)`` per pixel."""

    bearing: Array
    valid: BoolArray
    J_pixel: Array


class Distorted(NamedTuple):
    """Distorted normalised positions (..., 2) and whether the point is inside the lens's field (...)."""

    xd: Array
    valid: BoolArray


class DistortedJacobians(NamedTuple):
    """``xd (..., 2)``, ``valid (...)``, ``J_point (..., 2, 3)``, ``J_lens (..., 2, k)``; no unit."""

    xd: Array
    valid: BoolArray
    J_point: Array
    J_lens: Array


class Lens(NamedTuple):
    """The functions of one lens model; parameters ``k`` broadcast against points.

    Parameters
    ----------
    names : tuple of str
        The lens parameters in the order of ``k``.
    distort : callable
        ``(k, X_cam) -> Distorted``.
    distort_with_jacobians : callable
        ``(k, X_cam) -> DistortedJacobians``.
    undistort : callable
        ``(k, xd) -> Rays``.
    max_angle : callable
        ``k (n,) -> float``: angle off the axis, radians, at which the invertible field ends.
    """

    names: tuple[str, ...]
    distort: Callable[[ArrayLike, ArrayLike], Distorted]
    distort_with_jacobians: Callable[[ArrayLike, ArrayLike], DistortedJacobians]
    undistort: Callable[[ArrayLike, ArrayLike], Rays]
    max_angle: Callable[[ArrayLike], float]


def normalise(X_cam: ArrayLike) -> tuple[Array, BoolArray]:
    """Divide points (..., 3) of any unit by their depth: xn (..., 2), and whether each is in front (...).

    In front is z > ``MIN_DEPTH`` with x and y less than ``MAX_TAN`` z in size; NaN and infinity are not.
    For a point that is not in front, xn is zero.

    Examples
    --------
    >>> normalise([[1.0, 2.0, 4.0], [1.0, 2.0, -4.0]])
    (array([[0.25, 0.5 ],
           [0.  , 0.  ]]), array([ True, False]))
    """
    X = as_array("X_cam", X_cam, 3)
    z = X[..., 2]
    front = (z > MIN_DEPTH) & (z < np.inf)
    bound = MAX_TAN * np.where(front, z, 0.0)
    front &= (np.abs(X[..., 0]) < bound) & (np.abs(X[..., 1]) < bound)
    depth = np.where(front, z, 1.0)[..., None]
    return np.where(front[..., None], X[..., :2], 0.0) / depth, front


def normalise_jacobian(X_cam: ArrayLike) -> DistortedJacobians:
    """:func:`normalise` with its Jacobian (..., 2, 3), per unit of X, as a lens without parameters."""
    X = as_array("X_cam", X_cam, 3)
    xn, front = normalise(X)
    J = np.zeros((*front.shape, 2, 3))
    inverse_depth = np.where(front, 1.0 / np.where(front, X[..., 2], 1.0), 0.0)
    J[..., 0, 0] = J[..., 1, 1] = inverse_depth
    J[..., 2] = -xn * inverse_depth[..., None]
    return DistortedJacobians(xn, front, J, np.zeros((*front.shape, 2, 0)))


def rays_through(xn: Array, valid: BoolArray) -> Rays:
    """Unit bearings (..., 3) of normalised positions (..., 2); the optical axis where not valid."""
    X = np.concatenate([np.where(valid[..., None], xn, 0.0), np.ones((*xn.shape[:-1], 1))], -1)
    return Rays(X / np.linalg.norm(X, axis=-1, keepdims=True), valid)
