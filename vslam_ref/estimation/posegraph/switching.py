r"""Losses that tell false loops from true ones: switches, dynamic covariance scaling, a mixture of two.

With :math:`c = e^\top\Omega e`, the square of an edge's error x in standard deviations, and half a square as
the house's cost of a small error:

=============  =========================================  ===============================  ===========
loss           cost times 2                               weight                           false above
=============  =========================================  ===============================  ===========
switchable     least of s² c + Xi (1 - s)² over s         s², s = Xi / (Xi + c)            c = Xi
Geman-McClure  Xi c / (Xi + c)                            (Xi / (Xi + c))²                 c = Xi
DCS            c, beyond Phi: Phi (3c - Phi) / (c + Phi)  s², s = min(1, 2 Phi/(Phi + c))  c = 3 Phi
max-mixture    the lesser of c and k + nu c               1 or nu                          c = k
=============  =========================================  ===============================  ===========

The first two are one loss: the switch s of an edge meets nothing but its own error, so its best value can be
written down, and what is left is Geman-McClure with Xi = (constant of the loss)².  DCS takes twice that
switch, at most 1: edges up to Phi keep their full weight.  A mixture says an edge is either as its covariance
tells, or means nothing; k is where the second is more likely.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.posegraph.spaces import Space
from vslam_ref.estimation.robust import L2, Cauchy, GemanMcClure, Huber, Loss

SWITCH = 4.0
"""Xi and Phi: an edge is given up at c = 4 (a switch of one half), of DCS at c = 12."""
NULL = 1e-6
"""Weight of an edge that means nothing."""
LIKELY: dict[str, float] = {"se2": 16.266236, "se3": 22.457744, "sim3": 24.321886}
"""Where a mixture changes sides: the square that one true edge in 1000 exceeds (3, 6, 7 coordinates)."""


@dataclass(frozen=True)
class Switchable(Loss):
    """A switchable constraint, its switch eliminated; c is the root of Xi.

    Implements :eq:`eq-switches` by :eq:`eq-switch-eliminated`.

    Examples
    --------
    >>> float(Switchable(2.0).cost(2.0)), float(GemanMcClure(2.0).cost(2.0).round(12))
    (1.0, 1.0)
    """

    c: float = SWITCH**0.5

    def switch(self, x: ArrayLike) -> Array:
        """The best switch s in (0, 1], (...)."""
        return 1.0 / (1.0 + self._ratio(x)[1])

    def cost(self, x: ArrayLike) -> Array:
        """Half of s² c + Xi (1 - s)² at the best s."""
        v, u = self._ratio(x)
        s = self.switch(v)
        # Xi (1 - s)^2 = Xi u^2 s^2 = x^2 u s^2, which needs no Xi: right for c = inf, too
        return 0.5 * (s * v) ** 2 * (1.0 + u)

    def weight(self, x: ArrayLike) -> Array:
        """s²."""
        return self.switch(x) ** 2

    def weight_slope(self, x: ArrayLike) -> Array:
        """-2 s³ / Xi."""
        return -2.0 * self.switch(x) ** 3 / self.c / self.c


@dataclass(frozen=True)
class DynamicCovariance(Loss):
    """Dynamic covariance scaling; c is the root of Phi.

    Implements :eq:`eq-other-switches`, on the left.

    Examples
    --------
    >>> DynamicCovariance(2.0).cost([2.0, 6.0]).tolist()  # 2 Phi/(Phi + 36) = 0.2
    [2.0, 5.2]
    """

    c: float = SWITCH**0.5

    def switch(self, x: ArrayLike) -> Array:
        """S in (0, 1], (...): twice the best switch of a switchable constraint, at most 1."""
        return np.minimum(1.0, 2.0 / (1.0 + self._ratio(x)[1]))

    def cost(self, x: ArrayLike) -> Array:
        """Half a square up to Phi, then Phi (3 - 4 Phi/(c + Phi)) / 2."""
        v, u = self._ratio(x)
        with np.errstate(invalid="ignore"):
            beyond = 0.5 * self.c * self.c * (3.0 - 4.0 / (1.0 + u))
        return np.where(u > 1.0, beyond, 0.5 * v * v)

    def weight(self, x: ArrayLike) -> Array:
        """s²."""
        return self.switch(x) ** 2

    def weight_slope(self, x: ArrayLike) -> Array:
        """0 up to Phi, then -s³ / Phi."""
        _, u = self._ratio(x)
        return np.where(u > 1.0, -(self.switch(x) ** 3) / self.c / self.c, 0.0 * u)


@dataclass(frozen=True)
class MaxMixture(Loss):
    """Either honest or meaningless: the lesser of c and k + nu c; the constant is the root of k.

    Implements :eq:`eq-other-switches`, on the right.

    Examples
    --------
    >>> MaxMixture(2.0).weight([1.9, 2.1]).tolist()
    [1.0, 1e-06]
    """

    c: float = LIKELY["se3"] ** 0.5

    def cost(self, x: ArrayLike) -> Array:
        """Half of the lesser one."""
        v = np.asarray(x, dtype=np.float64)
        return 0.5 * np.minimum(v * v, self.c * self.c + NULL * v * v)

    def weight(self, x: ArrayLike) -> Array:
        """1, beyond the change of sides nu."""
        v = np.asarray(x, dtype=np.float64)
        weight: Array = np.where(v * v * (1.0 - NULL) <= self.c * self.c, 1.0, NULL)
        return np.where(np.isnan(v), np.nan, weight)

    def weight_slope(self, x: ArrayLike) -> Array:
        """0 on both sides."""
        return np.where(np.isnan(x), np.nan, 0.0)


class EdgeLoss(NamedTuple):
    """A loss of edges, and what it calls false.

    Attributes
    ----------
    loss : Loss
    limit : float
        chi² above which an edge is false; 0: none is.
    usual : bool
        Whether the constant is the usual one, which the solver may widen.
    rival : Loss, optional
        Another loss that tells false edges; where it leads, a second descent begins.
    """

    loss: Loss
    limit: float = 0.0
    usual: bool = False
    rival: Loss | None = None

    def widened(self, limit: float) -> EdgeLoss:
        """Return the same loss with another limit.

        Examples
        --------
        >>> edge_loss("switchable", "se2").widened(16.0).loss
        Switchable(c=4.0)
        """
        return self._replace(loss=self.loss.scaled((limit / self.limit) ** 0.5), limit=limit)


NAMES = ("l2", "huber", "cauchy", "geman-mcclure", "switchable", "dcs", "max-mixture")


def edge_loss(name: str, space: Space, constant: float | None = None) -> EdgeLoss:
    """Return a loss by its name, with its usual constant or another.

    Parameters
    ----------
    name : str
        One of ``NAMES``.
    space : {"se2", "se3", "sim3"}
        A mixture needs it.
    constant : float, optional
        In standard deviations of an edge's error (roots of Xi, Phi and k), > 0.

    Raises
    ------
    ValueError
        On another name, or a constant that means nothing.

    Examples
    --------
    >>> edge_loss("dcs", "se2")
    EdgeLoss(loss=DynamicCovariance(c=2.0), limit=12.0, usual=True, rival=Switchable(c=2.0))
    """
    kinds: dict[str, tuple[type[Loss], float]] = {
        "l2": (L2, 0.0),
        "huber": (Huber, 0.0),
        "cauchy": (Cauchy, 0.0),
        "geman-mcclure": (GemanMcClure, 1.0),  # a weight of 1/4
        "switchable": (Switchable, 1.0),
        "dcs": (DynamicCovariance, 3.0),
        "max-mixture": (MaxMixture, 1.0 / (1.0 - NULL)),
    }
    rivals: dict[str, Callable[[float], Loss]] = {
        "geman-mcclure": DynamicCovariance,
        "switchable": DynamicCovariance,
        "dcs": Switchable,
        "max-mixture": lambda c: DynamicCovariance(0.5 * c),  # of the usual k nearly the usual Phi
    }
    if name not in kinds:
        raise ValueError(f"unknown loss {name!r}; known: {', '.join(NAMES)}")
    usual = {"geman-mcclure": SWITCH**0.5, "max-mixture": LIKELY[space] ** 0.5}
    kind, times = kinds[name]
    c = usual.get(name) if constant is None else constant
    loss = kind() if c is None or name == "l2" else kind(c)
    rival = rivals[name](loss.c) if name in rivals else None
    return EdgeLoss(loss, times * loss.c**2 if times else 0.0, constant is None, rival)
