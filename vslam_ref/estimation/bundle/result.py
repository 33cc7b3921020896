"""What bundle adjustment returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation import least_squares
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.least_squares import Iteration
from vslam_ref.estimation.least_squares.result import CONVERGED

Reason = least_squares.Reason | Literal["no_observations", "no_images", "all_outliers", "nothing_free"]


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
