"""Where a radial function stops growing, and its inverse up to there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray

EPS = float(np.finfo(np.float64).eps)


def first_positive_root(coefficients: ArrayLike) -> float:
    """Smallest positive real root of c0 + c1 x + c2 x^2 + ..., or infinity.

    A pair of roots within 1e-6 of the real axis counts as a double root: there the polynomial touches
    zero to the rounding of its coefficients.

    Examples
    --------
    >>> round(first_positive_root([2.0, -3.0, 1.0]), 12), first_positive_root([1.0, 0.0, 1.0])
    (1.0, inf)
    """
    c = np.trim_zeros(np.asarray(coefficients, dtype=np.float64), "b")
    if len(c) < 2:
        return np.inf
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        monic = c / c[-1]
    while not np.isfinite(monic).all():  # a last coefficient that tiny moves no root below 1e6
        c = c[:-1]
        if len(c) < 2:
            return np.inf
        monic = c / c[-1]
    roots = np.roots(c[::-1])
    real = roots.real[(np.abs(roots.imag) <= 1e-6 * np.abs(roots)) & (roots.real > 0)]
    return _polished(c, float(real.min())) if len(real) else np.inf


def _polished(c: Array, root: float) -> float:
    """Two steps of Newton's method, kept only when they are as small as a correction must be."""
    slope = c[1:] * np.arange(1, len(c))
    for _ in range(2):
        derivative = float(np.polyval(slope[::-1], root))
        step = float(np.polyval(c[::-1], root)) / derivative if derivative else 0.0
        if not abs(step) < 1e-6 * root:
            break
        root -= step
    return root


def for_each_lens(ends: Callable[[tuple[float, ...]], float], k: Array) -> Array:
    """``ends(k)`` of lens parameters (..., n), shape (...); each different lens once."""
    if k.ndim == 1:
        return np.asarray(ends(tuple(k.tolist())))
    rows, which = np.unique(k.reshape(-1, k.shape[-1]), axis=0, return_inverse=True)
    found = np.array([ends(tuple(row)) for row in rows.tolist()])
    return np.asarray(found[which].reshape(k.shape[:-1]))


Increasing = Callable[[Array, IntArray], tuple[Array, Array]]
"""``(x, at) -> (f, df/dx)`` for the equations number ``at``."""


def solve_increasing(function: Increasing, target: Array, upper: Array) -> Array:
    """Solve f(x) = target on [0, upper] for an increasing f with f(0) = 0 <= target <= f(upper).

    Newton's method inside a bracket: a step that would leave the bracket, or that follows one which did
    not halve the residual, is replaced by the bracket's middle.  The bracket always holds the root and is
    halved at least every other step, so the method cannot fail; near the root Newton's steps pass.
    Equations that are solved are dropped, so a few slow ones do not cost the others' time.

    Parameters
    ----------
    function : callable
        ``(x, at) -> (f, df/dx)`` on arrays; ``at`` (M,) are the numbers of the equations that are asked.
    target, upper : ndarray, shape (N,)
    """
    solution, at = np.minimum(target, upper), np.arange(len(target))
    x, low = solution.copy(), np.zeros_like(target)
    high, last = _bracket(function, target, x, upper), np.full_like(target, np.inf)
    for _ in range(200):
        value, slope = function(x, at)
        residual = value - target
        low, high = np.where(residual <= 0, x, low), np.where(residual >= 0, x, high)
        step = residual / np.where(slope > 0, slope, 1.0)
        ahead = x - step
        inside = (slope > 0) & (ahead >= low) & (ahead <= high) & (np.abs(residual) <= 0.5 * last)
        ahead = np.where(inside, ahead, 0.5 * (low + high))
        done = (np.abs(ahead - x) <= 2 * EPS * x) | (np.abs(residual) <= EPS * target)
        solution[at] = np.where(done, x, ahead)
        left = ~done
        if not left.any():
            break
        at, target, x, low, high = at[left], target[left], ahead[left], low[left], high[left]
        last = np.abs(residual)[left]
    return solution


def _bracket(function: Increasing, target: Array, start: Array, upper: Array) -> Array:
    """Double ``start`` until f is beyond the target, but not beyond ``upper``, which may be very far."""
    high, at = start.copy(), np.arange(len(target))
    for _ in range(2000):
        at = at[(function(high[at], at)[0] < target[at]) & (high[at] < upper[at])]
        if len(at) == 0:
            break
        high[at] = np.minimum(2 * high[at], upper[at])
    return high
