"""Moments of the reduced filter's start and control, in complex closed form.

The lifted form has its own moments (``moments``), derived another way; the two share no code.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.filters.vehicle import Increment

Complex = NDArray[np.complex128]


def start_moments(mean: Array, cov: Array, kind: str) -> tuple[Array, Array]:
    """Mean and covariance of (x, y, sin, cos) of a Gaussian start pose.

    Implements :eq:`eq-b5` (B5) and its covariance.  ``first_order``: by the Jacobian.  ``gaussian``: with v
    the heading's variance and k the covariance of position and heading, E[h] = e^{i theta - v/2},
    cov(position, h) = i k E[h], E[h h] = e^{2i theta - 2v}.

    Parameters
    ----------
    mean : ndarray, shape (B, 3)
        Start pose (x, y, theta), world frame, metres and radians.
    cov : ndarray, shape (B, 3, 3)
        Its covariance.
    kind : {"first_order", "gaussian"}

    Returns
    -------
    mean : ndarray, shape (B, 4)
    cov : ndarray, shape (B, 4, 4)
    """
    x, y, theta = mean.T
    s, c = np.sin(theta), np.cos(theta)
    if kind == "first_order":
        J = np.zeros((len(mean), 4, 3))
        J[:, 0, 0] = J[:, 1, 1] = 1.0
        J[:, 2, 2], J[:, 3, 2] = c, -s
        return np.stack([x, y, s, c], -1), J @ cov @ J.swapaxes(1, 2)
    v = cov[:, 2, 2]
    shrink = np.exp(-v / 2)
    P = np.zeros((len(mean), 4, 4))
    P[:, :2, :2] = cov[:, :2, :2]
    P[:, :2, 2] = P[:, 2, :2] = cov[:, :2, 2] * (shrink * c)[:, None]
    P[:, :2, 3] = P[:, 3, :2] = -cov[:, :2, 2] * (shrink * s)[:, None]
    # var sin, var cos and cov from E[hh] and |h| = 1; -expm1 keeps the digits of a small variance
    even, odd = -np.expm1(-v) / 2, shrink**2 * np.expm1(-v) / 2
    P[:, 2, 2] = even * (1.0 + shrink**2 * np.cos(2 * theta))
    P[:, 3, 3] = even * (1.0 - shrink**2 * np.cos(2 * theta))
    P[:, 2, 3] = P[:, 3, 2] = odd * np.sin(2 * theta)
    return np.stack([x, y, shrink * s, shrink * c], -1), P


def control_first_order(increment: Increment) -> tuple[Array, Array]:
    """Moments of (ds, Re m, Im m, Re t, Im t), m = exp(-i dalpha) and t = ds m, to first order.

    Implements :eq:`eq-noise-first-order`: dm = -i m dalpha and dt = m dds - i t dalpha.

    Parameters
    ----------
    increment : Increment
        ds (m) and dalpha (rad) of B runs, and their covariance.

    Returns
    -------
    mean : ndarray, shape (B, 5)
    cov : ndarray, shape (B, 5, 5)
    """
    m = np.exp(-1j * increment.dalpha)
    t = increment.ds * m
    mean, J = np.empty((len(m), 5)), np.zeros((len(m), 5, 2))
    mean[:, 0], mean[:, 1], mean[:, 2], mean[:, 3], mean[:, 4] = increment.ds, m.real, m.imag, t.real, t.imag
    J[:, 0, 0], J[:, 3:, 0] = 1.0, mean[:, 1:3]
    J[:, 1::2, 1], J[:, 2::2, 1] = mean[:, 2::2], -mean[:, 1::2]
    return mean, J @ increment.cov @ J.swapaxes(1, 2)  # eq-noise-first-order


def control_gaussian(increment: Increment) -> tuple[Array, Array]:
    """As :func:`control_first_order`, exact for Gaussian (ds, dalpha).

    With d, a the means, s2 the variance of ds, v that of dalpha and k their covariance,
    E[ds^p e^{-ija}] is e^{-ija - j^2 v/2} times the p-th moment of N(d - ijk, s2).  Below, E[m] and the
    like are divided out, so that no difference of nearly equal numbers is left.
    """
    d, s2, k, v = increment.ds, increment.cov[:, 0, 0], increment.cov[:, 0, 1], increment.cov[:, 1, 1]
    m = np.exp(-1j * increment.dalpha - v / 2)  # eq-gaussian-moments
    t = (d - 1j * k) * m
    less, keep = np.expm1(-v), np.exp(-v)
    plain_mm, conj_mm = less, -less
    plain_tm, conj_tm = (d - 2j * k) * less - 1j * k, 1j * k * keep - d * less
    plain_tt = ((d - 2j * k) ** 2 + s2) * less + s2 - 2j * d * k - 3 * k**2
    conj_tt = s2 - d**2 * less - k**2 * keep
    C = np.zeros((len(d), 5, 5))
    C[:, 0, 0] = s2
    for at, cross in ((1, -1j * k * m), (3, (s2 - 1j * k * (d - 1j * k)) * m)):
        C[:, 0, at] = C[:, at, 0] = cross.real
        C[:, 0, at + 1] = C[:, at + 1, 0] = cross.imag
    blocks = ((1, 1, plain_mm, conj_mm), (3, 1, plain_tm, conj_tm), (3, 3, plain_tt, conj_tt))
    for i, j, plain, conj in blocks:
        C[:, i : i + 2, j : j + 2] = _real_covariance((plain * m * m).astype(complex), conj.astype(complex))
        C[:, j : j + 2, i : i + 2] = C[:, i : i + 2, j : j + 2].swapaxes(1, 2)
    return np.stack([d, m.real, m.imag, t.real, t.imag], -1), C


def _real_covariance(plain: Complex, conj: Complex) -> Array:
    """Covariance (B, 2, 2) of (Re f, Im f) with (Re g, Im g), from cov(f, g) and cov(f, conj g)."""
    rows = [
        [plain.real + conj.real, plain.imag - conj.imag],
        [plain.imag + conj.imag, conj.real - plain.real],
    ]
    return np.array(rows).transpose(2, 0, 1) / 2
