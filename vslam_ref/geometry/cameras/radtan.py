"""Radial and tangential distortion: OpenCV's k1, k2, p1, p2, k3, and its rational form with k4, k5, k6.

With q = x^2 + y^2 of the normalised position xn, the radial factor G = N/M, where
N = 1 + k1 q + k2 q^2 + k3 q^3 and M = 1 + k4 q + k5 q^2 + k6 q^3, and the vector p = (p2, p1)::

    xd = G xn + q p + 2 (p . xn) xn

The polynomial is good as far as the calibration saw corners and then may turn back, so that two rays share
a pixel.  The *invertible field* is the disc r < R on which the Jacobian, a symmetric matrix, is positive
definite; :func:`field_radius` computes it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.geometry.cameras._batches import flatten, of
from vslam_ref.geometry.cameras._radtan_inverse import may_have_a_ray, newton, radial_start
from vslam_ref.geometry.cameras._radtan_terms import (
    coefficients,
    field_radius,
    plane_jacobian,
    radial,
    tangential,
)
from vslam_ref.geometry.cameras.camera import Camera
from vslam_ref.geometry.cameras.interface import (
    Distorted,
    DistortedJacobians,
    Lens,
    Rays,
    normalise,
    normalise_jacobian,
    rays_through,
)


def _enter(k: ArrayLike, xn: Array, front: BoolArray) -> tuple[Array, Array, BoolArray]:
    """Positions, zero where outside the field, their squared radius, and that flag."""
    radius = field_radius(k)
    q = (xn * xn).sum(-1)
    valid = front & (q < radius * radius)
    q = np.where(valid, q, 0.0)
    return np.where(valid[..., None], xn, 0.0), q, valid


def distort(k: ArrayLike, X_cam: ArrayLike) -> Distorted:
    """Distorted normalised position.

    Implements :eq:`eq-radtan`.

    Parameters
    ----------
    k : array_like, shape (..., 5) or (..., 8)
        k1, k2, p1, p2, k3[, k4, k5, k6] in OpenCV's order.
    X_cam : array_like, shape (..., 3)
        Points in the camera's frame.

    Returns
    -------
    Distorted
        Not valid behind the camera and outside the invertible field.

    Examples
    --------
    >>> distort([-0.3, 0, 0, 0, 0], [[0.5, 0.0, 1.0], [2.0, 0.0, 1.0]])
    Distorted(xd=array([[0.4625, 0.    ],
           [0.    , 0.    ]]), valid=array([ True, False]))
    """
    xn, q, valid = _enter(k, *normalise(X_cam))
    _, _, p = coefficients(k)
    return Distorted(xn * radial(k, q).G[..., None] + tangential(p, xn, q), valid)


def distort_with_jacobians(k: ArrayLike, X_cam: ArrayLike) -> DistortedJacobians:
    """:func:`distort` and its Jacobians in the point (..., 2, 3), per unit of X, and in ``k`` (..., 2, n).

    Implements :eq:`eq-radtan-jacobian`.
    dxd/dxn = G I + 2 G_q xn xn^T + 2 (p xn^T + xn p^T + (p . xn) I).
    """
    seen = normalise_jacobian(X_cam)
    xn, q, valid = _enter(k, seen.xd, seen.valid)
    terms = radial(k, q)
    _, denominator, p = coefficients(k)
    xd = xn * terms.G[..., None] + tangential(p, xn, q)
    J_k = np.zeros((*xd.shape, 5 + denominator.shape[-1]))
    over = xn[..., None] / terms.M[..., None, None]
    powers = np.stack([q, q * q, q**3], -1)
    J_k[..., [0, 1, 4]] = over * powers[..., None, :]
    J_k[..., 0, 2] = J_k[..., 1, 3] = 2 * xn[..., 0] * xn[..., 1]
    J_k[..., 1, 2] = q + 2 * xn[..., 1] ** 2
    J_k[..., 0, 3] = q + 2 * xn[..., 0] ** 2
    if denominator.shape[-1]:
        J_k[..., 5:] = -over * (terms.G[..., None] * powers)[..., None, :]
    inside = valid[..., None, None]
    J_X = plane_jacobian(terms, p, xn) @ seen.J_point
    return DistortedJacobians(xd, valid, np.where(inside, J_X, 0.0), np.where(inside, J_k, 0.0))


def undistort(k: ArrayLike, xd: ArrayLike) -> Rays:
    """Ray of a distorted position.

    Parameters
    ----------
    k : array_like, shape (..., 5) or (..., 8)
        Lens parameters.
    xd : array_like, shape (..., 2)
        Distorted normalised positions, in focal lengths (no unit).

    Returns
    -------
    Rays
        Valid where a position inside the field was found *and* distorts to ``xd`` to rounding.

    Notes
    -----
    The radius comes from a bracketed Newton iteration, which cannot fail (:func:`._roots.solve_increasing`).
    With tangential terms it starts a damped Newton iteration in the plane.  Inside the field xd is the
    gradient of a strictly convex potential, so at most one position answers, Newton's direction always
    lowers the residual, and steps are halved until they do and stay inside.

    Examples
    --------
    >>> undistort([-0.3, 0, 0, 0, 0], [[0.4625, 0.0], [0.9, 0.0]])
    Rays(bearing=array([[0.4472136 , 0.        , 0.89442719],
           [0.        , 0.        , 1.        ]]), valid=array([ True, False]))
    """
    radius = field_radius(k)
    batch = flatten(np.asarray(k, dtype=np.float64), as_array("xd", xd, 2))
    radius = np.broadcast_to(radius, batch.shape).ravel()
    at = np.flatnonzero(may_have_a_ray(batch.k, batch.xd, radius))
    k, target, radius = of(batch.k, at), batch.xd[at], radius[at]
    found, xn = np.zeros(len(batch.xd), dtype=np.bool_), np.zeros(batch.xd.shape)
    xn[at], found[at] = newton(k, target, radial_start(k, target, radius), radius)
    return rays_through(xn.reshape(*batch.shape, 2), found.reshape(batch.shape))


def max_angle(k: ArrayLike) -> float:
    """Half of the invertible field of parameters (n,), a number in radians."""
    return float(np.arctan(field_radius(k)))


LENS = Lens(("k1", "k2", "p1", "p2", "k3"), distort, distort_with_jacobians, undistort, max_angle)
RATIONAL_LENS = LENS._replace(names=(*LENS.names, "k4", "k5", "k6"))


@dataclass(frozen=True)
class Radtan(Camera):
    """Radial-tangential camera: OpenCV's model with 4 or 5 coefficients, Kalibr's and EuRoC's ``radtan``.

    Parameters
    ----------
    fx, fy, cx, cy : float
        Focal lengths and principal point, pixels.
    k1, k2, p1, p2, k3 : float
        Distortion, of normalised positions.

    Examples
    --------
    >>> camera = Radtan(fx=500, fy=500, cx=320, cy=240, k1=-0.3, k2=0.1, p1=1e-3, p2=-2e-3)
    >>> camera.unproject(camera.project([0.4, 0.2, 1.0]).uv).xn.round(12)
    array([0.4, 0.2])
    """

    k1: float
    k2: float
    p1: float
    p2: float
    k3: float = 0.0
    lens: ClassVar[Lens] = LENS


@dataclass(frozen=True)
class Rational(Radtan):
    """OpenCV's rational model: :class:`Radtan` with the denominator 1 + k4 q + k5 q^2 + k6 q^3."""

    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    lens: ClassVar[Lens] = RATIONAL_LENS
