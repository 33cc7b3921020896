"""Chapter 06: residual, cost, and the elimination of points, through the solver's own tables and kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.estimation.bundle.normal import Normal, normal_equations
from vslam_ref.estimation.bundle.problem import BundleProblem, Observations, Scene
from vslam_ref.estimation.bundle.projection import reprojection
from vslam_ref.estimation.bundle.schur import point_factor, point_steps, reduce
from vslam_ref.estimation.bundle.structure import Structure, structure
from vslam_ref.estimation.bundle.weights import Robust, weigh, whitened
from vslam_ref.geometry.cameras import MODELS, Pinhole

Array = NDArray[Any]


def _one_view(
    model: str, params: Array, pose: Array, X_world: Array, uv: Array, cov: Array | None = None
) -> BundleProblem:
    X, pixels = np.atleast_2d(X_world), np.atleast_2d(uv)
    seen = Observations(np.zeros(len(X), dtype=np.int64), np.arange(len(X)), pixels, cov)
    return BundleProblem(MODELS[model], Scene(pose[None], X, params[None]), seen)


def _residual(**inputs: Any) -> Array:
    found = reprojection(_one_view(**inputs))
    if not found.valid.all():
        raise ValueError("the point has no image")
    r: Array = found.r[0]
    return r


def _cost(**inputs: Any) -> float:
    problem = _one_view(**inputs)
    found = reprojection(problem)
    robust = Robust()
    errors = whitened(problem.seen.cov_uv, found.r)
    return weigh(robust, robust.sigma(errors, found.valid), errors, found.valid).cost


def _normal_equations(**inputs: Any) -> dict[str, Array]:
    problem = _one_view(**inputs)
    table = structure(problem)
    basis = problem.free.intrinsics
    found = normal_equations(problem.model, table.state(problem), table, np.ones(len(problem.seen)), basis)
    back = np.argsort(table.point_order)  # points, and with one view observations, in the problem's order
    W_T = np.swapaxes(found.W[back], 1, 2).reshape(-1, 6)
    g_point = found.g_point[back].ravel()
    return {"B": found.B[0], "W_T": W_T, "C": found.C[back], "g_view": found.g_view, "g_point": g_point}


def _table(views: int, points: int) -> Structure:
    """Tables of a problem in which every view sees every point."""
    view, point = (g.ravel() for g in np.meshgrid(np.arange(views), np.arange(points), indexing="ij"))
    X = np.zeros((points, 3)) + [0.0, 0.0, 5.0]
    scene = Scene(np.tile(np.eye(4), (views, 1, 1)), X, np.array([[500.0, 500.0, 320.0, 240.0]]))
    return structure(BundleProblem(Pinhole, scene, Observations(view, point, np.zeros((len(view), 2)))))


def _joined(W: Array, table: Structure) -> Array:
    """Blocks (n, 6, 3) of W (6V, 3N), an observation each, in the table's order."""
    blocks = W.reshape(W.shape[0] // 6, 6, W.shape[1] // 3, 3).transpose(0, 2, 1, 3)
    return np.ascontiguousarray(blocks[table.links.view, table.point_order[table.links.point]])


def _schur(B: Array, W: Array, C: Array, g_view: Array, g_point: Array) -> dict[str, Array]:
    views, points = len(B) // 6, len(C)
    table = _table(views, points)
    own = np.stack([B[6 * v : 6 * v + 6, 6 * v : 6 * v + 6] for v in range(views)])
    order = table.point_order
    normal = Normal(
        own, g_view.reshape(views, 6), C[order], g_point.reshape(points, 3)[order], _joined(W, table)
    )
    M = point_factor(normal.C, np.zeros((points, 3)), table.free_point)
    reduced = reduce(normal, M, np.zeros(table.size), table)
    at = table.columns.ravel()  # where the solver keeps each view's columns
    lower = np.tril(reduced.S)
    S = lower + np.tril(lower, -1).T
    return {"S": S[at][:, at], "rhs": reduced.rhs[at]}


def _back(W: Array, C: Array, g_point: Array, view_step: Array) -> Array:
    views, points = len(view_step) // 6, len(C)
    table = _table(views, points)
    order = table.point_order
    M = point_factor(C[order], np.zeros((points, 3)), table.free_point)
    g, steps = g_point.reshape(points, 3)[order], view_step.reshape(views, 6)
    found = point_steps(_joined(W, table), M, g, steps, table.links.view, table.offsets)
    back = np.empty_like(found)
    back[order] = found
    return back.ravel()


TABLE: Answers = {
    "bundle.residual": _residual,
    "bundle.cost": _cost,
    "bundle.normal_equations": _normal_equations,
    "bundle.schur": _schur,
    "bundle.back_substitute": _back,
}
