"""Equidistant fisheye with four coefficients (Kannala and Brandt): OpenCV's ``fisheye``.

A ray at the angle theta off the axis appears at the radius d = theta (1 + k1 theta^2 + ... + k4 theta^8).
It needs no plane z = 1, so a lens may see more than a half-space: theta runs to pi.

With rho = hypot(x, y), theta = atan2(rho, z), g = theta / rho and kappa = d / theta everything is smooth on
the axis::

    xd = kappa(theta^2) g (x, y)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray, as_array
from vslam_ref.geometry.cameras._batches import flatten, of
from vslam_ref.geometry.cameras._roots import first_positive_root, for_each_lens, solve_increasing
from vslam_ref.geometry.cameras._series import ARCTAN_SERIES, arctan_ratio
from vslam_ref.geometry.cameras.camera import Camera
from vslam_ref.geometry.cameras.interface import Distorted, DistortedJacobians, Lens, Rays

LARGEST_ANGLE = np.pi - 1e-6
"""Straight behind the camera every direction of the image is the same point."""
_TINY, _HUGE = 1e-100, 1e100
"""Points nearer or farther than this, in the unit of X, are not valid: their squares under- or overflow."""


class _Angle(NamedTuple):
    """Angle off the axis, its square, g = theta / rho, x, y, z, rho^2 and z^2 + rho^2, and validity."""

    theta: Array
    p: Array
    g: Array
    X: Array
    rho2: Array
    r2: Array
    valid: BoolArray


def _coefficients(k: ArrayLike) -> Array:
    return as_array("k of the fisheye lens", k, 4)


def _kappa(k: Array, p: Array) -> tuple[Array, Array]:
    """Quotient d / theta as a function of p = theta^2, and its derivative."""
    k1, k2, k3, k4 = np.moveaxis(k, -1, 0)
    return 1 + p * (k1 + p * (k2 + p * (k3 + p * k4))), k1 + p * (2 * k2 + p * (3 * k3 + p * 4 * k4))


@lru_cache(maxsize=4096)
def _largest_angle_of(k: tuple[float, ...]) -> float:
    if not np.isfinite(k).all():
        return 0.0
    slope = [1.0, *(c * (2 * n + 3) for n, c in enumerate(k))]
    return min(math.sqrt(first_positive_root(slope)), LARGEST_ANGLE)


def field_angle(k: ArrayLike) -> Array:
    """Angle off the axis at which d stops growing, d'(theta) = 0, at most ``LARGEST_ANGLE``.

    Parameters
    ----------
    k : array_like, shape (..., 4)
        Lens parameters.

    Examples
    --------
    >>> float(field_angle([-0.1, 0, 0, 0]))  # 1 - 0.3 theta^2 = 0
    1.825741858350...
    """
    return for_each_lens(_largest_angle_of, _coefficients(k))


def _angle(k: Array, X_cam: ArrayLike) -> _Angle:
    X = as_array("X_cam", X_cam, 3)
    X = np.broadcast_to(X, (*np.broadcast_shapes(X.shape[:-1], k.shape[:-1]), 3))
    size = np.abs(X).max(axis=-1)
    valid = (size > _TINY) & (size < _HUGE)  # false for NaN
    theta = np.arctan2(np.hypot(X[..., 0], X[..., 1]), X[..., 2])
    valid &= theta < field_angle(k)
    X = np.where(valid[..., None], X, np.array([0.0, 0.0, 1.0]))
    rho2, z = X[..., 0] ** 2 + X[..., 1] ** 2, X[..., 2]
    theta = np.where(valid, theta, 0.0)
    rho = np.sqrt(rho2)
    on_axis = rho <= 1e-8 * z  # there theta / rho = 1/z to 1e-17
    g = np.where(on_axis, 1.0, theta) / np.where(on_axis, z, np.where(rho > 0, rho, 1.0))
    return _Angle(theta, theta * theta, g, X, rho2, rho2 + z * z, valid)


def distort(k: ArrayLike, X_cam: ArrayLike) -> Distorted:
    """Distorted position.

    Implements :eq:`eq-fisheye`.

    Parameters
    ----------
    k : array_like, shape (..., 4)
        k1 to k4.
    X_cam : array_like, shape (..., 3)
        Points in the camera's frame; z may be zero or negative if the field reaches there.

    Returns
    -------
    Distorted
        Not valid outside the invertible field, nor for points so near or far that squares overflow.

    Examples
    --------
    >>> distort([0, 0, 0, 0], [1.0, 0.0, 0.0]).xd  # a right angle
    array([1.57079633, 0.        ])
    """
    k = _coefficients(k)
    at = _angle(k, X_cam)
    return Distorted(at.X[..., :2] * (_kappa(k, at.p)[0] * at.g)[..., None], at.valid)


def distort_with_jacobians(k: ArrayLike, X_cam: ArrayLike) -> DistortedJacobians:
    """:func:`distort` and its Jacobians in the point (..., 2, 3), per unit of X, and in ``k`` (..., 2, n).

    Implements :eq:`eq-fisheye-jacobian`.
    dg/d(x, y) = e (x, y) with e = (z/R^2 - g)/rho^2 and dg/dz = -1/R^2; with p = theta^2,
    dp/d(x, y) = 2 g z (x, y) / R^2 and dp/dz = -2 g rho^2 / R^2.
    """
    k = _coefficients(k)
    at = _angle(k, X_cam)
    kappa, slope = _kappa(k, at.p)
    xy, z = at.X[..., :2], at.X[..., 2]
    dg, dp = np.empty(at.X.shape), np.empty(at.X.shape)
    dg[..., :2] = xy * _bend(at)[..., None]
    dg[..., 2] = -1.0 / at.r2
    dp[..., :2] = xy * (2 * at.g * z / at.r2)[..., None]
    dp[..., 2] = -2 * at.g * at.rho2 / at.r2
    dG = kappa[..., None] * dg + (at.g * slope)[..., None] * dp
    J_X = xy[..., :, None] * dG[..., None, :]
    J_X[..., :2] += (kappa * at.g)[..., None, None] * np.eye(2)
    powers = at.p[..., None] ** np.arange(1, 5)
    J_k = (xy * at.g[..., None])[..., None] * powers[..., None, :]
    inside = at.valid[..., None, None]
    xd = xy * (kappa * at.g)[..., None]
    return DistortedJacobians(xd, at.valid, np.where(inside, J_X, 0.0), np.where(inside, J_k, 0.0))


def _bend(at: _Angle) -> Array:
    """Factor e = (z/R^2 - theta/rho) / rho^2; near the axis 2 S'(rho^2/z^2) / z^3."""
    z = at.X[..., 2]
    near = (z > 0) & (at.rho2 < ARCTAN_SERIES * z * z)
    safe_z = np.where(near, z, 1.0)
    _, slope = arctan_ratio(np.where(near, at.rho2, 0.0) / safe_z**2)
    closed = (z / at.r2 - at.g) / np.where(near, 1.0, at.rho2)
    return np.where(near, 2 * slope / safe_z**3, closed)


