"""A pose graph, descended; then judged, and solved again without the edges that were found to be false.

One iteration, in this order:

1. ``errors``: what every edge says against the poses, and its Jacobians;
2. ``pattern``, ``system``: add up the blocks of the edges that matter, damp, factor in the chosen order;
3. ``system``: X <- X Exp(delta); errors there;
4. :mod:`~vslam_ref.estimation.least_squares.descend`: the gain decides whether to go there, and the damping.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation import least_squares
from vslam_ref.estimation.least_squares import Descent, Iteration, descend
from vslam_ref.estimation.least_squares.result import CONVERGED
from vslam_ref.estimation.posegraph.errors import Convention
from vslam_ref.estimation.posegraph.graph import PoseGraph, parts
from vslam_ref.estimation.posegraph.switching import LIKELY, EdgeLoss, edge_loss
from vslam_ref.estimation.posegraph.system import NEGLIGIBLE, GraphModel, GraphProblem

ROUNDING = 1e-13
"""A promise below this share of the cost cannot be seen in it."""

ROUGH = 1e-8
"""Where a loss only has to tell which edges are false, a descent may end at this change of the cost."""
WIDER = 4
"""How often a loss is made wider, at most."""

Progress = Callable[[Iteration], None]


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
    """Result of :func:`solve_graph`.

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


def solve_graph(
    graph: PoseGraph,
    loss: EdgeLoss | str = "l2",
    *,
    judged: BoolArray | None = None,
    convention: Convention = "log",
    options: Options | None = None,
    progress: Progress | None = None,
) -> GraphSolution:
    r"""Minimise :math:`\chi^2 = \sum e^\top \Omega e` of a pose graph, or the sum of a robust loss.

    Implements :eq:`eq-graph-chi2`.

    Parameters
    ----------
    graph : PoseGraph
        With poses to start from.
    loss : EdgeLoss or str
        A name of :data:`~vslam_ref.estimation.posegraph.switching.NAMES`, or a loss.
    judged : ndarray of bool, shape (m,), optional
        Edges that the loss is for: by default the loops.
    convention : {"log", "g2o"}
        Which error; see :mod:`~vslam_ref.estimation.posegraph.errors`.
    options : Options, optional
    progress : callable, optional
        Called with every step that was tried.

    Returns
    -------
    GraphSolution
        Never with a NaN in it.  With a loss that tells false edges, these are taken out in the end and the
        others solved by least squares once more: a loss bends the minimum, if only a little.  Where the kept
        edges show that the covariances are right (:func:`honest_limit`), a loss with its usual constant is
        widened, and all edges are judged again.

    Notes
    -----
    Cost of an iteration: O(m d^3) for the blocks, and the factor, which the loops decide: for a chain with
    few loops O(n d^3).  Memory: about 3 m d^2 numbers, and the factor.

    Examples
    --------
    >>> square = np.array([[1.0, 0.0, np.pi / 2]] * 4)
    >>> start = np.array([[0.0, 0, 0], [1.1, 0, 1.5], [1, 1, 3], [0, 1, -1.5]])
    >>> graph = PoseGraph("se2", start, [0, 1, 2, 3], [1, 2, 3, 0], square, np.array([np.eye(3)] * 4))
    >>> found = solve_graph(graph)
    >>> found.converged, bool(found.chi2 < 1e-20), np.abs(found.graph.T_world[2, :2]).round(6).tolist()
    (True, True, [1.0, 1.0])
    """
    options = options or Options()
    rule = edge_loss(loss, graph.space, options.constant or None) if isinstance(loss, str) else loss
    judged = graph.loops if judged is None else judged
    problem = GraphProblem(graph, convention, rule.loss, judged, options.negligible)
    first = problem.at(graph.T_world)
    begin = problem.linearise(first)
    if begin is None:
        return _unsolved(graph, first.squares, "not_finite", "the cost is not finite at the start")
    if graph.fixed.all():
        return _unsolved(graph, first.squares, "nothing_free", "no node may move")
    found = _judged(_unsolved(graph, first.squares, "", ""), problem, rule, options, progress)
    if not rule.limit:
        return found
    found = _least_squares(found, convention, options, progress)
    for _ in range(WIDER if rule.usual else 0):
        limit = honest_limit(found)
        if limit <= 1.1 * rule.limit:
            break
        rule = rule.widened(limit)
        problem = GraphProblem(graph, convention, rule.loss, judged, options.negligible)
        found = _judged(found, problem, rule, options, progress)
        found = _least_squares(found, convention, options, progress)
    return found


