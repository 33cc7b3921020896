"""Quantiles in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
from mpmath import mpf
from scipy.stats import chi2


def quantile(dof: int, probability: Any) -> Any:
    """Quantile of chi-squared: Newton's iteration on the incomplete gamma function, 50 digits."""
    p, half = mpf(probability), mpf(dof) / 2
    x = mpf(float(chi2.ppf(float(p), dof)))
    for _ in range(6):
        density = mpmath.exp((half - 1) * mpmath.log(x / 2) - x / 2 - mpmath.loggamma(half)) / 2
        x -= (mpmath.gammainc(half, 0, x / 2, regularized=True) - p) / density
    assert abs(mpmath.gammainc(half, 0, x / 2, regularized=True) - p) < mpf(10) ** -35
    return x


def normal_quantile(probability: Any) -> Any:
    """Quantile of the standard normal distribution."""
    return mpmath.sqrt(2) * mpmath.erfinv(2 * mpf(probability) - 1)
