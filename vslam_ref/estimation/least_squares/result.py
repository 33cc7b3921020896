"""What a minimisation returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from vslam_ref.arrays import Array
from vslam_ref.estimation.least_squares.linear import Covariance, covariance

Reason = Literal[
    "gradient", "step", "cost", "max_iterations", "stalled", "singular", "not_finite", "no_residuals"
]
End = tuple[Reason, str]
"""Why a descent ended, in a word and in a sentence."""
CONVERGED: tuple[Reason, ...] = ("gradient", "step", "cost")


class Iteration(NamedTuple):
    """One step that was tried.

    Attributes
    ----------
    cost : float
        After the step; the old cost where it was refused.
    decrease : float
        Of the cost; of a refused step what it would have been, negative or NaN; NaN below rounding, too.
    gradient_norm : float
        Largest cosine between a column of J and r *before* the step, in [0, 1].
    step_norm : float
        Length of the step in the metric D.
    damping : float
        lambda of this step.
    gain : float
        Actual over promised decrease; NaN where the trial had no finite cost or both are rounding.
    accepted : bool
    sigma : float
        Scale of the errors at which the step was judged, where a scale is found as the descent goes.
    """

    cost: float
    decrease: float
    gradient_norm: float
    step_norm: float
    damping: float
    gain: float
    accepted: bool
    sigma: float = 1.0


@dataclass(frozen=True)
class Solution:
    """Result of :func:`~vslam_ref.estimation.least_squares.solver.minimise`.

    Attributes
    ----------
    x : ndarray, shape (k,)
        The best point found, in its own units; the start where nothing better was.
    cost : float
        Sum of rho(r), half the sum of squares without a loss; the square of the residuals' unit.
    residual : ndarray, shape (m,)
        At ``x``, not weighted.
    jacobian : ndarray, shape (m, n)
        At ``x``, not weighted.
    weights : ndarray, shape (m,)
        Of the robust loss at ``x``; ones without.
    reason : str
        Why it ended: ``gradient``, ``step`` or ``cost`` (converged), ``max_iterations``, ``stalled``
        (no damping gave a decrease), ``singular`` (a step without damping does not exist), ``not_finite``
        (no finite residual or Jacobian to go on from), ``no_residuals``.
    message : str
        The reason in a sentence, with its numbers.
    iterations : int
        Steps tried.
    history : tuple of Iteration
    """

    x: Array
    cost: float
    residual: Array
    jacobian: Array
    weights: Array
    reason: Reason
    message: str
    iterations: int
    history: tuple[Iteration, ...]

    @property
    def converged(self) -> bool:
        """Whether a stopping rule for a minimum ended the iteration."""
        return self.reason in CONVERGED

    def covariance(self, sigma: float | None = None) -> Covariance:
        """Covariance of the parameters, from the weighted Jacobian.

        Parameters
        ----------
        sigma : float, optional
            Known standard deviation of one residual; otherwise from the (weighted) residuals.

        Returns
        -------
        Covariance
            To first order.  With a robust loss it treats the final weights as given, which is slightly
            too sure.
        """
        root = self.weights**0.5
        return covariance(self.jacobian * root[:, None], self.residual * root, sigma)
