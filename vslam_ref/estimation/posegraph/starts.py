r"""Where to begin: poses from the edges alone.

*Odometry*: go from node to node along a tree that prefers edges between neighbours in time; every error on
the way adds up.  *Chordal*: forget for a while that rotations are rotations, and

1. find matrices with R_j = R_i R_ij for all edges at once, the least sum of
   :math:`\kappa\,\lVert R_i R_{ij} - R_j\rVert^2`: a linear problem with one answer;
2. take the nearest rotation to each;
3. (Sim(3): the scales, log s_j = log s_i + log s_ij, are linear, too);
4. with rotations and scales known, t_j = t_i + s_i R_i t_ij is linear as well.

The loops have their say in each step, so that errors do not add up.  Weights are the means of the diagonal of
Omega: kappa of its rotations, another of its translations.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array, IntArray, times
from vslam_ref.estimation.posegraph.fronts import factorised
from vslam_ref.estimation.posegraph.graph import PoseGraph, parts
from vslam_ref.estimation.posegraph.pattern import Ordering, make_pattern
from vslam_ref.estimation.posegraph.spaces import (
    GROUPS,
    element_shape,
    joined,
    rotations,
    scales,
    translations,
)
from vslam_ref.geometry import so2, so3


def odometry_start(graph: PoseGraph) -> Array:
    """Poses by composing the edges along a tree from the fixed nodes, shape of ``graph.T_world``.

    Returns
    -------
    ndarray
        Fixed nodes stay.  The tree takes edges between neighbours in time first, then others, each in the
        order of the graph.

    Examples
    --------
    >>> square = np.array([[1.0, 0.0, np.pi / 2]] * 4)
    >>> one = np.array([np.eye(3)] * 4)
    >>> graph = PoseGraph("se2", np.zeros((4, 3)), [0, 1, 2, 3], [1, 2, 3, 0], square, one)
    >>> odometry_start(graph)[3].round(6).tolist()
    [0.0, 1.0, -1.570796]
    """
    group = GROUPS[graph.space]
    parent, step = _tree(graph)
    while True:  # each pass doubles the length of the way that a node knows
        grand = parent[parent]
        if (grand == parent).all():
            return np.asarray(group.compose(graph.T_world[parent], step))
        step = group.compose(step[parent], step)
        parent = grand


def _tree(graph: PoseGraph) -> tuple[IntArray, Array]:
    """Parent of each node (its own, for roots), and T_parent_node."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

    n, m = graph.sizes
    cost = np.empty(m)  # one for each edge, none twice: the tree is the same everywhere
    cost[np.argsort(graph.loops, kind="stable")] = np.arange(1.0, m + 1.0)
    low, high = np.minimum(graph.tail, graph.head), np.maximum(graph.tail, graph.head)
    order = np.lexsort((cost, high, low))
    pair = low[order] * n + high[order]
    first = order[np.append(True, np.diff(pair) != 0)] if m else order  # of parallel edges the cheapest
    # a node n stands for the world, and holds every fixed node at no cost
    held = np.flatnonzero(graph.fixed)
    rows, columns = np.append(low[first], held), np.append(high[first], np.full(len(held), n))
    values = np.append(cost[first] + 1.0, np.linspace(0.5, 1.0, len(held)))
    tree = minimum_spanning_tree(csr_array((values, (rows, columns)), shape=(n + 1, n + 1)))
    _, before = breadth_first_order(tree, n, directed=False)
    parent = before[:n].astype(np.int64)
    rank = {(int(low[k]), int(high[k])): int(k) for k in first}
    child = np.flatnonzero(parent < n)
    edge = np.array(
        [rank[min(c, p), max(c, p)] for c, p in zip(child.tolist(), parent[child].tolist(), strict=True)],
        dtype=np.int64,
    )
    group = GROUPS[graph.space]
    step = group.identity((n,))
    forth = graph.head[edge] == child
    measured = graph.measured[edge]
    turned = forth.reshape(-1, *[1] * len(element_shape(graph.space)))
    step[child] = np.where(turned, measured, group.inverse(measured))
    parent[held] = held
    return parent, step


