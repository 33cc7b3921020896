r"""What robustness costs when every error is honest, and the constants that make it cost 5 %.

Estimate a place :math:`\mu` from points :math:`x_i = \mu + e_i` in d dimensions, errors standard Gaussian, by
minimising :math:`\sum \rho(\|x_i - \mu\|)`.  With :math:`r = \|e\|`,

.. math:: A = \mathrm E[\psi(r)^2]/d, \qquad B = \mathrm E[(1 - 1/d)\,w(r) + \rho''(r)/d],

one coordinate of the estimate has the variance :math:`A/(N B^2)` for large N; the mean has 1/N.  Their ratio
:math:`B^2/A` is the *efficiency*.  For d = 1 it is the textbook's :math:`(\mathrm E\psi')^2/\mathrm E\psi^2`.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import Final

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.robust.losses import LOSSES, Loss

TUNED_95: Final[dict[tuple[str, int], float]] = {
    ("huber", 1): 1.3449975085120365,
    ("huber", 2): 1.501141083526302,
    ("cauchy", 1): 2.3849471193621468,
    ("cauchy", 2): 2.5486376239449164,
    ("geman-mcclure", 1): 3.7874187608383743,
    ("geman-mcclure", 2): 4.095552337074283,
    ("tukey", 1): 4.685064948543376,
    ("tukey", 2): 5.122986089952371,
}
"""(loss, dimension of an error) -> c in units of sigma for an efficiency of 95 %."""

NODES = 200
"""Gauss-Legendre nodes on each side of c; exact to rounding for all losses here."""

TAIL = 12.0
"""Standard deviations beyond which a Gaussian error is not looked for (3e-32 of them, for d = 2)."""


def tuned(name: str, dimension: int = 1) -> Loss:
    """Return a loss with 95 % efficiency for errors of unit standard deviation.

    Parameters
    ----------
    name : str
        Key of :data:`~vslam_ref.estimation.robust.losses.LOSSES`.
    dimension : {1, 2}
        1 for scalar residuals, 2 for norms of image errors.

    Returns
    -------
    Loss
        Use ``tuned(...).scaled(sigma)`` on errors of standard deviation sigma in one coordinate.

    Raises
    ------
    ValueError
        If the name or the dimension is unknown.

    Examples
    --------
    >>> round(tuned("tukey").c, 4), round(tuned("tukey", 2).c, 4), tuned("l2").c
    (4.6851, 5.123, inf)
    """
    if name not in LOSSES:
        raise ValueError(f"unknown loss {name!r}; known: {', '.join(LOSSES)}")
    if dimension not in (1, 2):
        raise ValueError(f"dimension={dimension}: constants are known for errors of 1 and 2 dimensions")
    return LOSSES[name]() if name == "l2" else LOSSES[name](TUNED_95[name, dimension])


def efficiency(loss: Loss, dimension: int = 1) -> float:
    """Efficiency of the location estimate under Gaussian errors of unit standard deviation.

    Implements :eq:`eq-efficiency`.

    Parameters
    ----------
    loss : Loss
        With its constant in units of sigma.
    dimension : int
        Number d of coordinates of an error, 1 to 10; the loss is applied to its norm.

    Returns
    -------
    float
        In (0, 1]; 1 for least squares.

    Raises
    ------
    ValueError
        If the dimension is out of range.

    Examples
    --------
    >>> from vslam_ref.estimation.robust import Tukey
    >>> round(efficiency(Tukey(4.6851)), 4), round(efficiency(Tukey(4.6851), 2), 4)
    (0.95, 0.929)
    """
    r, dm = _norms(loss, dimension)
    top = float(np.sum(dm * ((1 - 1 / dimension) * loss.weight(r) + loss.curvature(r) / dimension)))
    return top**2 / (float(np.sum(dm * loss.influence(r) ** 2)) / dimension)


@lru_cache(maxsize=64)
def covariance_factor(loss: Loss, dimension: int = 1) -> float:
    r"""Return the factor that makes a covariance of the last weights right: E w over the efficiency.

    Implements :eq:`eq-weight-covariance`.

    Parameters
    ----------
    loss : Loss
        With its constant in units of sigma.
    dimension : int
        Number d of coordinates of an error, 1 to 10; the loss is applied to its norm.

    Returns
    -------
    float
        1 for least squares.

    Raises
    ------
    ValueError
        If the dimension is out of range.

    Notes
    -----
    The matrix H of the weighted normal equations counts a measurement by its weight, whose mean is E w; it is
    worth its efficiency.  For Gaussian errors, and weights that do not depend on where a measurement lies.

    Examples
    --------
    >>> from vslam_ref.estimation.robust import L2, tuned
    >>> round(covariance_factor(tuned("tukey", 2), 2), 4), round(covariance_factor(L2(), 2), 12)
    (0.9044, 1.0)
    """
    r, dm = _norms(loss, dimension)
    return float(np.sum(dm * loss.weight(r))) / efficiency(loss, dimension)


def _norms(loss: Loss, dimension: int) -> tuple[Array, Array]:
    """Norms of standard Gaussian errors at the nodes of a quadrature, and their probabilities."""
    if not 1 <= dimension <= 10:
        raise ValueError(f"dimension={dimension}: must be from 1 to 10")
    d = dimension
    x, w = np.polynomial.legendre.leggauss(NODES)
    end = TAIL + d
    edges = sorted({0.0, min(loss.c, end), end})
    r = np.concatenate([a + (b - a) * (x + 1) / 2 for a, b in pairwise(edges)])
    dr = np.concatenate([(b - a) * w / 2 for a, b in pairwise(edges)])
    density = r ** (d - 1) * np.exp(-r * r / 2) / (2 ** (d / 2 - 1) * math.gamma(d / 2))
    return r, dr * density
