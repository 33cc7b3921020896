"""Quotients that are 0/0 at zero, with their derivatives, exact to rounding on both sides of a threshold."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry.coefficients import rotation_coefficients

ARCTAN_SERIES = 0.1
"""Below this q the series of :func:`arctan_ratio` is used.

Its N-th term is below q^N: with 17 terms the rest is under 1e-17 at 0.1.  Above, the closed derivative
subtracts two numbers near 1 and divides by 2 q: it loses a factor of at most 1 / (2 q) / (1/3) = 15.
"""


def arctan_ratio(q: Array) -> tuple[Array, Array]:
    """S(q) = arctan(t)/t with t = sqrt(q), and dS/dq = (1/(1 + q) - S) / (2 q); S(0) = 1, S'(0) = -1/3."""
    small = q < ARCTAN_SERIES
    p = np.where(small, 1.0, q)
    t = np.sqrt(p)
    closed = np.arctan(t) / t
    slope = (1.0 / (1.0 + p) - closed) / (2.0 * p)
    x = np.where(small, q, 0.0)
    series, series_slope = np.zeros_like(x), np.zeros_like(x)
    for n in range(17, -1, -1):  # Horner's rule for the series and its derivative together
        series_slope = series_slope * x + series
        series = series * x + (-1.0) ** n / (2 * n + 1)
    return np.where(small, series, closed), np.where(small, series_slope, slope)


def tan_ratio(w: Array) -> Array:
    """A(w) = tan(w/2) / (w/2), A(0) = 1; no digit is lost before w/2 underflows."""
    small = np.abs(w) < 1e-8  # the next term, w^2/12, is below 1e-17
    half = np.where(small, 1.0, w / 2)
    ratio: Array = np.where(small, 1.0, np.tan(half) / half)
    return ratio


def tan_ratio_slope(w: Array) -> Array:
    """dA/dw = (w - sin w) / (w cos(w/2))^2: w/6 at zero."""
    return np.asarray(w * rotation_coefficients(w * w)[3] / np.cos(w / 2) ** 2)