def chordal_start(graph: PoseGraph) -> Array:
    """Poses by the chordal relaxation, shape of ``graph.T_world``; fixed nodes stay.

    Implements :eq:`eq-chordal-rotations` and :eq:`eq-chordal-positions`.

    Examples
    --------
    >>> square = np.array([[1.0, 0.0, np.pi / 2]] * 4)
    >>> one = np.array([np.eye(3)] * 4)
    >>> graph = PoseGraph("se2", np.zeros((4, 3)), [0, 1, 2, 3], [1, 2, 3, 0], square, one)
    >>> np.abs(chordal_start(graph)[2]).round(6).tolist()
    [1.0, 1.0, 3.141593]
    """
    space, T, fixed = graph.space, graph.T_world, graph.fixed
    k = 2 if space == "se2" else 3
    diagonal = np.diagonal(graph.information, axis1=1, axis2=2)
    R, one = rotations(space, graph.measured), np.eye(k)
    kappa = diagonal[:, k : (3 if space == "se2" else 6)].mean(-1)
    # R_i R_ij - R_j = 0, transposed: the columns of R_i^T are unknowns, one right-hand side each
    columns = 1 if space == "se2" else 3  # in the plane the second row follows from the first
    known = np.swapaxes(rotations(space, T), 1, 2)[..., :columns] * fixed[:, None, None]
    zero = np.zeros((len(R), k, columns))
    rows, order = _linear(graph, np.swapaxes(R, 1, 2), -one, zero, known, kappa, None)
    R_world = _nearest(np.swapaxes(rows, 1, 2), space)
    R_world[fixed] = rotations(space, T)[fixed]
    unit = np.ones((len(R), 1, 1))
    s_world = scales(space, T)
    if space == "sim3":
        change = -np.log(scales(space, graph.measured))[:, None, None]
        known = np.log(s_world)[:, None, None] * fixed[:, None, None]
        logs, order = _linear(graph, unit, -np.ones((1, 1)), change, known, diagonal[:, 6], order)
        s_world = np.where(fixed, s_world, np.exp(np.clip(logs[:, 0, 0], -50.0, 50.0)))
    way = times(R_world[graph.tail], translations(space, graph.measured)) * s_world[graph.tail, None]
    known = translations(space, T)[:, None, :] * fixed[:, None, None]
    weight = diagonal[:, :k].mean(-1)
    t, _ = _linear(graph, unit, -np.ones((1, 1)), -way[:, None, :], known, weight, order)
    start = joined(space, R_world, t[:, 0], s_world)
    return np.where(fixed.reshape(-1, *[1] * (start.ndim - 1)), T, start)


def _linear(
    graph: PoseGraph,
    A: Array,
    B: Array,
    target: Array,
    known: Array,
    weight: Array,
    ordering: Ordering | None,
) -> tuple[Array, Ordering]:
    """Least squares of A y_i + B y_j = target over all edges.

    ``known (n, k, s)`` are the values of fixed nodes and zero elsewhere; A, B are (m, k, k) or (k, k).
    """
    n, m = graph.sizes
    k = known.shape[1]
    pattern = make_pattern(n, graph.tail, graph.head, graph.fixed, k, ordering)
    root = np.sqrt(weight)[:, None, None]
    A, B = (root * np.broadcast_to(J, (m, k, k)) for J in (A, B))
    r = A @ known[graph.tail] + B @ known[graph.head] - root * target
    gradient = pattern.gradient(A, B, r, graph.tail, graph.head).reshape(pattern.size, -1)
    y = known.copy()
    if pattern.size:
        factor = factorised(pattern.matrix(A, B))
        if factor is None:
            raise ValueError("the chordal start does not exist: its system is singular")
        y[pattern.free] = -factor.solve(gradient).reshape(len(pattern.free), k, -1)
    return y, pattern.ordering


def _nearest(M: Array, space: str) -> Array:
    """Nearest rotations to matrices (n, 1, 2) or (n, 3, 3); the identity where none is nearest."""
    if space == "se2":
        # the row (cos, -sin) alone: its direction
        return so2.exp(np.arctan2(-M[:, 0, 1], M[:, 0, 0]))
    U, S, Vt = np.linalg.svd(M)
    sign = np.sign(np.linalg.det(U) * np.linalg.det(Vt))
    lost = (S[:, 1] + sign * S[:, 2] <= 1e-12 * S[:, 0]) | (sign == 0)
    R = M.copy()
    R[lost] = so3.identity()
    R[~lost] = so3.nearest(M[~lost])
    return R


def disconnected_parts(graph: PoseGraph) -> int:
    """Number of connected parts."""
    return int(parts(graph.sizes[0], graph.tail, graph.head).max(initial=-1)) + 1