def undistort(k: ArrayLike, xd: ArrayLike) -> Rays:
    """Ray of a distorted position.

    Parameters
    ----------
    k : array_like, shape (..., 4)
        k1 to k4.
    xd : array_like, shape (..., 2)
        Distorted positions, in focal lengths (no unit).

    Returns
    -------
    Rays
        Valid inside the image of the invertible field.

    Notes
    -----
    One increasing equation, d(theta) = hypot(xd, yd), by a bracketed Newton iteration that cannot fail.

    Examples
    --------
    >>> undistort([0, 0, 0, 0], [np.pi / 2, 0.0]).bearing.round(12)
    array([1., 0., 0.])
    """
    batch = flatten(_coefficients(k), as_array("xd", xd, 2))
    edge = np.broadcast_to(field_angle(k), batch.shape).ravel()

    def grow(theta: Array, at: IntArray) -> tuple[Array, Array]:
        p = theta * theta
        kappa, slope = _kappa(of(batch.k, at), p)
        return theta * kappa, kappa + 2 * p * slope  # eq-fisheye

    size = np.hypot(batch.xd[:, 0], batch.xd[:, 1])
    valid = size < grow(edge, np.arange(len(edge)))[0]  # false for NaN
    theta = solve_increasing(grow, np.where(valid, size, 0.0), edge)
    scale = np.sinc(theta / np.pi) / _kappa(batch.k, theta * theta)[0]
    bearing = np.empty((len(edge), 3))
    bearing[:, :2] = np.where(valid[:, None], batch.xd, 0.0) * scale[:, None]
    bearing[:, 2] = np.cos(np.where(valid, theta, 0.0))
    bearing /= np.linalg.norm(bearing, axis=-1, keepdims=True)
    return Rays(bearing.reshape(*batch.shape, 3), valid.reshape(batch.shape))


def max_angle(k: ArrayLike) -> float:
    """Half of the invertible field of parameters (n,), a number in radians."""
    return float(field_angle(k))


LENS = Lens(("k1", "k2", "k3", "k4"), distort, distort_with_jacobians, undistort, max_angle)


@dataclass(frozen=True)
class Fisheye(Camera):
    """Equidistant fisheye camera.

    Parameters
    ----------
    fx, fy, cx, cy : float
        Focal lengths and principal point, pixels.
    k1, k2, k3, k4 : float
        Coefficients of theta^3, theta^5, theta^7, theta^9.

    Examples
    --------
    >>> camera = Fisheye(fx=300, fy=300, cx=320, cy=240, k1=0.01, k2=-0.005, k3=0.0, k4=0.0)
    >>> camera.unproject(camera.project([1.0, 2.0, -0.5]).uv).bearing * np.sqrt(5.25)
    array([ 1. ,  2. , -0.5])
    """

    k1: float
    k2: float
    k3: float
    k4: float
    lens: ClassVar[Lens] = LENS
