"""Chapter 13: errors of edges, one Gauss-Newton step, and the chordal start."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.estimation.posegraph import PoseGraph, chordal_start
from vslam_ref.estimation.posegraph.errors import Convention, edge_error_with_jacobians
from vslam_ref.estimation.posegraph.spaces import Space
from vslam_ref.estimation.posegraph.system import GraphProblem

Array = NDArray[Any]


def _edge(
    X_i: Array, X_j: Array, Z: Array, convention: Convention = "log", *, space: Space
) -> dict[str, Any]:
    found = edge_error_with_jacobians(X_i, X_j, Z, space=space, convention=convention)
    return {"e": found.e, "J_i": found.J_tail, "J_j": found.J_head}


def _step(
    X: Array, tail: Array, head: Array, Z: Array, information: Array, convention: Convention
) -> dict[str, Any]:
    graph = PoseGraph("se2", X, tail.astype(int), head.astype(int), Z, information)
    problem = GraphProblem(graph, convention)
    place = problem.at(X)
    model = problem.linearise(place)
    step = None if model is None else problem.step(model, 0.0)
    if step is None:
        raise ValueError("the system is singular")
    return {"step": step.change, "chi2": place.squares.sum()}


def _chordal(tail: Array, head: Array, Z: Array, kappa: Array, tau: Array) -> Array:
    sides = np.concatenate([np.repeat(tau[:, None], 3, 1), np.repeat(kappa[:, None], 3, 1)], 1)
    count = int(max(tail.max(), head.max())) + 1
    unit = np.tile(np.eye(4), (count, 1, 1))
    graph = PoseGraph("se3", unit, tail.astype(int), head.astype(int), Z, sides[:, :, None] * np.eye(6))
    return chordal_start(graph)


TABLE: Answers = {
    "posegraph.se2_edge": partial(_edge, space="se2"),
    "posegraph.se3_edge": partial(_edge, space="se3"),
    "posegraph.sim3_edge": partial(_edge, space="sim3"),
    "posegraph.step": _step,
    "posegraph.chordal_start": _chordal,
}
