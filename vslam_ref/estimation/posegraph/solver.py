"""A pose graph, descended; then judged, and solved again without the edges that were found to be false.

One iteration, in this order:

1. ``errors``: what every edge says against the poses, and its Jacobians;
2. ``pattern``, ``system``: add up the blocks of the edges that matter, damp, factor in the chosen order;
3. ``system``: X <- X Exp(delta); errors there;
4. :mod:`~vslam_ref.estimation.least_squares.descend`: the gain decides whether to go there, and the damping.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.least_squares import Descent, Iteration, descend
from vslam_ref.estimation.posegraph.errors import Convention
from vslam_ref.estimation.posegraph.graph import PoseGraph, parts
from vslam_ref.estimation.posegraph.solution import GraphSolution, Options
from vslam_ref.estimation.posegraph.switching import LIKELY, EdgeLoss, edge_loss
from vslam_ref.estimation.posegraph.system import GraphModel, GraphProblem

ROUGH = 1e-8
"""Where a loss only has to tell which edges are false, a descent may end at this change of the cost."""
WIDER = 4
"""How often a loss is made wider, at most."""

Progress = Callable[[Iteration], None]


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
        Never with a NaN in it.  A loss that tells false edges has many minima: it descends from the start,
        and from where another such loss leads, and the lower end counts.  The false edges are then taken out,
        and the others solved by least squares once more: a loss bends the minimum, if only a little.  Where
        the kept edges show that the covariances are right (:func:`honest_limit`), a loss with its usual
        constant is widened, and all edges are judged again.

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
    start = _unsolved(graph, first.squares, "", "")
    found = _judged(start, problem, rule, options, progress)
    if not rule.limit:
        return found
    found = _lower(found, start, problem, rule, options, progress)
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


def _lower(
    found: GraphSolution,
    start: GraphSolution,
    problem: GraphProblem,
    rule: EdgeLoss,
    options: Options,
    progress: Progress | None,
) -> GraphSolution:
    """Descend once more, from where the rival of the loss leads; of both ends the one that costs less."""
    if rule.rival is None:
        return found
    scout = _judged(start, replace(problem, loss=rule.rival), rule, options, progress)
    other = _judged(scout, problem, rule, options, progress)
    one, two = (float(problem.at(end.graph.T_world).costs.sum()) for end in (found, other))
    better = other if two < (1.0 - ROUGH) * one else found
    return replace(better, history=found.history + other.history)


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
