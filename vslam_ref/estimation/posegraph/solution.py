"""What may be asked of a pose graph's descent, and what it answers."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation import least_squares
from vslam_ref.estimation.least_squares import Iteration
from vslam_ref.estimation.least_squares.result import CONVERGED
from vslam_ref.estimation.posegraph.graph import PoseGraph
from vslam_ref.estimation.posegraph.system import NEGLIGIBLE

ROUNDING = 1e-13
"""A promise below this share of the cost cannot be seen in it."""


@dataclass(frozen=True)
class Options:
    """When to end, where the damping starts, and what is left out.

    Parameters
    ----------
    cost : float
        End when promised and actual decrease of a step are both at most this share of the cost.
    gradient : float
        End when every column of the Jacobian is nearly at a right angle to the errors.
    max_iterations : int
        Steps tried at most, before and after false edges are taken out.
    damping : float
        First lambda; 0 is Gauss-Newton, which takes every step.
    negligible : float
        Weight below which an edge has no part in the matrix (in the gradient it has); 0 leaves none out.
    constant : float
        Of the loss, in standard deviations of an edge's error; 0 takes the usual one.
    """

    cost: float = 1e-10
    gradient: float = 1e-10
    max_iterations: int = 200
    damping: float = 1e-8
    negligible: float = NEGLIGIBLE
    constant: float = 0.0

    def __post_init__(self) -> None:
        if not (self.damping >= 0 and math.isfinite(self.damping)):
            raise ValueError(f"damping={self.damping}: need a number >= 0")
        if not 0 <= self.negligible < 0.25:
            raise ValueError(f"negligible={self.negligible}: need a weight in [0, 0.25)")
        if not (self.constant >= 0 and math.isfinite(self.constant)):
            raise ValueError(f"constant={self.constant}: need a number > 0, or 0 for the usual one")
        self.descent()  # refuses what means nothing

    def descent(self) -> least_squares.Options:
        """Thresholds and rule of the descent."""
        rule: least_squares.Damping = least_squares.Undamped()
        if self.damping > 0:
            rule = least_squares.Ceres(1.0 / self.damping)
        return least_squares.Options(
            gradient=self.gradient,
            step=0.0,
            cost=self.cost,
            max_iterations=self.max_iterations,
            damping=rule,
            least_gain=1e-3,
            rounding=ROUNDING,
        )


@dataclass(frozen=True)
class GraphSolution:
    """Result of :func:`~vslam_ref.estimation.posegraph.solver.solve_graph`.

    Attributes
    ----------
    graph : PoseGraph
        All nodes at their best poses, with the edges that were given.
    initial_squares, squares : ndarray, shape (m,)
        chi² of each edge at the start and at the end, e^T Omega e.
    weights : ndarray, shape (m,)
        What the loss gave each edge when the descent ended.
    rejected : ndarray of bool, shape (m,)
        Edges that the loss called false; the poses are those of the others.
    reason : str
        Why the last descent ended; see :class:`~vslam_ref.estimation.least_squares.result.Solution`.
    message : str
        The reason in a sentence.
    history : tuple of Iteration
        Of all descents.
    loosened : int
        Nodes that were held where they were, because without false edges nothing holds their part.
    """

    graph: PoseGraph
    initial_squares: Array
    squares: Array
    weights: Array
    rejected: BoolArray
    reason: str
    message: str
    history: tuple[Iteration, ...]
    loosened: int = 0

    @property
    def converged(self) -> bool:
        """Whether a rule for a minimum ended the last descent."""
        return self.reason in CONVERGED

    @property
    def initial_chi2(self) -> float:
        """chi² of all edges at the start."""
        return float(self.initial_squares.sum())

    @property
    def chi2(self) -> float:
        """chi² of the edges that were not rejected, at the end."""
        return float(self.squares[~self.rejected].sum())
