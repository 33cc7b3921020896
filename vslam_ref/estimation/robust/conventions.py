r"""The same losses in the forms of other libraries.

Ours: rho(x) of a residual or a norm x, half a square near zero, and the cost of a problem is the sum of rho.

=========  =====================  ====================  ==========================  ====================
library    argument               near zero             Tukey beyond c              cost of a problem
=========  =====================  ====================  ==========================  ====================
here       x                      x²/2                  c²/6                        sum of rho
Ceres      s = \|e\|²             s                     c²/3                        half the sum
SciPy      z = (x / f_scale)²     z                     none (callable: 1/3)        f_scale²/2 times sum
GTSAM      \|e\|, whitened        x²/2                  c²/6                        sum of loss
OpenCV     distance, in pixels    x²/2                  none                        fitLine minimises sum
PTAM       \|e\|² and (c sigma)²  3x²/c²                1                           sum of scores
=========  =====================  ====================  ==========================  ====================

All of them hand the *same weight* to their linear system: 1 at zero, (1 - x²/c²)² for Tukey.  So minimisers
agree wherever the constants do; costs, and every threshold on a cost, do not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.robust.losses import Loss

Library = Literal["ceres", "scipy", "gtsam", "opencv", "ptam"]

PTAM_FACTORS: dict[str, Callable[[float], float]] = {
    "l2": lambda c: 2.0,
    "huber": lambda c: 1.0,
    "cauchy": lambda c: 2.0 / c**2,
    "tukey": lambda c: 6.0 / c**2,
}
"""PTAM's score of one error over our cost.

Tukey's and Cauchy's are divided by c², and c follows the scale: scores of two iterations, with two
scales, cannot be compared.
"""


class SquaredForm(NamedTuple):
    """A loss of s = x²: ``rho (...)``, ``first (...)`` and ``second (...)`` derivative with respect to s."""

    rho: Array
    first: Array
    second: Array


def squared_form(loss: Loss, s: ArrayLike) -> SquaredForm:
    r"""Ceres' form of a loss: :math:`\rho_C(s) = 2\rho(\sqrt s)`, so that :math:`\rho_C' = w(\sqrt s)`.

    Parameters
    ----------
    loss : Loss
    s : array_like, shape (...)
        Squared norms, >= 0.

    Returns
    -------
    SquaredForm

    Raises
    ------
    ValueError
        If a squared norm is negative.

    Examples
    --------
    >>> from vslam_ref.estimation.robust import Tukey
    >>> [part.item() for part in squared_form(Tukey(3.0), 0.0)]
    [0.0, 1.0, -0.2222222222222222]
    """
    s = np.asarray(s, dtype=np.float64)
    if (s < 0.0).any():
        raise ValueError(f"squared norms must be >= 0, got {s.min()}")
    x = np.sqrt(s)
    return SquaredForm(2.0 * loss.cost(x), loss.weight(x), loss.weight_slope(x))


def scipy_loss(loss: Loss) -> Callable[[Array], Array]:
    """Return a ``loss`` for :func:`scipy.optimize.least_squares`, to be used with ``f_scale=1``.

    SciPy's own Huber and Cauchy have the constant 1 and are stretched by ``f_scale``: they are ours with
    c = f_scale.  Its cost is then ours: f_scale²/2 times the sum of rho(z), z = (x / f_scale)².

    Parameters
    ----------
    loss : Loss
        One loss for all residuals; they are scalars in SciPy, never norms.

    Returns
    -------
    callable
        Maps z (m,) to (3, m): value and two derivatives.

    Examples
    --------
    >>> from vslam_ref.estimation.robust import Huber
    >>> scipy_loss(Huber(1.0))(np.array([0.25, 4.0])).round(4).tolist()
    [[0.25, 3.0], [1.0, 0.5], [0.0, -0.0625]]
    """
    return lambda z: np.stack(squared_form(loss, z))


def ptam_score(name: str, squared_error: ArrayLike, squared_cut: float) -> Array:
    """PTAM's ``ObjectiveScore``: what it adds up and prints.

    Parameters
    ----------
    name : str
        ``"l2"``, ``"huber"``, ``"cauchy"`` or ``"tukey"``.
    squared_error : array_like, shape (...)
        Squared norm of an image error over its level's scale.
    squared_cut : float
        What PTAM calls sigma squared: (c sigma)², the constant already multiplied in.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If PTAM has no such loss.

    Examples
    --------
    >>> ptam_score("tukey", [0.0, 4.0, 9.0], 4.0).tolist()
    [0.0, 1.0, 1.0]
    """
    from vslam_ref.estimation.robust.losses import LOSSES

    if name not in PTAM_FACTORS:
        raise ValueError(f"PTAM has no loss {name!r}; it has {', '.join(PTAM_FACTORS)}")
    c = float(np.sqrt(squared_cut))
    return PTAM_FACTORS[name](c) * LOSSES[name](c).cost(np.sqrt(np.asarray(squared_error, dtype=np.float64)))


def cost_factor(library: Library, name: str, c: float) -> float:
    """How many times our cost a library's *own number for one error* is.

    Parameters
    ----------
    library : {"ceres", "scipy", "gtsam", "opencv", "ptam"}
        For SciPy, ``f_scale`` is taken to be 1 and the loss a callable of :func:`scipy_loss`.
    name : str
        Key of :data:`~vslam_ref.estimation.robust.losses.LOSSES`.
    c : float
        The loss' constant.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        If the library is unknown or lacks the loss.

    Examples
    --------
    >>> [cost_factor(library, "tukey", 3.0) for library in ("ceres", "gtsam")]
    [2.0, 1.0]
    """
    has = {
        "ceres": ("l2", "huber", "cauchy", "tukey"),
        "scipy": ("l2", "huber", "cauchy", "geman-mcclure", "tukey"),
        "gtsam": ("l2", "huber", "cauchy", "geman-mcclure", "tukey"),
        "opencv": ("l2", "huber"),
        "ptam": tuple(PTAM_FACTORS),
    }
    if library not in has:
        raise ValueError(f"unknown library {library!r}; known: {', '.join(has)}")
    if name not in has[library]:
        raise ValueError(f"{library} has no loss {name!r}; it has {', '.join(has[library])}")
    if library == "ptam":
        return PTAM_FACTORS[name](c)
    return 2.0 if library in ("ceres", "scipy") else 1.0
