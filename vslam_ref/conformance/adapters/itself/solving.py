"""Chapter 05: one step, and whole runs of the solver."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.estimation.least_squares import Options, minimise
from vslam_ref.estimation.least_squares.damping import DampingState, Nielsen, gain_factor
from vslam_ref.estimation.least_squares.linear import covariance, damped_step

Array = NDArray[Any]


def _step(J: Array, r: Array, damping: float = 0.0, scale: Array | None = None) -> Array:
    step = damped_step(J, r, damping, np.ones(J.shape[1]) if scale is None else scale)
    if step is None:
        raise ValueError("the system is singular")
    return step


@dataclass
class Listed:
    """Damping by a list, whatever the steps bring."""

    values: list[float]
    at: int = field(default=0)
    downhill_only: bool = True

    def scale(self, lengths: Array, before: Array | None) -> Array:
        """Ones."""
        return np.ones(len(lengths))

    def first(self, stiffness: float) -> DampingState:
        """The first of the list."""
        return DampingState(self.values[0], 1.0)

    def success(self, state: DampingState, gain: float) -> DampingState:
        """The next of the list."""
        self.at += 1
        return DampingState([*self.values, 0.0][self.at], 1.0)

    def failure(self, state: DampingState) -> DampingState:
        """The next of the list."""
        return self.success(state, 0.0)


class FromGiven(Nielsen):
    """Nielsen's rule from a lambda that is given, in the metric of the identity."""

    def scale(self, lengths: Array, before: Array | None) -> Array:
        """Ones."""
        return np.ones(len(lengths))

    def first(self, stiffness: float) -> DampingState:
        """The given one."""
        return DampingState(self.tau, 2.0)


def _nielsen_trace(y: Array, t: Array, start: Array, damping: float, count: int) -> list[dict[str, Any]]:
    """The history of one run."""
    options = Options(0.0, 0.0, 0.0, int(count), FromGiven(damping), least_gain=0.0)
    found = minimise(
        lambda b: b[0] * np.exp(-b[1] * t) - y, start, with_jacobian=_model(y, t), options=options
    )
    return [
        {"cost": row.cost, "gain": row.gain, "damping": row.damping, "taken": int(row.accepted)}
        for row in found.history
    ]


def _model(y: Array, t: Array) -> Any:
    """Residual and Jacobian of a decay."""
    return lambda b: (
        b[0] * np.exp(-b[1] * t) - y,
        np.stack([np.exp(-b[1] * t), -b[0] * t * np.exp(-b[1] * t)], 1),
    )


def _trace(y: Array, t: Array, start: Array, damping: Array) -> list[dict[str, Any]]:
    """The solver, ended after one step, two steps, and so on: what it has by then."""
    steps = []
    for count in range(1, len(damping) + 1):
        options = Options(0.0, 0.0, 0.0, count, Listed([float(v) for v in damping]))
        found = minimise(
            lambda b: b[0] * np.exp(-b[1] * t) - y,
            start,
            with_jacobian=_model(y, t),
            options=options,
        )
        steps.append({"b": found.x, "cost": found.cost, "taken": int(found.history[-1].accepted)})
    return steps


def _covariance(J: Array, r: Array) -> Array:
    found = covariance(J, r)
    if found.matrix is None:
        raise ValueError(found.reason)
    return found.matrix


TABLE: Answers = {
    "least_squares.gauss_newton_step": lambda J, r: _step(J, r),
    "least_squares.lm_step": _step,
    "least_squares.lm_trace": _trace,
    "least_squares.nielsen_trace": _nielsen_trace,
    "least_squares.covariance": _covariance,
    "least_squares.nielsen_factor": lambda gain: gain_factor(gain),
}
