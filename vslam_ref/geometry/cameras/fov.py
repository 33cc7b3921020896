"""The FOV (arctangent) camera of PTAM: a fisheye lens with one parameter, the angle omega.

A ray at the angle theta off the axis, r = tan(theta), appears at r' = arctan(2 r tan(omega/2)) / omega.
For omega -> 0 this is the pinhole.  All of the half-space in front of the camera has an image, inside
the radius pi / (2 omega); the inverse is r = tan(r' omega) / (2 tan(omega/2)).

With T = 2 tan(omega/2), A = T / omega, q = r^2 and S(Q) = arctan(sqrt Q) / sqrt Q everything is smooth at
r = 0 and at omega = 0::

    xd = F xn,   F = r'/r = A S(T^2 q)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.geometry.cameras._series import arctan_ratio, tan_ratio, tan_ratio_slope
from vslam_ref.geometry.cameras.camera import Camera
from vslam_ref.geometry.cameras.interface import (
    MAX_TAN,
    Distorted,
    DistortedJacobians,
    Lens,
    Rays,
    normalise,
    normalise_jacobian,
    rays_through,
)


def _omega(k: ArrayLike) -> Array:
    omega = as_array("k of the FOV lens", k, 1)[..., 0]
    if not (np.abs(omega) < np.pi).all():
        raise ValueError("omega must lie between -pi and pi (its sign does not matter)")
    return omega


def distort(k: ArrayLike, X_cam: ArrayLike) -> Distorted:
    """Distorted normalised position.

    Implements :eq:`eq-a2-3` (A2.3) and :eq:`eq-a2-4` (A2.4).

    Parameters
    ----------
    k : array_like, shape (..., 1)
        omega, radians, below pi.
    X_cam : array_like, shape (..., 3)
        Points in the camera's frame; any unit.

    Returns
    -------
    Distorted
        Not valid behind the camera, z <= 0: there (A2.2) would draw a mirrored image.

    Raises
    ------
    ValueError
        On a wrong shape, or an omega outside this range.

    Examples
    --------
    >>> distort([1.0], [1.0, 0.0, 1.0]).xd.round(6)  # arctan(2 tan(1/2))
    array([0.829623, 0.      ])
    """
    omega = _omega(k)
    xn, front = normalise(X_cam)
    A = tan_ratio(omega)
    S, _ = arctan_ratio((omega * A) ** 2 * (xn * xn).sum(-1))
    # eq-fov-factor
    return Distorted(xn * (A * S)[..., None], np.broadcast_to(front, S.shape))


def distort_with_jacobians(k: ArrayLike, X_cam: ArrayLike) -> DistortedJacobians:
    """:func:`distort` and its Jacobians in the point (..., 2, 3), per unit of X, and in omega (..., 2, 1).

    Implements :eq:`eq-fov-jacobian` and :eq:`eq-fov-omega`.
    dxd/dxn = F I + 2 F_q xn xn^T with F_q = A S' T^2, and dF/domega = A' S + A S' 2 T T' q, T' = 1 + T^2/4.
    """
    omega = _omega(k)
    xn, front, J_xn, _ = normalise_jacobian(X_cam)
    A, dA = tan_ratio(omega), tan_ratio_slope(omega)
    T, q = omega * A, (xn * xn).sum(-1)
    S, dS = arctan_ratio(T * T * q)
    # eq-fov-factor
    F, dF_dq = A * S, A * dS * T * T
    J = F[..., None, None] * np.eye(2) + 2 * dF_dq[..., None, None] * xn[..., :, None] * xn[..., None, :]
    dF_domega = dA * S + A * dS * 2 * T * (1 + T * T / 4) * q
    J_lens = (xn * dF_domega[..., None])[..., None]
    return DistortedJacobians(xn * F[..., None], np.broadcast_to(front, F.shape), J @ J_xn, J_lens)


def undistort(k: ArrayLike, xd: ArrayLike) -> Rays:
    """Ray of a distorted position, in closed form: xn = xd tan(s) / (s A) with s = omega r'.

    Implements :eq:`eq-fov-inverse`.

    Parameters
    ----------
    k : array_like, shape (..., 1)
        omega.
    xd : array_like, shape (..., 2)
        Distorted normalised positions, in focal lengths (no unit).

    Returns
    -------
    Rays
        Valid for s < pi/2 as far as r < ``MAX_TAN``.

    Examples
    --------
    >>> undistort([1.0], [0.829623, 0.0]).xn.round(5)
    array([1., 0.])
    """
    omega = _omega(k)
    xd = as_array("xd", xd, 2)
    given: BoolArray = np.asarray((np.abs(xd) < 1e100).all(axis=-1))  # false for NaN
    xd = np.where(given[..., None], xd, 0.0)
    s = np.abs(omega) * np.hypot(xd[..., 0], xd[..., 1])
    valid = given & (s < np.pi / 2)
    ratio = tan_ratio(2 * np.where(valid, s, 0.0)) / tan_ratio(omega)
    xn = xd * ratio[..., None]
    return rays_through(xn, valid & (np.abs(xn) < MAX_TAN).all(axis=-1))


def max_angle(k: ArrayLike) -> float:
    """Half of the field, a number in radians: a right angle less 1e-6 for every ``k (1,)``."""
    return float(np.arctan(MAX_TAN))


LENS = Lens(("omega",), distort, distort_with_jacobians, undistort, max_angle)


@dataclass(frozen=True)
class Fov(Camera):
    """FOV (ATAN) camera, the model of PTAM.

    Implements :eq:`eq-a2-2` (A2.2).

    Parameters
    ----------
    fx, fy : float
        Focal lengths in pixels, the report's f_u and f_v.
    cx, cy : float
        Principal point in pixels, its u_0 and v_0.
    omega : float
        Distortion angle, radians, 0 <= omega < pi.

    Examples
    --------
    >>> camera = Fov(fx=250.0, fy=250.0, cx=319.5, cy=239.5, omega=0.9)
    >>> camera.unproject(camera.project([1.0, 2.0, 2.0]).uv).xn.round(12)
    array([0.5, 1. ])
    """

    omega: float
    lens: ClassVar[Lens] = LENS

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.omega < np.pi:
            raise ValueError(f"omega={self.omega}: must be at least 0 and less than pi")
