"""One step of Levenberg-Marquardt: normal equations at a point, the damped step, and where it leads."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.bundle import reduced_system, schur
from vslam_ref.estimation.bundle.normal import Normal, normal_equations
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.bundle.projection import State
from vslam_ref.estimation.bundle.schur import Diagonals
from vslam_ref.estimation.bundle.structure import Structure
from vslam_ref.estimation.bundle.weights import Weighted
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera

DAMPED = (1e-6, 1e32)
"""Bounds of the squared column lengths that the damping multiplies."""


class Point(NamedTuple):
    """A state with its residuals (sorted), their validity, and what they cost."""

    state: State
    r: Array
    valid: BoolArray
    weighted: Weighted


class System(NamedTuple):
    """The normal equations at a point, their diagonal, and their gradient in the reduced columns."""

    normal: Normal
    diagonal: Diagonals
    g_view: Array
    gradient_norm: float


class Step(NamedTuple):
    """A damped step: of views (V, d), points (N, 3); its length and its promise."""

    view: Array
    point: Array
    length: float
    promised: float


def system_at(problem: BundleProblem, table: Structure, at: Point) -> System:
    """Linearise at a point and add up."""
    basis = problem.free.intrinsics
    normal = normal_equations(problem.model, at.state, table, at.weighted.weights, basis)
    diagonal = schur.diagonals(normal, table)
    g_view = schur.add_at_columns(table.columns, normal.g_view, table.size)
    g_point = normal.g_point * table.free_point[:, None]
    errors = table.whitened(at.r)
    length = math.sqrt(float(np.einsum("n,ni,ni->", at.weighted.weights, errors, errors)))
    norm = 0.0
    if length > 0.0:
        pairs = ((g_view, diagonal.view), (g_point, diagonal.point))
        norm = max(float((np.abs(g) / np.sqrt(np.where(d > 0, d, 1.0))).max(initial=0.0)) for g, d in pairs)
        norm /= length
    return System(normal, diagonal, g_view, norm)


def damped_step(
    table: Structure, system: System, damping: float, method: reduced_system.Method | None
) -> Step | None:
    """Damped step, or None where the reduced system is not positive definite."""
    normal = system.normal
    metric = Diagonals(*(np.where(d > 0, np.clip(d, *DAMPED), 1.0) for d in system.diagonal))
    M = schur.point_factor(normal.C, damping * metric.point, table.free_point)
    S, rhs = schur.reduce(normal, M, damping * metric.view, table)
    method = method or reduced_system.choose(table.size, table.border, table.bandwidth)
    factor = reduced_system.factor(S, table.border, table.bandwidth, method)
    if factor is None:
        return None
    reduced = factor.solve(rhs)
    view_step = np.append(reduced, 0.0)[table.columns]
    point_step = schur.point_steps(normal.W, M, normal.g_point, view_step, table.links.view, table.offsets)
    square = float(metric.view @ reduced**2 + np.sum(metric.point * point_step**2))
    slope = float(system.g_view @ reduced + np.sum(normal.g_point * point_step))
    return Step(view_step, point_step, math.sqrt(square), 0.5 * (damping * square - slope))


def moved(problem: BundleProblem, state: State, step: Step) -> State | None:
    """State after a step: Exp(xi) T, and sums; None where its intrinsics make no camera."""
    T = se3.compose(se3.exp(step.view[:, :6]), se3.from_rt(state.R_cam_world, state.t_cam_world))
    intrinsics = state.intrinsics.copy()
    # views that share a lens have equal steps of it: any of them tells
    intrinsics[problem.lens_of_view] += step.view[:, 6:] @ problem.free.intrinsics.T
    if step.view.shape[1] > 6 and not possible(problem.model, intrinsics):
        return None
    R, t = np.ascontiguousarray(T[:, :3, :3]), np.ascontiguousarray(T[:, :3, 3])
    return State(R, t, state.X_world + step.point, intrinsics)


def possible(model: type[Camera], intrinsics: Array) -> bool:
    """Tell whether every set of intrinsics (L, p) makes a camera: focal lengths above 0, and so on.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> possible(Pinhole, np.array([[500.0, 500, 320, 240], [500.0, -500, 320, 240]]))
    False
    """
    try:
        for values in intrinsics:
            model.from_params(values)
    except ValueError:
        return False
    return True
