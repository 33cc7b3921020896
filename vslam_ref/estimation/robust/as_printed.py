"""A2.8 used as what it is called, a loss.  It is runnable, and it is wrong.

Nothing but the study of the misprint uses this module.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.robust.losses import Loss


@dataclass(frozen=True)
class TukeyAsPrinted(Loss):
    r"""x (1 - x²/c²) inside \|x\| < c and 0 beyond, minimised as if it were a cost.

    Implements :eq:`eq-a2-8-printed`, the wrong form.

    Notes
    -----
    * For norms, x >= 0, the "cost" rises to 2c/(3 sqrt 3) at x = c/sqrt 3 = 0.577 c and falls back to 0 at
      c: beyond c/sqrt 3 a larger error is cheaper, and an error beyond c costs what none at all costs.
    * For signed residuals it is odd: its least value is at x = -c/sqrt 3, not at 0.
    * Its derivative at 0 is 1, so psi(x)/x is infinite there, and negative beyond c/sqrt 3.  Reweighted least
      squares cannot run on it; a method that goes downhill can.
    * At \|x\| = c, where the print says nothing, its limit 0 is taken.

    Examples
    --------
    >>> loss = TukeyAsPrinted(2.0)
    >>> loss.cost([0.0, 1.0, 1.5, 2.0, 9.0]).tolist()
    [0.0, 0.75, 0.65625, 0.0, 0.0]
    """

    c: float = 4.685064948543376

    def cost(self, x: ArrayLike) -> Array:
        """Odd in x: x (1 - u), then 0."""
        v, u = self._ratio(x)
        return v * np.maximum(1.0 - u, 0.0)

    def influence(self, x: ArrayLike) -> Array:
        r"""1 - 3u for \|x\| < c, then 0."""
        u = self._ratio(x)[1]
        return np.where(u < 1.0, 1.0 - 3.0 * u, 0.0 * u)

    def weight(self, x: ArrayLike) -> Array:
        """Influence over x: infinite at 0, negative beyond the top.  There is no sense in it."""
        v = np.asarray(x, dtype=np.float64)
        infinite: Array = np.full(v.shape, math.inf)
        return np.divide(self.influence(v), v, out=infinite, where=v != 0.0)

    def sqrt_weight(self, x: ArrayLike) -> Array:
        """Refused: a negative weight has no root.

        Raises
        ------
        ValueError
            Always.
        """
        raise ValueError("A2.8 as printed has negative weights: no reweighted least squares with it")

    def weight_slope(self, x: ArrayLike) -> Array:
        """Derivative of :meth:`weight` with respect to x²: -(1/x + 3x/c²) / (2 x²), then 0."""
        v, u = self._ratio(x)
        inside = (u < 1.0) & (v != 0.0)
        safe = np.where(inside, v, 1.0)
        return np.where(inside, -(1.0 + 3.0 * u) / (2.0 * safe**3), np.where(v == 0.0, -math.inf, 0.0 * u))

    def curvature(self, x: ArrayLike) -> Array:
        r"""-6 x/c² for \|x\| < c, then 0: concave for every norm."""
        v, u = self._ratio(x)
        return np.where(u < 1.0, -6.0 * v / self.c / self.c, 0.0 * u)
