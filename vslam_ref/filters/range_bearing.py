"""Range and bearing turned into relative Cartesian measurements without bias.

The filters of this room take landmarks in vehicle coordinates, metres.  A sensor that gives range r
and bearing b, with independent Gaussian errors of variances s = sigma_range^2 and v = sigma_bearing^2
about the true (rho, beta), has to be converted.  In complex numbers the naive r e^{ib} is biased::

    E[r e^{ib}] = rho e^{i beta} E[e^{i (b - beta)}] = rho e^{i beta} e^{-v/2}

so a landmark seen often is pulled towards the sensor by a share v/2.  The *unbiased* conversion

    zeta = e^{v/2} r e^{ib},      E[zeta] = rho e^{i beta}

has no such pull.  Its covariance follows from E[r^2] = rho^2 + s and E[e^{2i (b - beta)}] = e^{-2v}.
In the axes of the line of sight it is diagonal, with half sum and half difference::

    A = (e^{v}  (rho^2 + s) - rho^2) / 2        var along  = A + B
    B = (e^{-v} (rho^2 + s) - rho^2) / 2        var across = A - B

A filter knows neither rho nor beta.  Taking them from its prediction would make the covariance depend
on the state, and the exact reduction of seed B's filter (chapter 16) would break.  So they are estimated
*from the measurement alone*: r^2 is an unbiased estimate of rho^2 + s, r^2 - s one of rho^2, and the
axes are those of b, whose own error multiplies B by e^{-2v} on average, which e^{2v} undoes::

    var along  = s (1 + e^{2v}) / 2 - r^2 (e^v - 1)^2 / 2
    var across = (r^2 - s) (e^{2v} - 1) / 2

The mean of this covariance over all measurements of one landmark is exactly the true covariance of
zeta.  To first order it is the familiar s along the line of sight and r^2 v across.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import so2


class Converted(NamedTuple):
    """Relative Cartesian measurements (..., 2), metres, and their covariances (..., 2, 2)."""

    z: Array
    cov: Array


def cartesian_from_polar(polar: ArrayLike, sigma_range: float, sigma_bearing: float) -> Converted:
    """Convert range and bearing without bias; the covariance depends on the measurement only.

    Parameters
    ----------
    polar : array_like, shape (..., 2)
        Range (m) and bearing (rad, left positive), sensor frame.
    sigma_range, sigma_bearing : float
        Standard deviations, metres and radians.

    Returns
    -------
    Converted
        Sensor frame: x ahead, y to the left.

    Raises
    ------
    ValueError
        If a range is so short (r <= sigma_range), or the bearing so poor for it
        (r (e^v - 1) >= sigma_range sqrt(1 + e^{2v})), that the covariance estimate is not positive.

    Examples
    --------
    >>> z, cov = cartesian_from_polar([2.0, 0.0], sigma_range=0.1, sigma_bearing=0.01)
    >>> z.round(4), cov.round(5)
    (array([2.0001, 0.    ]), array([[0.01  , 0.    ],
           [0.    , 0.0004]]))
    """
    polar = np.asarray(polar, dtype=np.float64)
    r, b = polar[..., 0], polar[..., 1]
    s, v = sigma_range**2, sigma_bearing**2
    growth, growth_twice = np.expm1(v), np.expm1(2 * v)
    along = s * (1 + growth_twice / 2) - (r * growth) ** 2 / 2
    across = (r * r - s) * growth_twice / 2
    bad = (along <= 0) | (across <= 0) | (r <= 0)
    if np.any(bad):
        what = f"sigma_range={sigma_range} m and sigma_bearing={sigma_bearing} rad"
        raise ValueError(f"range {r[bad].flat[0]} m with {what}: no positive covariance without bias")
    R = so2.exp(b)
    z = (np.exp(v / 2) * r)[..., None] * R[..., :, 0]
    variances = np.stack([along, across], -1)
    return Converted(z, np.einsum("...ij,...j,...kj->...ik", R, variances, R))
