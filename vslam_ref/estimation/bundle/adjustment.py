"""What a descent asks of bundle adjustment: normal equations at a place, a step, and where it leads.

Residuals are in pixels, or in standard deviations where covariances are given; rotations of a step in
radians, translations and points in the unit of the scene, usually metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.bundle import projection, reduced_system, schur
from vslam_ref.estimation.bundle.families import CameraModel, camera_of, own_columns
from vslam_ref.estimation.bundle.normal import Normal, normal_equations
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.bundle.projection import BundleState
from vslam_ref.estimation.bundle.schur import Diagonals
from vslam_ref.estimation.bundle.structure import Structure
from vslam_ref.estimation.bundle.weights import Robust, Weighted, weigh
from vslam_ref.estimation.least_squares import Step
from vslam_ref.geometry import se3

DAMPED = (1e-6, 1e32)
"""Bounds of the squared column lengths that the damping multiplies."""


class Place(NamedTuple):
    """A state with its residuals ``r (n, 2)`` (sorted), their validity ``valid (n,)``, and what they cost."""

    state: BundleState
    r: Array
    valid: BoolArray
    weighted: Weighted


class Change(NamedTuple):
    """A step: of views (V, d) and points (N, 3)."""

    view: Array
    point: Array


@dataclass
class Here:
    """The problem at a place; the normal equations are added up when they are first needed."""

    problem: BundleProblem
    table: Structure
    place: Place
    stiffness: float = 1.0

    @property
    def costs(self) -> Array:
        """Cost of each observation, (n,), at the place's scale."""
        return self.place.weighted.costs

    @cached_property
    def normal(self) -> Normal:
        """Blocks of the normal equations."""
        at, basis = self.place, self.problem.free.intrinsics
        return normal_equations(self.problem.model, at.state, self.table, at.weighted.weights, basis)

    @cached_property
    def diagonal(self) -> Diagonals:
        """Diagonal of the normal matrix."""
        return schur.diagonals(self.normal, self.table)

    @cached_property
    def gradient(self) -> Diagonals:
        """J^T r, of the views' columns (D,) and of the points (N, 3)."""
        view = schur.add_at_columns(self.table.columns, self.normal.g_view, self.table.size)
        return Diagonals(view, self.normal.g_point * self.table.free_point[:, None])

    @cached_property
    def gradient_norm(self) -> float:
        """Largest cosine between a column of the Jacobian and the residual."""
        errors = self.table.whitened(self.place.r)
        length = math.sqrt(float(np.einsum("n,ni,ni->", self.place.weighted.weights, errors, errors)))
        if length == 0.0:
            return 0.0
        pairs = zip(self.gradient, self.diagonal, strict=True)
        cosines = (np.abs(g) / np.sqrt(np.where(d > 0, d, 1.0)) for g, d in pairs)
        return max(float(c.max(initial=0.0)) for c in cosines) / length


@dataclass
class Adjustment:
    """One adjustment as it goes.

    ``active`` (n,) are the observations that count, ``judged_at`` is the scale of the last step.
    """

    problem: BundleProblem
    robust: Robust
    method: reduced_system.Method | None
    table: Structure
    active: BoolArray
    judged_at: float = 1.0

    @property
    def floor(self) -> float:
        """Cost of residuals that are nothing but the rounding of their pixels."""
        uv = self.table.links.uv
        return len(uv) * (8.0 * schur.EPS * max(1.0, float(np.abs(uv).max(initial=0.0)))) ** 2

    def at(self, state: BundleState, sigma: float | None = None) -> Place:
        """Evaluate a state, at a given scale or at its own."""
        r, valid = projection.residuals(self.problem.model, state, self.table.links)
        return self.weighed(state, r, valid, sigma)

    def weighed(self, state: BundleState, r: Array, valid: BoolArray, sigma: float | None = None) -> Place:
        """Weigh the residuals of a state, at a given scale or at their own."""
        errors = self.table.whitened(r)
        used = self.robust.sigma(errors, valid & self.active) if sigma is None else sigma
        found = weigh(self.robust, used, errors, valid)
        found.costs[~self.active] = found.weights[~self.active] = 0.0
        return Place(state, r, valid, found)

    def linearise(self, place: Place, before: Here | None = None) -> Here:
        """Take the place at its own scale, if that is adaptive: the residuals are known."""
        if before is not None and self.robust.scale == "adaptive":
            place = self.weighed(*place[:3])
        return Here(self.problem, self.table, place)

    def step(self, here: Here, damping: float) -> Step | None:
        """Damped step, points eliminated; None where the reduced system is not positive definite."""
        normal, table, self.judged_at = here.normal, self.table, here.place.weighted.sigma
        metric = Diagonals(*(np.where(d > 0, np.clip(d, *DAMPED), 1.0) for d in here.diagonal))
        M = schur.point_factor(normal.C, damping * metric.point, table.free_point)
        S, rhs = schur.reduce(normal, M, damping * metric.view, table)
        method = self.method or reduced_system.choose(table.size, table.border, table.bandwidth)
        factor = reduced_system.factor(S, table.border, table.bandwidth, method)
        if factor is None:
            return None
        reduced = factor.solve(rhs)
        view = np.append(reduced, 0.0)[table.columns]
        point = schur.point_steps(normal.W, M, normal.g_point, view, table.links.view, table.offsets)
        square = float(metric.view @ reduced**2 + np.sum(metric.point * point**2))
        slope = float(here.gradient.view @ reduced + np.sum(normal.g_point * point))
        return Step(Change(view, point), math.sqrt(square), 0.5 * (damping * square - slope))

    def move(self, here: Here, step: Step) -> Place | None:
        """Where a step leads, at the scale of where it began; None where its intrinsics make no camera."""
        state = moved(self.problem, here.place.state, step.change)
        return None if state is None else self.at(state, here.place.weighted.sigma)

    def costs(self, place: Place) -> Array:
        """Cost of each observation, (n,)."""
        return place.weighted.costs


def moved(problem: BundleProblem, state: BundleState, step: Change) -> BundleState | None:
    """State after a step: Exp(xi) T, and sums; None where its intrinsics make no camera."""
    T = se3.compose(se3.exp(step.view[:, :6]), se3.from_rt(state.R_cam_world, state.t_cam_world))
    intrinsics = state.intrinsics.copy()
    # views that share a lens have equal steps of it: any of them will do
    own = own_columns(problem.model, len(intrinsics))[problem.lens_of_view]
    intrinsics[problem.lens_of_view] += np.where(own, step.view[:, 6:] @ problem.free.intrinsics.T, 0.0)
    if step.view.shape[1] > 6 and not possible(problem.model, intrinsics):
        return None
    R, t = np.ascontiguousarray(T[:, :3, :3]), np.ascontiguousarray(T[:, :3, 3])
    return BundleState(R, t, state.X_world + step.point, intrinsics)


def possible(model: CameraModel, intrinsics: Array) -> bool:
    """Whether every set of intrinsics (L, p) makes a camera: focal lengths above 0, and so on.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> possible(Pinhole, np.array([[500.0, 500, 320, 240], [500.0, -500, 320, 240]]))
    False
    """
    try:
        for number in range(len(intrinsics)):
            camera_of(model, intrinsics, number)
    except ValueError:
        return False
    return True
