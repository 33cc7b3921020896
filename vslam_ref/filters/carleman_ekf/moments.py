"""Moments of lifted quantities: how P0 and the control noise enter the lifted filter.

Two ways, for both:

* ``first_order``: the lift at the mean, and its Jacobian on the covariance;
* ``gaussian``: exact mean and covariance of the lifted quantity when the unlifted one is Gaussian.

Every lifted quantity is a sum of terms a x^p y^q e^{ik theta}.  For a Gaussian with mean mu and
covariance Sigma, completing the square gives

    E[x^p y^q e^{ik theta}] = e^{ik mu_theta - k^2 Sigma_tt / 2}  E'[x^p y^q],

where E' is over the same Gaussian with the *complex* mean mu + ik Sigma_{., theta}.  The lifted
quantities have p + q <= 1, so that last factor is 1 or one coordinate of the complex mean.

The control's Gaussian is that of (ds, dalpha) with the first-order covariance of the drive: an
assumption (tan(phi) of a Gaussian phi has no moments at all).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.filters.carleman_ekf import lift
from vslam_ref.filters.estimates import checked_moments
from vslam_ref.filters.vehicle import Increment

Term = tuple[complex, int, int, int]
"""Coefficient and the exponents p, q, k of x^p y^q e^{ik theta}."""

_ONE: tuple[Term, ...] = ((1, 0, 0, 0),)
_SIN: tuple[Term, ...] = ((-0.5j, 0, 0, 1), (0.5j, 0, 0, -1))
_COS: tuple[Term, ...] = ((0.5, 0, 0, 1), (0.5, 0, 0, -1))
_X: tuple[Term, ...] = ((1, 1, 0, 0),)
_Y: tuple[Term, ...] = ((1, 0, 1, 0),)


def _times(a: tuple[Term, ...], b: tuple[Term, ...]) -> tuple[Term, ...]:
    """Product of two sums of terms, equal exponents collected."""
    total: dict[tuple[int, int, int], complex] = {}
    for ca, *ea in a:
        for cb, *eb in b:
            key = (ea[0] + eb[0], ea[1] + eb[1], ea[2] + eb[2])
            total[key] = total.get(key, 0) + ca * cb
    return tuple((c, *e) for e, c in total.items() if c != 0)


_LIFTED_VEHICLE = (
    *(_X, _Y, _SIN, _COS, _times(_SIN, _SIN), _times(_COS, _COS)),
    *(_times(_X, _SIN), _times(_X, _COS), _times(_Y, _SIN), _times(_Y, _COS), _times(_SIN, _COS)),
)
_CONTROL_MONOMIALS = (
    *(_ONE, _X, _SIN, _COS, _times(_SIN, _SIN), _times(_SIN, _COS), _times(_COS, _COS)),
    *(_times(_X, _SIN), _times(_X, _COS)),
)


def _mean_of(terms: tuple[Term, ...], mean: Array, cov: Array) -> Array:
    """E of a sum of terms of degree p + q <= 1 under N(mean (B, 3), cov (B, 3, 3)), shape (B,)."""
    total = np.zeros(len(mean), dtype=np.complex128)
    for coefficient, p, q, k in terms:
        wave = np.exp(1j * k * mean[:, 2] - k * k * cov[:, 2, 2] / 2)  # eq-gaussian-moments
        total += coefficient * wave * _shifted(p, q, k, mean, cov)
    return total.real


def _shifted(p: int, q: int, k: int, mean: Array, cov: Array) -> NDArray[np.complex128]:
    """x^p y^q, p + q <= 1, at the complex mean mu + ik Sigma_{., theta}: (B,)."""
    if p + q == 0:
        return np.ones(len(mean), dtype=np.complex128)
    at = 0 if p else 1
    return mean[:, at] + 1j * k * cov[:, at, 2]


def _covariance_of(f: tuple[Term, ...], g: tuple[Term, ...], mean: Array, cov: Array) -> Array:
    """cov(f, g) without cancellation, shape (B,).

    For terms with exponents k1, k2 and v = Sigma_tt, E[fg] - E[f] E[g] has the common wave
    e^{i(k1 + k2) mu - (k1^2 + k2^2) v/2}, times e^{-k1 k2 v} M12 - M1 M2, where M1, M2 and M12 are the
    polynomial factors.  That is expm1(-k1 k2 v) M12 + (M12 - M1 M2), and M12 = (M1 + d1)(M2 + d2) + s,
    with d the further shift of a mean by the other's k, and s = Sigma between the two coordinates.
    """
    v = cov[:, 2, 2]
    total = np.zeros(len(mean), dtype=np.complex128)
    for c1, p1, q1, k1 in f:
        for c2, p2, q2, k2 in g:
            M1, M2 = _shifted(p1, q1, k1, mean, cov), _shifted(p2, q2, k2, mean, cov)
            d1 = 1j * k2 * cov[:, 0 if p1 else 1, 2] * (p1 + q1)
            d2 = 1j * k1 * cov[:, 0 if p2 else 1, 2] * (p2 + q2)
            s = cov[:, 0 if p1 else 1, 0 if p2 else 1] * ((p1 + q1) * (p2 + q2))
            more = M1 * d2 + d1 * M2 + d1 * d2 + s
            wave = np.exp(1j * (k1 + k2) * mean[:, 2] - (k1 * k1 + k2 * k2) * v / 2)
            total += c1 * c2 * wave * (np.expm1(-k1 * k2 * v) * (M1 * M2 + more) + more)
    return total.real


def _gaussian_moments(
    functions: tuple[tuple[Term, ...], ...], mean: Array, cov: Array
) -> tuple[Array, Array]:
    """Exact mean (B, f) and covariance (B, f, f) of f functions of a Gaussian (x, y, theta)."""
    first = np.stack([_mean_of(f, mean, cov) for f in functions], -1)
    second = np.empty((len(mean), len(functions), len(functions)))
    for i, f in enumerate(functions):
        for j in range(i + 1):
            second[:, i, j] = second[:, j, i] = _covariance_of(f, functions[j], mean, cov)
    return first, second


def lifted_start(mean: Array, cov: Array, kind: str) -> tuple[Array, Array]:
    """Mean and covariance of the lifted start pose.

    Parameters
    ----------
    mean : ndarray, shape (B, 3)
        Start pose (x, y, theta), world frame, metres and radians.
    cov : ndarray, shape (B, 3, 3)
        Its covariance.
    kind : {"first_order", "gaussian"}

    Returns
    -------
    mean : ndarray, shape (B, 11)
    cov : ndarray, shape (B, 11, 11)
    """
    if checked_moments("start", kind) == "gaussian":
        return _gaussian_moments(_LIFTED_VEHICLE, mean, cov)
    J = lift.lift_vehicle_jacobian(mean)
    return lift.lift_vehicle(mean), J @ cov @ J.swapaxes(1, 2)


class ControlMoments(NamedTuple):
    """Mean (B, 9) of the monomials w and a factor (B, 8, r) of the covariance of w without its constant."""

    mean: Array
    factor: Array


def control_monomials(U: Array) -> Array:
    """Monomials of a control.

    Parameters
    ----------
    U : ndarray, shape (..., 3)
        u1 = ds (m), u2 = sin(dalpha), u3 = cos(dalpha).

    Returns
    -------
    ndarray, shape (..., 9)
        In the order of :data:`.lift.MONOMIALS`.
    """
    u1, u2, u3 = U[..., 0], U[..., 1], U[..., 2]
    return np.stack([np.ones_like(u1), u1, u2, u3, u2 * u2, u2 * u3, u3 * u3, u1 * u2, u1 * u3], -1)


def control_moments(increment: Increment, kind: str, product_of_means: bool = False) -> ControlMoments:
    """Moments of the control monomials of a noisy increment.

    Implements :eq:`eq-b6` (B6) and the covariance Q_U that B10 and B17 leave open.

    Parameters
    ----------
    increment : Increment
        (ds, dalpha) and their covariance, batch B.
    kind : {"first_order", "gaussian"}
    product_of_means : bool
        With ``gaussian`` only: put products of E[u] into the quadratic monomials.  Wrong: the mean of
        (sin, cos) is shorter than 1, and its square loses z5 + z6 step by step.
    """
    if checked_moments("control", kind) == "first_order":
        return _first_order(increment)
    mean = np.stack([increment.ds, np.zeros_like(increment.ds), increment.dalpha], -1)
    cov = np.zeros((len(mean), 3, 3))
    cov[:, 0::2, 0::2] = increment.cov
    w, C = _gaussian_moments(_CONTROL_MONOMIALS, mean, cov)
    if product_of_means:
        w = control_monomials(w[:, 1:4])
    values, vectors = np.linalg.eigh(C[:, 1:, 1:])
    return ControlMoments(w, vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :])


def _first_order(increment: Increment) -> ControlMoments:
    """Lift at the mean; factor = (dw/dU) (dU/d(ds, dalpha)) chol(cov), rank 2."""
    ds, (s, c) = increment.ds, (np.sin(increment.dalpha), np.cos(increment.dalpha))
    zero, one = np.zeros_like(ds), np.ones_like(ds)
    along = np.stack([one, zero, zero, zero, zero, zero, s, c], -1)
    turn = np.stack([zero, c, -s, 2 * s * c, c * c - s * s, -2 * s * c, ds * c, -ds * s], -1)
    factor = np.stack([along, turn], -1) @ _factor_2x2(increment.cov)  # eq-noise-first-order
    return ControlMoments(control_monomials(np.stack([ds, s, c], -1)), factor)


def _factor_2x2(C: Array) -> Array:
    """Lower factor L with L L^T = C for positive semi-definite C (B, 2, 2); zero pivots allowed."""
    L = np.zeros_like(C)
    L[:, 0, 0] = np.sqrt(C[:, 0, 0])
    L[:, 1, 0] = np.where(L[:, 0, 0] > 0, C[:, 1, 0] / np.where(L[:, 0, 0] > 0, L[:, 0, 0], 1.0), 0.0)
    L[:, 1, 1] = np.sqrt(np.maximum(C[:, 1, 1] - L[:, 1, 0] ** 2, 0.0))
    return L
