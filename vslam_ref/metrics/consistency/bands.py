r"""What the mean NEES of honest runs may do: chi-squared lines and bands, summaries of a curve.

The NEES of one run is chi-squared with d degrees of freedom; the sum over M independent runs is
chi-squared with M d.  The mean over runs therefore lies under :math:`\chi^2_{Md}(p)/M` with
probability p **at one time chosen beforehand**.  With B's 50 runs and d = 3 the one-sided 95 % line is
3.592, the two-sided band [2.360, 3.716].

A curve of 1600 points is not one point.  That it crosses the line *somewhere* is far likelier than 5 %;
how much likelier depends on its correlation in time and has no closed form.  Claims about whole
curves use the summaries below and take their thresholds from a consistent control.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array


class Band(NamedTuple):
    """Two-sided band of the mean NEES over runs."""

    lower: float
    upper: float


def mean_line(runs: int, dof: int = 3, level: float = 0.95) -> float:
    """One-sided upper line of the mean of ``runs`` independent NEES.

    Implements :eq:`eq-band`.

    Parameters
    ----------
    runs : int
        Number of independent runs M.
    dof : int
        Degrees of freedom d of one NEES.
    level : float
        Probability of lying under the line at one time, in (0, 1).

    Returns
    -------
    float
        The quantile ``chi2(M d).ppf(level) / M``.

    Raises
    ------
    ValueError
        If ``runs`` or ``dof`` is below 1 or ``level`` outside (0, 1).

    Examples
    --------
    >>> round(mean_line(50), 3)
    3.592
    """
    _check(runs, dof, level)
    from scipy.special import gammaincinv

    # chi2(n) is gamma(n/2, scale 2); scipy.special loads faster than scipy.stats
    return float(2.0 * gammaincinv(runs * dof / 2.0, level) / runs)


def mean_band(runs: int, dof: int = 3, level: float = 0.95) -> Band:
    """Two-sided band of the mean of ``runs`` independent NEES, equal tails.

    Implements :eq:`eq-band`.

    Parameters and errors as for :func:`mean_line`.

    Examples
    --------
    >>> [round(v, 3) for v in mean_band(50)]
    [2.36, 3.716]
    """
    _check(runs, dof, level)
    tail = (1.0 - level) / 2.0
    return Band(mean_line(runs, dof, tail), mean_line(runs, dof, 1.0 - tail))


def detectable_inflation(runs: int, dof: int = 3, level: float = 0.95, power: float = 0.8) -> float:
    r"""Smallest factor on the NEES that ``runs`` runs find at one time with probability ``power``.

    A filter whose covariance is too small by a factor f has :math:`f \chi^2_{Md}/M` as its mean NEES.  It is
    over the one-sided line with probability ``power`` when
    :math:`f = \chi^2_{Md}(\text{level}) / \chi^2_{Md}(1 - \text{power})`.

    Examples
    --------
    >>> round(detectable_inflation(50), 3)
    1.328
    """
    _check(runs, dof, power)
    return mean_line(runs, dof, level) / mean_line(runs, dof, 1.0 - power)


def fraction_above(curves: ArrayLike, line: float, window: ArrayLike | None = None) -> Array:
    """Share of a curve's time points that lie above a line.

    Parameters
    ----------
    curves : array_like, shape (..., T)
        Mean NEES over time.
    line : float
        Level to exceed.
    window : array_like of bool, shape (T,), optional
        Which time points count; all by default.

    Returns
    -------
    ndarray, shape (...)
        In [0, 1]; NaN for a curve with a NaN in the window.
    """
    c = _windowed(curves, window)
    return np.where(np.any(np.isnan(c), axis=-1), np.nan, np.mean(c > line, axis=-1))


def time_maximum(curves: ArrayLike, window: ArrayLike | None = None) -> Array:
    """Largest value of each curve in the window.

    Parameters
    ----------
    curves : array_like, shape (..., T)
    window : array_like of bool, shape (T,), optional
        Which time points count; all by default.

    Returns
    -------
    ndarray, shape (...)
        NaN where the curve has a NaN.
    """
    return np.asarray(np.max(_windowed(curves, window), axis=-1), dtype=np.float64)


def window_mean(curves: ArrayLike, window: ArrayLike | None = None) -> Array:
    """Average over time of each curve in the window.

    Parameters
    ----------
    curves : array_like, shape (..., T)
    window : array_like of bool, shape (T,), optional
        Which time points count; all by default.

    Returns
    -------
    ndarray, shape (...)
    """
    return np.asarray(np.mean(_windowed(curves, window), axis=-1), dtype=np.float64)


def _windowed(curves: ArrayLike, window: ArrayLike | None) -> Array:
    """Take the columns of the window; a contiguous window stays a view."""
    c = np.asarray(curves, dtype=np.float64)
    if window is None:
        picked = np.arange(c.shape[-1])
    else:
        mask = np.asarray(window, dtype=bool)
        if mask.shape != c.shape[-1:]:
            raise ValueError(f"window has shape {mask.shape}, the curves need {c.shape[-1:]}")
        picked = np.flatnonzero(mask)
    if picked.size == 0:
        raise ValueError("the window holds no time point")
    if picked[-1] - picked[0] + 1 == picked.size:
        return c[..., picked[0] : picked[-1] + 1]
    return c[..., picked]


def _check(runs: int, dof: int, level: float) -> None:
    if runs < 1 or dof < 1 or not 0.0 < level < 1.0:
        raise ValueError(f"need runs >= 1, dof >= 1 and 0 < level < 1, got {runs}, {dof}, {level}")
