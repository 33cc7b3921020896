"""What bundle adjustment returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.bundle.problem import BundleProblem

Reason = Literal[
    "cost",
    "gradient",
    "max_iterations",
    "stalled",
    "no_observations",
    "no_images",
    "all_outliers",
    "nothing_free",
    "not_finite",
]
CONVERGED: tuple[Reason, ...] = ("cost", "gradient")


class Iteration(NamedTuple):
    """One step that was tried.

    Attributes
    ----------
    cost : float
        After the step, at the scale ``sigma``; that before it where it was refused.
    decrease : float
        Of the cost, at that scale; what was refused is negative or NaN.
    gradient_norm : float
        Largest cosine between a column of the Jacobian and the residuals before the step, in [0, 1].
    step_norm : float
        Length of the step in the metric of the damping: to first order, pixels by which residuals change.
    damping : float
    gain : float
        Decrease over the promised one.
    accepted : bool
    sigma : float
    """

    cost: float
    decrease: float
    gradient_norm: float
    step_norm: float
    damping: float
    gain: float
    accepted: bool
    sigma: float


@dataclass(frozen=True)
class BundleResult:
    """Result of :func:`~vslam_ref.estimation.bundle.solver.bundle_adjust`; arrays in the problem's order.

    Attributes
    ----------
    problem : BundleProblem
        The problem at the scene that was found.
    initial_cost, cost : float
        Sum of rho, half the sum of squares without a loss; each at its own scale if that is adaptive.
    residual : ndarray, shape (n, 2)
        Predicted minus measured, pixels; zero where there is no image.
    valid : ndarray of bool, shape (n,)
        Whether the point is in front of its camera.
    weights : ndarray, shape (n,)
        Of the loss; 0 for what was set aside.
    aside : ndarray of bool, shape (n,)
        Observations that had no image at the start and were left out, because the loss has no bound.
    sigma : float
        Scale of the errors.
    reason, message : str
        Why it ended, in a word and in a sentence.
    iterations : int
        Steps tried.
    history : tuple of Iteration
    """

    problem: BundleProblem
    initial_cost: float
    cost: float
    residual: Array
    valid: BoolArray
    weights: Array
    aside: BoolArray
    sigma: float
    reason: Reason
    message: str
    iterations: int
    history: tuple[Iteration, ...]

    @property
    def converged(self) -> bool:
        """Whether a rule for a minimum ended it."""
        return self.reason in CONVERGED

    @property
    def rmse_px(self) -> float:
        """Root of the mean squared length of all valid residuals, pixels; NaN without any."""
        squares = np.einsum("ni,ni->n", self.residual, self.residual)[self.valid]
        return float(np.sqrt(squares.mean())) if len(squares) else float("nan")
