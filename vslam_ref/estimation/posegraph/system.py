"""What a descent asks of a pose graph: errors at a place, normal equations, a step, and where it leads.

Errors are whitened first, r = U e with U^T U = Omega, so that they are in standard deviations; a loss then
judges the length of r.  Edges whose weight has become negligible still pull (the gradient has all edges), but
have no part in the matrix: a false loop would fill the factor and change nothing in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, times
from vslam_ref.estimation.least_squares import Step
from vslam_ref.estimation.posegraph.errors import Convention, edge_error, edge_error_with_jacobians
from vslam_ref.estimation.posegraph.fronts import solve_in_order
from vslam_ref.estimation.posegraph.graph import PoseGraph, parts
from vslam_ref.estimation.posegraph.pattern import Pattern, make_pattern
from vslam_ref.estimation.posegraph.spaces import moved, tangent_size, translations
from vslam_ref.estimation.robust import L2, Loss

if TYPE_CHECKING:
    from scipy.sparse import csc_array

DAMPED = (1e-6, 1e32)
"""Bounds of the squared column lengths that the damping multiplies."""
NEGLIGIBLE = 1e-4
"""Weight below which an edge has no part in the matrix."""
EPS = float(np.finfo(np.float64).eps)


class GraphPlace(NamedTuple):
    """Poses ``T_world (n, ...)``, the whitened errors ``r (m, d)`` there (in sigmas), and what they cost.

    ``squares (m,)`` is the chi² of each edge, ``costs (m,)`` what the loss makes of it.
    """

    T_world: Array
    r: Array
    squares: Array
    costs: Array


@dataclass
class GraphModel:
    """The graph at a place; its normal equations (in sigmas) are added up when they are first needed."""

    problem: GraphProblem
    place: GraphPlace
    stiffness: float = 1.0

    @property
    def costs(self) -> Array:
        """Cost of each edge, (m,)."""
        return self.place.costs

    @cached_property
    def weights(self) -> Array:
        """Weight of each edge, (m,)."""
        return self.problem.weights(self.place)

    @cached_property
    def slopes(self) -> tuple[Array, Array]:
        """Whitened Jacobians of all edges, (m, d, d) in the tail and in the head."""
        return self.problem.slopes(self.place.T_world)

    @cached_property
    def layout(self) -> tuple[Pattern, BoolArray]:
        """Pattern of the edges that matter here, and which these are, (m,)."""
        return self.problem.layout(self.weights)

    @property
    def pattern(self) -> Pattern:
        """Pattern of the edges that matter here."""
        return self.layout[0]

    @cached_property
    def gradient(self) -> Array:
        """J^T W r of all edges, (k d,)."""
        graph, (A, B) = self.problem.graph, self.slopes
        pull = self.weights[:, None] * self.place.r
        return self.pattern.gradient(A, B, pull, graph.tail, graph.head)

    @cached_property
    def matrix(self) -> csc_array:
        """J^T W J of the edges that matter, (k d, k d), in the order of elimination."""
        pattern, keep = self.layout
        root = np.sqrt(self.weights[keep])[:, None, None]
        A, B = (root * J[keep] for J in self.slopes)
        return pattern.matrix(A, B)

    @cached_property
    def diagonal(self) -> Array:
        """Diagonal of the matrix, (k d,)."""
        found: Array = self.matrix.data[self.pattern.diagonal]
        return found

    @cached_property
    def gradient_norm(self) -> float:
        """Largest cosine between a column of the Jacobian and the error."""
        length = math.sqrt(float(self.weights @ self.place.squares))
        if length == 0.0 or not len(self.gradient):
            return 0.0
        columns = np.sqrt(np.where(self.diagonal > 0, self.diagonal, 1.0))
        return float((np.abs(self.gradient) / columns).max()) / length


@dataclass
class GraphProblem:
    """One graph as it is solved.

    Parameters
    ----------
    graph : PoseGraph
    convention : {"log", "g2o"}
    loss : Loss
        Of the length of a whitened error.
    judged : ndarray of bool, shape (m,)
        Edges that the loss is for; all others are squared.
    negligible : float
        Weight, a share, below which an edge is left out of the matrix.
    """

    graph: PoseGraph
    convention: Convention = "log"
    loss: Loss = field(default_factory=L2)
    judged: BoolArray = None  # type: ignore[assignment]
    negligible: float = NEGLIGIBLE

    def __post_init__(self) -> None:
        given: object = self.judged
        m = self.graph.sizes[1]
        self.judged = np.ones(m, dtype=np.bool_) if given is None else np.asarray(self.judged, dtype=np.bool_)
        self.roots = np.swapaxes(np.linalg.cholesky(self.graph.information), -1, -2)
        self._layout: tuple[Pattern, BoolArray] | None = None

    @property
    def floor(self) -> float:
        """Cost of errors that are nothing but the rounding of the poses."""
        size = float(np.abs(translations(self.graph.space, self.graph.T_world)).max(initial=1.0))
        trace = float(np.trace(self.graph.information, axis1=1, axis2=2).sum())
        return 0.5 * trace * (8.0 * EPS * max(size, 1.0)) ** 2

    def at(self, T_world: Array) -> GraphPlace:
        """Evaluate poses."""
        graph = self.graph
        with np.errstate(all="ignore"):
            e = edge_error(
                T_world[graph.tail],
                T_world[graph.head],
                graph.measured,
                space=graph.space,
                convention=self.convention,
            )
            r = times(self.roots, e)
            squares = np.einsum("mi,mi->m", r, r)
            costs = np.where(self.judged, self.loss.cost(np.sqrt(squares)), 0.5 * squares)
        return GraphPlace(T_world, r, squares, costs)

    def weights(self, place: GraphPlace) -> Array:
        """Weight of each edge, (m,)."""
        return np.where(self.judged, self.loss.weight(np.sqrt(place.squares)), 1.0)

    def slopes(self, T_world: Array) -> tuple[Array, Array]:
        """Whitened Jacobians, (m, d, d) in the tail and in the head."""
        graph = self.graph
        found = edge_error_with_jacobians(
            T_world[graph.tail],
            T_world[graph.head],
            graph.measured,
            space=graph.space,
            convention=self.convention,
        )
        return self.roots @ found.J_tail, self.roots @ found.J_head

    def layout(self, weights: Array) -> tuple[Pattern, BoolArray]:
        """Pattern of the edges with a weight that matters, and which these are: the last one if it fits."""
        graph, matters = self.graph, weights >= self.negligible
        n, _ = graph.sizes
        if not matters.all() and self._count(matters) != self._count(matters | True):
            matters = np.ones_like(matters)  # an edge that holds the graph together always matters
        if self._layout is None or (matters != self._layout[1]).any():
            d = tangent_size(graph.space)
            found = make_pattern(n, graph.tail[matters], graph.head[matters], graph.fixed, d)
            self._layout = found, matters
        return self._layout

    def _count(self, some: BoolArray) -> int:
        """Parts of the graph with some of its edges, less 1."""
        graph = self.graph
        return int(parts(graph.sizes[0], graph.tail[some], graph.head[some]).max(initial=-1))

    def linearise(self, place: GraphPlace, before: GraphModel | None = None) -> GraphModel | None:
        """Take a place; None where an error is not finite."""
        return GraphModel(self, place) if np.isfinite(place.squares).all() else None

    def step(self, here: GraphModel, damping: float) -> Step | None:
        """Damped step on the right of every pose; None where the system is singular."""
        diagonal = here.diagonal
        metric = np.where(diagonal > 0, np.clip(diagonal, *DAMPED), 1.0)
        matrix, damped = here.matrix, here.matrix.data.copy()
        damped[here.pattern.diagonal] += damping * metric
        fronts = here.pattern.ordering.fronts
        step = -solve_in_order(damped, matrix.indices, matrix.indptr, fronts, here.gradient)
        square, slope = float(metric @ step**2), float(here.gradient @ step)
        if not (np.isfinite(step).all() and slope <= 0.0):
            return None
        change = here.pattern.of_nodes(step, self.graph.sizes[0])
        return Step(change, math.sqrt(square), 0.5 * (damping * square - slope))

    def move(self, here: GraphModel, step: Step) -> GraphPlace:
        """Where a step leads: X Exp(delta)."""
        return self.at(moved(self.graph.space, here.place.T_world, step.change))

    def costs(self, place: GraphPlace) -> Array:
        """Cost of each edge, (m,)."""
        return place.costs
