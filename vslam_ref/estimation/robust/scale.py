r"""The scale of the errors, from the errors: medians, which half of the data cannot move.

A loss says what is large; that needs a unit, the standard deviation :math:`\sigma` of the honest errors in
*one coordinate*.  The wrong matches must not decide it, so it is taken from a median:

* of scalars: :math:`|e|/\sigma` is half-normal, with the median :math:`\Phi^{-1}(3/4) = 0.6745`; so
  :math:`\hat\sigma = 1.4826\,\operatorname{med}|e|`;
* of norms of plane errors: :math:`\|e\|/\sigma` is Rayleigh, with distribution :math:`1 - e^{-r^2/2}` and
  the median :math:`\sqrt{2\ln 2} = 1.1774`; so :math:`\hat\sigma = 0.8493\,\operatorname{med}\|e\|`.

Errors are taken about zero: they are residuals, whose middle is the model.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array

MAD_1D = 1.482602218505602
"""1 / 0.6745: from the median of absolute scalars to sigma."""

MAD_NORM_2D = 0.8493218002880191
"""1 / sqrt(2 ln 2): from the median norm of plane errors to sigma in one coordinate."""


class Scale(NamedTuple):
    """Estimated standard deviation of one coordinate, and why it is what it is.

    ``sigma`` is never NaN.  It is ``inf`` where the sample does not determine it (see ``reason``), so that
    ``loss.scaled(sigma)`` is plain least squares; it is 0 where more than half of the errors are 0.
    """

    sigma: float
    reason: str


def small_sample_factor(measurements: int, parameters: int) -> float:
    r"""Factor on a median scale for residuals of a fitted model: 1 + 5/(measurements - parameters).

    Implements the factor of :eq:`eq-small-sample`.
    Residuals of a fit are smaller than errors, because the fit went to meet them.

    Parameters
    ----------
    measurements : int
        Number of scalars measured, >= 0: twice the number of points seen in an image.
    parameters : int
        Number of scalars fitted to them, >= 0: 6 for a pose.

    Returns
    -------
    float
        In (1, 6] with redundancy, and ``inf`` without.

    Notes
    -----
    PTAM's 1 + 5/(2n - 6) is this for n points and one pose.  At n = 3 it divides by zero; with fewer points
    its unsigned arithmetic wraps around and the factor is 1.  *Declared here:* without redundancy it is
    ``inf``.  Then no residual counts as large and all weights are 1.  Three reasons: it is the limit of the
    formula as the redundancy falls to zero; such a fit leaves residuals of zero whatever the noise, so they
    hold no scale; and the factor 1 would turn these zeros into the claim of no noise at all, and every next
    error into an outlier.

    Examples
    --------
    >>> small_sample_factor(2 * 1000, 6), small_sample_factor(2 * 4, 6), small_sample_factor(2 * 3, 6)
    (1.0025075225677031, 3.5, inf)
    """
    if measurements < 0 or parameters < 0:
        raise ValueError(f"need numbers >= 0, got {measurements} measurements and {parameters} parameters")
    redundancy = measurements - parameters
    return 1.0 + 5.0 / redundancy if redundancy > 0 else math.inf


def mad_scale(errors: ArrayLike, *, parameters: int | None = None) -> Scale:
    """Scale of scalar errors: 1.4826 times their median size.

    Implements :eq:`eq-mad`.

    Parameters
    ----------
    errors : array_like, shape (N,)
        Residuals about zero, all finite.
    parameters : int, optional
        Number of parameters that were fitted to these errors; with it the small-sample factor is
        applied.  Without it the errors are taken as they are.

    Returns
    -------
    Scale
        ``sigma`` in the unit of the errors.

    Raises
    ------
    ValueError
        If the errors are not (N,) or not all finite.

    Notes
    -----
    Breakdown point one half: as long as fewer than half of the errors are wrong, the median is bounded
    by the honest ones.

    Examples
    --------
    >>> mad_scale([-1.0, 0.5, 2.0, -0.1, 1e9]).sigma
    1.482602218505602
    """
    e = np.asarray(errors, dtype=np.float64)
    if e.ndim != 1 or not np.isfinite(e).all():
        raise ValueError(f"errors {e.shape}: need finite numbers of shape (N,)")
    return _scale(np.abs(e), MAD_1D, len(e), parameters)


def norm_scale(errors: ArrayLike, *, parameters: int | None = None) -> Scale:
    """Scale of plane errors: 0.8493 times their median norm.

    Implements :eq:`eq-mad-norm`.

    Parameters
    ----------
    errors : array_like, shape (N, 2)
        Residuals about zero, all finite; each already divided by its own known factor, such as 2^l on
        pyramid level l.
    parameters : int, optional
        As for :func:`mad_scale`; N points are 2 N measurements.

    Returns
    -------
    Scale
        ``sigma`` of *one coordinate*, in the unit of the errors.

    Raises
    ------
    ValueError
        If the errors are not (N, 2) or not all finite.

    Examples
    --------
    >>> round(norm_scale([[3.0, 4.0], [0.0, 1.0], [600.0, 800.0]]).sigma, 6)
    4.246609
    >>> norm_scale([[0.3, 0.4], [0.0, 1.0], [1.0, 0.0]], parameters=6)
    Scale(sigma=inf, reason='6 measurements for 6 parameters: no redundancy, the scale is unknown')
    """
    e = np.asarray(errors, dtype=np.float64)
    if e.ndim != 2 or e.shape[1] != 2 or not np.isfinite(e).all():
        raise ValueError(f"errors {e.shape}: need finite numbers of shape (N, 2)")
    return _scale(np.hypot(e[:, 0], e[:, 1]), MAD_NORM_2D, 2 * len(e), parameters)


def _scale(sizes: Array, factor: float, measured: int, fitted: int | None) -> Scale:
    if len(sizes) == 0:
        return Scale(math.inf, "no errors: the scale is unknown")
    if fitted is not None:
        small = small_sample_factor(measured, fitted)
        if math.isinf(small):
            have = f"{measured} measurements for {fitted} parameters"
            return Scale(math.inf, f"{have}: no redundancy, the scale is unknown")
        factor *= small
    sigma = factor * float(np.median(sizes))
    return Scale(sigma, "median" if sigma > 0.0 else "more than half of the errors are zero")
