r"""Five losses, each with cost, influence, weight, root of the weight and curvature.

All are functions of the residual x divided by its scale, or of the norm of a residual vector
divided by its scale.  They agree on one thing: near zero each of them is :math:`x^2/2`, so its weight
there is 1.  With :math:`u = x^2/c^2`:

==================  ================================  ====================  =======================
loss                cost                              weight                curvature
==================  ================================  ====================  =======================
L2                  x²/2                              1                     1
Huber               x²/2, beyond c: c (\|x\| - c/2)   1, beyond c: c/\|x\|  1, beyond c: 0
Cauchy              c²/2 log(1 + u)                   1/(1 + u)             (1 - u)/(1 + u)²
Geman-McClure       x²/2 / (1 + u)                    1/(1 + u)²            (1 - 3u)/(1 + u)³
Tukey               c²/6 (1 - (1 - u)³), then c²/6    (1 - u)², then 0      (1 - u)(1 - 5u), then 0
==================  ================================  ====================  =======================

*At the seams:* cost, influence and weight of all five are continuous everywhere.  Tukey's curvature is
continuous at \|x\| = c as well; Huber's jumps there from 1 to 0, and at \|x\| = c itself it is 1.

*Scale:* :math:`\rho_{\sigma c}(\sigma x) = \sigma^2 \rho_c(x)` for all of them.  So a loss for residuals in
pixels is :meth:`Loss.scaled` by the pixels' scale.  ``c = inf`` is allowed and makes each of them L2.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array


@dataclass(frozen=True)
class Loss:
    r"""A loss with one constant c, in the unit of its residuals.

    Parameters
    ----------
    c : float
        Where robustness begins (Huber, Cauchy, Geman-McClure) or where a residual stops to count
        (Tukey), > 0.  ``inf`` makes the loss L2.

    Raises
    ------
    ValueError
        If ``c`` is not positive.

    Notes
    -----
    Subclasses give :meth:`cost`, :meth:`weight` and :meth:`weight_slope`; the rest follows from
    :math:`\psi = w x` and :math:`\rho'' = w + 2 x^2\, \mathrm{d}w/\mathrm{d}(x^2)`.  All methods take arrays
    of any shape and return arrays of that shape; a NaN stays a NaN.
    """

    c: float = math.inf

    def __post_init__(self) -> None:
        """Refuse constants that mean nothing."""
        if not self.c > 0:
            raise ValueError(f"c={self.c}: a loss needs a constant > 0 (inf for plain least squares)")

    def scaled(self, sigma: float) -> Self:
        """Return the loss for residuals that are ``sigma`` times as large: constant c times sigma.

        Examples
        --------
        >>> Tukey(4.0).scaled(0.5).c
        2.0
        """
        return dataclasses.replace(self, c=self.c * sigma)

    def cost(self, x: ArrayLike) -> Array:
        """rho(x), (...): what a residual costs; 0 at 0 and nowhere negative."""
        raise NotImplementedError

    def weight(self, x: ArrayLike) -> Array:
        """w(x) = psi(x)/x, (...), with its limit 1 at 0."""
        raise NotImplementedError

    def weight_slope(self, x: ArrayLike) -> Array:
        """Derivative of the weight with respect to the *square* of x, (...); never positive."""
        raise NotImplementedError

    def influence(self, x: ArrayLike) -> Array:
        """psi(x) = rho'(x), (...): how strongly a residual pulls."""
        v = np.asarray(x, dtype=np.float64)
        return self.weight(v) * v

    def sqrt_weight(self, x: ArrayLike) -> Array:
        """Root of the weight, (...): multiply a residual and its row of the Jacobian by it."""
        return np.sqrt(self.weight(x))

    def curvature(self, x: ArrayLike) -> Array:
        """rho''(x), (...).  Negative where a residual is given up."""
        v = np.asarray(x, dtype=np.float64)
        return self.weight(v) + 2.0 * v * v * self.weight_slope(v)

    def _ratio(self, x: ArrayLike) -> tuple[Array, Array]:
        """Return x and u = (x/c)^2."""
        v = np.asarray(x, dtype=np.float64)
        t = v / self.c
        return v, t * t


@dataclass(frozen=True)
class L2(Loss):
    """Least squares: every error counts in full.  Its constant plays no part.

    Examples
    --------
    >>> L2().cost([0.0, 1.0, 4.0]).tolist(), L2().influence(4.0).item()
    ([0.0, 0.5, 8.0], 4.0)
    """

    def cost(self, x: ArrayLike) -> Array:
        """x^2 / 2."""
        v = np.asarray(x, dtype=np.float64)
        return 0.5 * v * v

    def weight(self, x: ArrayLike) -> Array:
        """1."""
        return np.where(np.isnan(x), np.nan, 1.0)

    def weight_slope(self, x: ArrayLike) -> Array:
        """0."""
        return np.where(np.isnan(x), np.nan, 0.0)


