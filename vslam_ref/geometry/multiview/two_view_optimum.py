r"""The global optimum for two views: the nearest pair of pixels that fits the epipolar geometry.

Wanted are :math:`\hat u_a, \hat u_b` with :math:`\hat x_b^T F \hat x_a = 0` and the smallest
:math:`\lVert \hat u_a - u_a \rVert^2 + \lVert \hat u_b - u_b \rVert^2`.

Planes through the baseline cut both images in a pair of lines, one through each epipole.  Each pair that fits
lies on one such pair of lines, and on given lines the nearest points are the feet of the perpendiculars.
So one number is sought: the angle theta of the line in image a.

Turn both images about the measured points, so that these become the origins and the epipoles lie at
(1, 0, f) and (1, 0, g).  Then F has four numbers left,

.. math:: F = \begin{bmatrix} fgd & -gc & -gd \\ -fb & a & b \\ -fd & c & d \end{bmatrix},

the line in a passes (0, t, 1) with t = p/q, p = sin theta, q = cos theta, and its partner is the line
:math:`(-g(cp + dq),\; ap + bq,\; cp + dq)`.  The squared distances of the origins from both lines,

.. math:: s(\theta) = \frac{p^2}{q^2 + f^2 p^2} + \frac{(cp + dq)^2}{(ap + bq)^2 + g^2 (cp + dq)^2} ,

have the derivative zero where

.. math:: G = p q\,\bigl((ap + bq)^2 + g^2 (cp + dq)^2\bigr)^2
              - (ad - bc)\,(q^2 + f^2 p^2)^2\,(ap + bq)(cp + dq) = 0 .

In practice t is measured in units of a length lambda between 0 and both 1/f and the angle at which the
partner line meets its point: a, c and f are multiplied by it, and the first terms of s and G by its square.

G is of degree six in (p, q), so it is a trigonometric polynomial: seven samples give its coefficients in
:math:`z = e^{2 i \theta}`, and a polynomial's roots the angles.  All six are polished and tried; the best is
the answer, and no other angle can be better.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, transpose


class CorrectedPair(NamedTuple):
    """A pair of pixels that fits F, and how far it was moved.

    Attributes
    ----------
    uv_a, uv_b : ndarray, shape (N, 2)
        Pixels.
    cost : ndarray, shape (N,)
        Sum of both squared distances from what was measured, px^2.
    """

    uv_a: Array
    uv_b: Array
    cost: Array


class _Form(NamedTuple):
    """The six numbers of the turned images, in units of the length ``unit``, each (N, 1)."""

    a: Array
    b: Array
    c: Array
    d: Array
    f: Array
    g: Array
    unit: Array


def correct_pair(F: ArrayLike, uv_a: ArrayLike, uv_b: ArrayLike) -> CorrectedPair:
    """Move two pixels the least so that they fit the fundamental matrix.

    Implements :eq:`eq-two-view-optimum`.

    Parameters
    ----------
    F : array_like, shape (3, 3)
        Of rank two, x_b^T F x_a = 0.
    uv_a, uv_b : array_like, shape (N, 2)
        Measured pixels with equal, round noise.

    Returns
    -------
    CorrectedPair
        Triangulate it with any method: the rays now meet.

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite, or F is zero.

    Notes
    -----
    The minimum is global, also where the cost has two or three valleys.

    Examples
    --------
    >>> rows = [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]  # epipolar lines are rows
    >>> pair = correct_pair(rows, [[10.0, 20.0]], [[4.0, 21.0]])
    >>> pair.uv_a.round(9).tolist(), pair.uv_b.round(9).tolist(), pair.cost.round(9).tolist()
    ([[10.0, 20.5]], [[4.0, 20.5]], [0.5])
    """
    F = as_array("F", F, 3, 3)
    a, b = as_array("uv_a", uv_a, 2), as_array("uv_b", uv_b, 2)
    if F.shape != (3, 3) or a.ndim != 2 or a.shape != b.shape:
        raise ValueError(f"F {F.shape}, uv_a {a.shape}, uv_b {b.shape}: need (3, 3) and twice (N, 2)")
    if not (np.isfinite(F).all() and np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError("F and pixels must be finite")
    U, s, Vt = np.linalg.svd(F)
    if s[0] == 0.0:
        raise ValueError("F is zero")
    T_a, f = _turn(a, Vt[2])
    T_b, g = _turn(b, U[:, 2])
    form = _form(transpose(T_b) @ (F / s[0]) @ T_a, f[:, None], g[:, None])
    theta = _polished(form, _angles(form))
    best = np.argmin(_cost(form, theta), axis=1)[:, None]
    theta = np.take_along_axis(theta, best, 1)
    p, q = np.sin(theta), np.cos(theta)
    line_a = np.concatenate([form.f * p, q, -form.unit * p], 1)  # through (1, 0, f) and (0, t, 1)
    u, w = form.a * p + form.b * q, form.c * p + form.d * q
    line_b = np.concatenate([-form.g * w, u, w], 1)
    cost = _cost(form, theta)[:, 0]
    return CorrectedPair(_foot(T_a, line_a), _foot(T_b, line_b), cost)


def _turn(uv: Array, epipole: Array) -> tuple[Array, Array]:
    """Motions (N, 3, 3) from turned to original images, and the third coordinate (N,) of the epipole."""
    shifted = epipole[:2] - epipole[2] * uv
    # a point within 1e-8 of the epipole has no direction to it: any will do, at that distance
    least = 1e-8 * np.abs(epipole[2]) * np.maximum(1.0, np.abs(uv).max(axis=1, initial=0.0))
    length = np.linalg.norm(shifted, axis=1)
    at = length <= least
    along = np.where(at[:, None], np.array([1.0, 0.0]), shifted / np.where(at, 1.0, length)[:, None])
    T = np.zeros((len(uv), 3, 3))
    T[:, :2, 0], T[:, 0, 1], T[:, 1, 1] = along, -along[:, 1], along[:, 0]
    T[:, :2, 2], T[:, 2, 2] = uv, 1.0
    return T, epipole[2] / np.where(at, least, length)


def _form(turned: Array, f: Array, g: Array) -> _Form:
    """The numbers, with t measured in units of 1 / (f + |c/d|): the answer lies at a moderate angle."""
    a, b, c, d = (turned[:, i, j, None] for i, j in ((1, 1), (1, 2), (2, 1), (2, 2)))
    ratio = np.abs(c) / np.maximum(np.abs(d), 1e-300)
    unit = 1.0 / np.clip(np.abs(f) + ratio, 1e-8, 1e8)
    return _Form(a * unit, b, c * unit, d, f * unit, g, unit)


def _foot(T: Array, line: Array) -> Array:
    """Point of a line nearest to the origin of the turned image, in the original image."""
    foot = -line[:, 2:] * line[:, :2] / np.sum(line[:, :2] ** 2, axis=1, keepdims=True)
    moved: Array = np.einsum("nij,nj->ni", T[:, :2, :2], foot) + T[:, :2, 2]
    return moved


def _cost(k: _Form, theta: Array) -> Array:
    """s(theta); infinity where a line is not defined."""
    p, q = np.sin(theta), np.cos(theta)
    u, w = k.a * p + k.b * q, k.c * p + k.d * q
    with np.errstate(divide="ignore", invalid="ignore"):
        total = (k.unit * p) ** 2 / (q**2 + (k.f * p) ** 2) + w**2 / (u**2 + (k.g * w) ** 2)
    return np.where(np.isfinite(total), total, np.inf)


def _slope(k: _Form, theta: Array) -> Array:
    """G(theta)."""
    p, q = np.sin(theta), np.cos(theta)
    u, w = k.a * p + k.b * q, k.c * p + k.d * q
    D_a, D_b = q**2 + (k.f * p) ** 2, u**2 + (k.g * w) ** 2
    return np.asarray(k.unit**2 * p * q * D_b**2 - (k.a * k.d - k.b * k.c) * D_a**2 * u * w)


def _angles(k: _Form) -> Array:
    """Six angles (N, 6), the zeros of G among them."""
    samples = _slope(k, np.pi / 7 * np.arange(7.0)[None])
    g = np.fft.fft(samples, axis=1) / 7  # of z^0, z^1, z^2, z^3, z^-3, z^-2, z^-1
    g = g[:, [4, 5, 6, 0, 1, 2, 3]]  # rising powers of z, times z^3
    size = np.abs(g).max(axis=1, keepdims=True)
    g = g / np.where(size > 0, size, 1.0)
    lead = g[:, 6:]
    lead = np.where(np.abs(lead) > 1e-14, lead, 1e-14)  # moves roots near 0 and infinity, not on the circle
    companion = np.zeros((len(g), 6, 6), dtype=np.complex128)
    companion[:, np.arange(1, 6), np.arange(5)] = 1.0
    companion[:, :, 5] = -g[:, :6] / lead
    roots = np.linalg.eigvals(companion)
    return np.asarray(0.5 * np.angle(roots))


def _polished(k: _Form, theta: Array) -> Array:
    """Some steps of a secant method on G, each kept where it makes s smaller."""
    h = 1e-6
    for _ in range(4):
        value, ahead, back = _slope(k, theta), _slope(k, theta + h), _slope(k, theta - h)
        slope = (ahead - back) / (2 * h)
        step = np.where(np.abs(slope) > 0, value / np.where(slope != 0, slope, 1.0), 0.0)
        new = theta - np.clip(step, -0.1, 0.1)
        theta = np.where(_cost(k, new) <= _cost(k, theta), new, theta)
    return theta
