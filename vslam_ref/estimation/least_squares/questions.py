"""What the loop asks of a problem, and what the problem answers."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Protocol, TypeVar

from vslam_ref.arrays import Array


class Step(NamedTuple):
    """A damped step.

    Attributes
    ----------
    change : object
        What ``move`` needs.
    length : float
        In the metric D.
    promised : float
        Decrease of the cost in the linear model, with the damping's share.
    share : float
        Length over that of the unknowns; infinite where no such end is wanted.
    """

    change: Any
    length: float
    promised: float
    share: float = math.inf


class LinearModel(Protocol):
    """A problem at one place; its numbers may be computed when they are first asked for."""

    @property
    def costs(self) -> Array:
        """Cost of each measurement, (m,)."""

    @property
    def gradient_norm(self) -> float:
        """Largest cosine between a column of the Jacobian and the residual, in [0, 1]."""

    @property
    def stiffness(self) -> float:
        """Square of the longest column in the metric D: a damping below it is light."""


Place = TypeVar("Place")
Here = TypeVar("Here", bound=LinearModel)


class Questions(Protocol[Place, Here]):
    """The four questions.  An answer of None refuses: no finite numbers, a singular system, no such place."""

    def linearise(self, place: Place, before: Here | None) -> Here | None:
        """Costs, gradient, and what the next step needs; ``before`` is the problem one step earlier."""

    def step(self, here: Here, damping: float) -> Step | None:
        """Minimum of the linear model with a price of damping/2 times the squared length."""

    def move(self, here: Here, step: Step) -> Place | None:
        """Return the place to which a step leads."""

    def costs(self, place: Place) -> Array:
        """Cost of each measurement at a place, (m,), finite or not."""