def _judged(
    before: GraphSolution,
    problem: GraphProblem,
    rule: EdgeLoss,
    options: Options,
    progress: Progress | None,
) -> GraphSolution:
    """Descend from where it stands, and tell which edges are false."""
    begin = problem.linearise(problem.at(before.graph.T_world))
    if begin is None:
        return before
    rough = replace(options, cost=max(options.cost, ROUGH)) if rule.limit else options
    end = _descended(problem, begin, rough, progress)
    place, weights = end.here.place, end.here.weights
    return replace(
        before,
        graph=before.graph.at(place.T_world),
        squares=place.squares,
        weights=weights,
        rejected=problem.judged & (place.squares > rule.limit) if rule.limit else before.rejected,
        reason=end.reason,
        message=end.message,
        history=before.history + end.history,
    )


def _descended(
    problem: GraphProblem, begin: GraphModel, options: Options, progress: Progress | None
) -> Descent[GraphModel]:
    told: Progress = (lambda row: None) if progress is None else progress
    return descend(problem, begin, options.descent(), floor=problem.floor, progress=told)


def honest_limit(found: GraphSolution) -> float:
    """Return the chi² that one honest edge in 1000 exceeds, by what the kept edges show.

    Implements :eq:`eq-honest-limit`.

    A switch gives up an edge at c = 4, which one honest edge of four exceeds in the plane if its covariance
    is right, and hardly any if it is pessimistic, as most are.  Which of both the kept edges tell: chi² per
    degree of freedom, at most 1, scales the limit.
    """
    graph, kept = found.graph, ~found.rejected
    free = int((~graph.fixed).sum())
    freedom = graph.information.shape[-1] * (int(kept.sum()) - free)
    share = float(found.squares[kept].sum()) / freedom if freedom > 0 else 0.0
    return LIKELY[graph.space] * min(share, 1.0)


def _least_squares(
    before: GraphSolution, convention: Convention, options: Options, progress: Progress | None
) -> GraphSolution:
    """Solve the edges that are not rejected; a part that nothing holds any more stays where it is."""
    kept, graph = ~before.rejected, before.graph
    n, _ = graph.sizes
    part = parts(n, graph.tail[kept], graph.head[kept])
    loose = ~np.isin(part, part[graph.fixed])
    hold = np.zeros(n, dtype=np.bool_)
    hold[[np.flatnonzero(part == one)[0] for one in np.unique(part[loose])]] = True
    reduced = replace(graph, fixed=graph.fixed | hold).only(kept)
    problem = GraphProblem(reduced, convention)
    begin = problem.linearise(problem.at(graph.T_world))
    if begin is None or reduced.fixed.all():
        return before
    end = _descended(problem, begin, options, progress)
    T_world = end.here.place.T_world
    return replace(
        before,
        graph=graph.at(T_world),
        squares=GraphProblem(graph, convention).at(T_world).squares,
        reason=end.reason,
        message=end.message,
        history=before.history + end.history,
        loosened=int(hold.sum()),
    )


def _unsolved(graph: PoseGraph, squares: Array, reason: str, message: str) -> GraphSolution:
    """The start, from which nothing was computed."""
    none = np.zeros(len(squares), dtype=np.bool_)
    return GraphSolution(graph, squares, squares, np.ones(len(squares)), none, reason, message, ())
