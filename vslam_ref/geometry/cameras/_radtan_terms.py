"""Pieces of the radial-tangential lens: its terms, its Jacobian in the plane, and the end of its field."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry.cameras._roots import first_positive_root, for_each_lens
from vslam_ref.geometry.cameras.interface import MAX_TAN


class Radial(NamedTuple):
    """Denominator M, factor G = N/M, and dG/dq."""

    M: Array
    G: Array
    slope: Array


def coefficients(k: ArrayLike) -> tuple[Array, Array, Array]:
    """Of N (..., 3), of M (..., 0 or 3), and p = (p2, p1)."""
    k = np.asarray(k, dtype=np.float64)
    if k.ndim == 0 or k.shape[-1] not in (5, 8):
        raise ValueError(f"k has shape {k.shape}; need (..., 5): k1 k2 p1 p2 k3, or (..., 8) with k4 k5 k6")
    return k[..., [0, 1, 4]], k[..., 5:], k[..., [3, 2]]


def radial(k: ArrayLike, q: Array) -> Radial:
    """Everything radial at the squared radius q."""
    numerator, denominator, _ = coefficients(k)
    N, dN = _cubic(numerator, q)
    if denominator.shape[-1] == 0:
        return Radial(np.ones_like(N), N, dN)
    M, dM = _cubic(denominator, q)
    M = np.where(M == 0.0, 1.0, M)  # only outside the field
    return Radial(M, N / M, (dN - N / M * dM) / M)


def _cubic(c: Array, q: Array) -> tuple[Array, Array]:
    """1 + c1 q + c2 q^2 + c3 q^3 and its derivative, by Horner's rule."""
    c1, c2, c3 = c[..., 0], c[..., 1], c[..., 2]
    return 1.0 + q * (c1 + q * (c2 + q * c3)), c1 + q * (2 * c2 + q * (3 * c3))


def tangential(p: Array, xn: Array, q: Array) -> Array:
    """The shift q p + 2 (p . xn) xn."""
    moved: Array = q[..., None] * p + 2 * (p * xn).sum(-1, keepdims=True) * xn
    return moved


def plane_jacobian(radial: Radial, p: Array, xn: Array) -> Array:
    """dxd/dxn, symmetric, shape (..., 2, 2): xd is the gradient of a potential."""
    x, y = xn[..., 0], xn[..., 1]
    px, py = p[..., 0], p[..., 1]
    isotropic = radial.G + 2 * (px * x + py * y)
    J = np.empty((*x.shape, 2, 2))
    J[..., 0, 0] = isotropic + 2 * radial.slope * x * x + 4 * px * x
    J[..., 1, 1] = isotropic + 2 * radial.slope * y * y + 4 * py * y
    J[..., 0, 1] = J[..., 1, 0] = 2 * radial.slope * x * y + 2 * (px * y + py * x)
    return J


@lru_cache(maxsize=4096)
def _radius_of(k: tuple[float, ...]) -> float:
    if not np.isfinite(k).all():
        return 0.0
    numerator, denominator, p = coefficients(k)
    r, q = Polynomial([0.0, 1.0]), Polynomial([0.0, 0.0, 1.0])
    N, M = Polynomial([1.0, *numerator])(q), Polynomial([1.0, *denominator])(q)
    bend = 6 * np.hypot(*p) * r
    slope = (r * N).deriv() * M - r * N * M.deriv()  # (r N/M)' M^2
    ends = (M, slope - bend * M * M, N - bend * M)
    return min(MAX_TAN, *(first_positive_root(end.coef) for end in ends))


def field_radius(k: ArrayLike) -> Array:
    """Radius R of the invertible field in the plane z = 1; at most ``MAX_TAN``.

    With D(r) = r G(r^2) and s = hypot(p1, p2), R is the first zero of D'(r) - 6 s r, D(r)/r - 6 s r or M.
    The two differences bound the eigenvalues of the Jacobian from below.  Without tangential terms R is the
    radius at which D stops growing; with them it is sharp where D' is the smaller, as in barrel distortion.

    Parameters
    ----------
    k : array_like, shape (..., 5) or (..., 8)
        Lens parameters.

    Returns
    -------
    ndarray, shape (...)

    Examples
    --------
    >>> float(field_radius([-0.3, 0.0, 0.0, 0.0, 0.0]))  # 1 - 0.9 r^2 = 0
    1.0540925533894...
    """
    k = np.asarray(k, dtype=np.float64)
    coefficients(k)
    return for_each_lens(_radius_of, k)