@dataclass(frozen=True)
class Huber(Loss):
    r"""Square near zero, straight beyond c: a large error pulls with the force c, never more.

    Implements the row "Huber" of the table above; convex, so the minimum is where every start leads.

    Examples
    --------
    >>> Huber(1.5).influence([0.5, 1.5, 10.0]).tolist()
    [0.5, 1.5, 1.5]
    """

    c: float = 1.3449975085120365

    def cost(self, x: ArrayLike) -> Array:
        r"""x²/2 up to c, then c (\|x\| - c/2)."""
        size = np.abs(np.asarray(x, dtype=np.float64))
        capped = np.minimum(size, self.c)
        return capped * (size - 0.5 * capped)

    def weight(self, x: ArrayLike) -> Array:
        r"""1 up to c, then c/\|x\|."""
        size = np.abs(np.asarray(x, dtype=np.float64))
        return np.divide(self.c, size, out=_one_like(size), where=size > self.c)

    def weight_slope(self, x: ArrayLike) -> Array:
        r"""0 up to c, then -c / (2 \|x\|³)."""
        size = np.abs(np.asarray(x, dtype=np.float64))
        beyond = size > self.c
        return np.where(beyond, -0.5 * self.weight(size) / np.where(beyond, size, 1.0) ** 2, 0.0 * size)


@dataclass(frozen=True)
class Cauchy(Loss):
    """Logarithmic: the pull of an error falls like 1/x, and never quite ends.

    Examples
    --------
    >>> Cauchy(2.0).weight([0.0, 2.0]).tolist()
    [1.0, 0.5]
    """

    c: float = 2.3849471193621468

    def cost(self, x: ArrayLike) -> Array:
        """c²/2 log(1 + u), as x²/2 times log(1 + u)/u so that it is exact near 0 and for c = inf."""
        v, u = self._ratio(x)
        return 0.5 * v * v * np.divide(np.log1p(u), u, out=_one_like(u), where=u > 0.0)

    def weight(self, x: ArrayLike) -> Array:
        """1 / (1 + u)."""
        return 1.0 / (1.0 + self._ratio(x)[1])

    def weight_slope(self, x: ArrayLike) -> Array:
        """-1 / (c (1 + u))²."""
        return -((self.weight(x) / self.c) ** 2)


@dataclass(frozen=True)
class GemanMcClure(Loss):
    """Bounded: no error costs more than c²/2.

    Examples
    --------
    >>> GemanMcClure(2.0).cost([2.0, 1e9]).round(12).tolist()
    [1.0, 2.0]
    """

    c: float = 3.7874187608383743

    def cost(self, x: ArrayLike) -> Array:
        """x²/2 / (1 + u)."""
        v = np.asarray(x, dtype=np.float64)
        return 0.5 * (v / np.hypot(1.0, v / self.c)) ** 2

    def weight(self, x: ArrayLike) -> Array:
        """1 / (1 + u)²."""
        return self.sqrt_weight(x) ** 2

    def sqrt_weight(self, x: ArrayLike) -> Array:
        """1 / (1 + u)."""
        return 1.0 / (1.0 + self._ratio(x)[1])

    def weight_slope(self, x: ArrayLike) -> Array:
        """-2 / (c² (1 + u)³)."""
        return -2.0 * self.sqrt_weight(x) ** 3 / self.c / self.c


@dataclass(frozen=True)
class Tukey(Loss):
    r"""Tukey's biweight: errors of c and more are left out.

    Implements :eq:`eq-a2-8` (A2.8), corrected: what is printed as the loss is the square root of the
    weight times the residual.  See :class:`~vslam_ref.estimation.robust.as_printed.TukeyAsPrinted`.

    Notes
    -----
    With s = 1 - x²/c² inside \|x\| <= c and s = 0 outside: root of the weight s, weight s², influence
    x s², curvature s (1 - 5 x²/c²), cost c²/6 (1 - s³).  The cost is evaluated as x²/2 (1 - u + u²/3), which
    subtracts nothing from 1 when x is small.  At \|x\| = c the cost is c²/6 and all else is 0.

    Examples
    --------
    >>> loss = Tukey(2.0)
    >>> loss.cost([0.0, 1.0, 2.0, 3.0]).round(6).tolist()
    [0.0, 0.385417, 0.666667, 0.666667]
    >>> loss.influence([1.0, 2.0]).tolist()
    [0.5625, 0.0]
    """

    c: float = 4.685064948543376

    def cost(self, x: ArrayLike) -> Array:
        r"""c²/6 (1 - s³) inside, c²/6 beyond c."""
        size = np.minimum(np.abs(np.asarray(x, dtype=np.float64)), self.c)
        _, u = self._ratio(size) if math.isfinite(self.c) else (size, 0.0 * size)
        return 0.5 * size * size * (1.0 - u + u * u / 3.0)

    def weight(self, x: ArrayLike) -> Array:
        """s²."""
        return self.sqrt_weight(x) ** 2

    def sqrt_weight(self, x: ArrayLike) -> Array:
        """s, never negative."""
        return np.maximum(1.0 - self._ratio(x)[1], 0.0)

    def weight_slope(self, x: ArrayLike) -> Array:
        """-2 s / c²."""
        return -2.0 * self.sqrt_weight(x) / self.c / self.c


def _one_like(x: Array) -> Array:
    """Ones of the shape of x, NaN where x is."""
    return np.where(np.isnan(x), np.nan, 1.0)


LOSSES: dict[str, type[Loss]] = {
    "l2": L2,
    "huber": Huber,
    "cauchy": Cauchy,
    "geman-mcclure": GemanMcClure,
    "tukey": Tukey,
}
"""By the names that commands and configurations use."""
