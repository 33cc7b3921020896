r"""Covariances of chosen poses: blocks of the inverse of the normal matrix at a solution.

A covariance is that of the step delta in X Exp(delta), in the body's own frame: (translation, rotation,
log-scale), given the fixed nodes, which have none.  The inverse of the whole matrix is dense and is never
made: one factor, and d right-hand sides for each node that is asked for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.posegraph.errors import Convention
from vslam_ref.estimation.posegraph.fronts import factorised
from vslam_ref.estimation.posegraph.graph import PoseGraph
from vslam_ref.estimation.posegraph.spaces import tangent_size
from vslam_ref.estimation.posegraph.system import GraphModel, GraphProblem

BATCH = 64
"""Nodes that are solved for at a time."""


def marginal_covariances(graph: PoseGraph, nodes: ArrayLike, *, convention: Convention = "log") -> Array:
    """Covariance of each of some nodes, all others unknown too.

    Implements :eq:`eq-graph-marginal`.

    Parameters
    ----------
    graph : PoseGraph
        At its solution.
    nodes : array_like of int, shape (q,)
    convention : {"log", "g2o"}

    Returns
    -------
    ndarray, shape (q, d, d)
        Of the step on the right; zero for fixed nodes.  To first order, with Omega taken at its word.

    Raises
    ------
    ValueError
        If a node does not exist, or the matrix is singular.

    Examples
    --------
    >>> still, sure = np.zeros((2, 3)), 4.0 * np.array([np.eye(3)] * 2)
    >>> graph = PoseGraph("se2", np.zeros((3, 3)), [0, 1], [1, 2], still, sure)
    >>> np.diagonal(marginal_covariances(graph, [0, 1, 2]), axis1=1, axis2=2).tolist()
    [[0.0, 0.0, 0.0], [0.25, 0.25, 0.25], [0.5, 0.5, 0.5]]
    """
    wanted, (n, _) = np.asarray(nodes, dtype=np.int64), graph.sizes
    if wanted.ndim != 1 or ((wanted < 0) | (wanted >= n)).any():
        raise ValueError(f"nodes {wanted.tolist()}: need numbers from 0 to {n - 1}")
    d, problem = tangent_size(graph.space), GraphProblem(graph, convention)
    model = GraphModel(problem, problem.at(graph.T_world))
    factor, place = factorised(model.matrix), model.pattern.place[wanted]
    if factor is None:
        raise ValueError("the normal matrix is singular: these poses are not determined")
    found = np.zeros((len(wanted), d, d))
    free = np.flatnonzero(place >= 0)
    for some in np.array_split(free, max(1, -(-len(free) // BATCH))):
        rows = (place[some][:, None] * d + np.arange(d)).reshape(-1)
        unit = np.zeros((model.pattern.size, len(rows)))
        unit[rows, np.arange(len(rows))] = 1.0
        inverse = factor.solve(unit)[rows].reshape(len(some), d, len(some), d)
        own = np.arange(len(some))
        block = inverse[own, :, own, :]
        found[some] = 0.5 * (block + np.swapaxes(block, 1, 2))
    return found
