r"""How the damping lambda follows the gain: three rules behind one interface.

The gain is what a step won over what the linear model promised.  Near 1 the model is good and the damping
should vanish; below 0 the step led uphill.

Nielsen's rule changes lambda smoothly, by :math:`\max(1/3,\, 1 - (2\,\text{gain} - 1)^3)` after a success,
and by 2, 4, 8… after failures in a row.  Ceres keeps a trust-region radius, 1/lambda, and changes it by the
same function; what differs are the scale D and the start:

===========  ====================================  ========================  ======================
rule         first lambda                          scale D                   bounds
===========  ====================================  ========================  ======================
Nielsen      tau, the largest column being 1       largest columns so far    none
Ceres        1e-4 (radius 1e4)                     columns, in 1e-3-1e16     radius in 1e-32-1e16
Undamped     0                                     columns                   none: Gauss-Newton
===========  ====================================  ========================  ======================

A column that vanishes at some x, as that of a rate does where its exponential has died away, takes its
damping with it, and the next step along it is huge.  Moré's scale remembers how long the column was.

Gain, growth, tau and, where D comes from the columns, lambda and the radius are dimensionless; D has the
unit of a column of J.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np

from vslam_ref.arrays import Array

Scaling = Literal["largest", "columns", "none"]


class DampingState(NamedTuple):
    """Damping lambda, and the factor for the next failure."""

    value: float
    growth: float


class Damping(Protocol):
    """What the solver asks of a rule."""

    @property
    def downhill_only(self) -> bool:
        """Whether a step that does not decrease the cost is refused."""

    def scale(self, lengths: Array, before: Array | None) -> Array:
        """Diagonal of D, (n,), > 0, from the lengths of J's columns; ``before`` is the last D."""

    def first(self, stiffness: float) -> DampingState:
        """Damping of the first step; ``stiffness`` is the square of the longest column in the metric D."""

    def success(self, state: DampingState, gain: float) -> DampingState:
        """Damping after an accepted step."""

    def failure(self, state: DampingState) -> DampingState | None:
        """Damping after a refused step; None to give up."""


def gain_factor(gain: float) -> float:
    """Factor on lambda after a success: 1/3 for a gain of 1 and more, 1 for one half, 2 for none.

    Implements :eq:`eq-nielsen`.

    Examples
    --------
    >>> gain_factor(1.0), gain_factor(0.5), gain_factor(0.0)
    (0.3333333333333333, 1.0, 2.0)
    """
    return max(1.0 / 3.0, 1.0 - (2.0 * min(gain, 1.0) - 1.0) ** 3)


class _Gradual:
    """Nielsen's change of lambda after a success and after failures, between two bounds."""

    downhill_only = True
    least, most = 0.0, 1e100

    def success(self, state: DampingState, gain: float) -> DampingState:
        """Shrink by the gain."""
        return DampingState(max(state.value * gain_factor(gain), self.least), 2.0)

    def failure(self, state: DampingState) -> DampingState | None:
        """Grow by 2, 4, 8 …; give up where every step has become nothing."""
        grown = DampingState(state.value * state.growth, 2.0 * state.growth)
        return grown if grown.value <= self.most else None


@dataclass(frozen=True)
class Nielsen(_Gradual):
    """Nielsen's rule.

    Parameters
    ----------
    tau : float
        First damping relative to the problem, > 0; small when the start is trusted.
    scaling : {"largest", "columns", "none"}
        D from the lengths of the columns of J: the largest that each has had (Moré), those of now
        (Marquardt); or the identity (Levenberg).
    """

    tau: float = 1e-3
    scaling: Scaling = "largest"

    def scale(self, lengths: Array, before: Array | None) -> Array:
        """Column lengths or ones."""
        if self.scaling == "none":
            return np.ones(len(lengths))
        return lengths if before is None or self.scaling == "columns" else np.maximum(lengths, before)

    def first(self, stiffness: float) -> DampingState:
        """Tau times the largest scaled diagonal entry of J^T J."""
        return DampingState(self.tau * stiffness, 2.0)


@dataclass(frozen=True)
class Ceres(_Gradual):
    """Trust region as in Ceres: radius = 1/lambda, 1e-32 to 1e16, in a metric of the columns.

    Parameters
    ----------
    radius : float
        First radius, > 0.
    """

    radius: float = 1e4
    least, most = 1e-16, 1e32

    def scale(self, lengths: Array, before: Array | None) -> Array:
        """Column lengths, clipped as the roots of Ceres' 1e-6 and 1e32."""
        return np.clip(lengths, 1e-3, 1e16)

    def first(self, stiffness: float) -> DampingState:
        """One over the first radius."""
        return DampingState(1.0 / self.radius, 2.0)


@dataclass(frozen=True)
class Undamped:
    """Gauss-Newton: lambda is 0, every step is taken, uphill too."""

    downhill_only = False

    def scale(self, lengths: Array, before: Array | None) -> Array:
        """Column lengths; without damping they change rounding only."""
        return lengths

    def first(self, stiffness: float) -> DampingState:
        """Zero."""
        return DampingState(0.0, 2.0)

    def success(self, state: DampingState, gain: float) -> DampingState:
        """Zero again."""
        return state

    def failure(self, state: DampingState) -> DampingState | None:
        """There is no shorter step to try."""
        return None
