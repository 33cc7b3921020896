"""Residuals and Jacobians of all observations, against the cameras' own functions and differences."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.estimation.bundle import BundleProblem, Freedom, Observations, Scene
from vslam_ref.estimation.bundle import projection as p
from vslam_ref.estimation.bundle.structure import structure
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole, projection
from vslam_ref.testing import check_jacobian

from .conftest import CAMERAS, make

EPS = np.finfo(float).eps


def parts(problem: BundleProblem) -> tuple[p.BundleState, p.Links]:
    T, seen = problem.scene.T_cam_world, problem.seen
    state = p.BundleState(T[:, :3, :3], T[:, :3, 3], problem.scene.X_world, problem.scene.intrinsics)
    return state, p.Links(seen.view, seen.point, problem.lens_of_view[seen.view], seen.uv)


@pytest.mark.parametrize("model", CAMERAS)
def test_agrees_with_the_cameras(model: str, rng: np.random.Generator) -> None:
    """Two codes for one formula: they differ by rounding, some 50 operations on pixels of size 1000."""
    problem, _ = make(rng, model, sets=4)
    problem = dataclasses.replace(
        problem, free=dataclasses.replace(problem.free, intrinsics=np.eye(len(CAMERAS[model].params)))
    )
    state, links = parts(problem)
    at = p.linearise(problem.model, state, links, problem.free.intrinsics)
    want = projection.pixel_from_world_with_jacobians(
        problem.scene.intrinsics[links.lens],
        problem.scene.T_cam_world[links.view],
        problem.scene.X_world[links.point],
        lens=problem.model.lens,
    )
    J_view = np.concatenate([want.J_pose, want.J_intrinsics], -1)
    for got, expected in ((at.r + links.uv, want.uv), (at.J_view, J_view), (at.J_point, want.J_point)):
        assert np.abs(got - expected).max() <= 50 * EPS * max(np.abs(expected).max(), 1000.0)
    assert p.residuals(problem.model, state, links).r == pytest.approx(at.r, abs=1e-10)
    assert at.valid.all()


@pytest.mark.parametrize("model", ["pinhole", "radtan"])
def test_jacobians_are_derivatives(model: str, rng: np.random.Generator) -> None:
    """Against differences of the residuals, with a basis that mixes intrinsics; the pose by Exp(xi) T."""
    problem, _ = make(rng, model, views=2, points=3)
    basis = rng.standard_normal((len(CAMERAS[model].params), 2)) * 0.1
    state, links = parts(problem)
    at = p.linearise(problem.model, state, links, basis)
    o = 3

    def residual(step: np.ndarray) -> np.ndarray:
        T = se3.perturb(problem.scene.T_cam_world, np.tile(step[:6], (2, 1)))
        moved = p.BundleState(
            T[:, :3, :3], T[:, :3, 3], state.X_world + step[8:], state.intrinsics + basis @ step[6:8]
        )
        return p.residuals(problem.model, moved, links).r[o]

    check_jacobian(
        residual, np.zeros(11), np.concatenate([at.J_view[o], at.J_point[o]], -1), method="central"
    )


def test_behind_a_camera_is_no_image() -> None:
    """Flag, zeros, and no NaN: at depth 0, at a negative depth, and at infinity times nothing."""
    scene = Scene(np.eye(4)[None], [[1, 1, 2], [1, 1, 0], [1, 1, -2], [0, 0, 0]], [[500, 500, 320, 240]])
    seen = Observations(np.zeros(4, dtype=int), np.arange(4), np.zeros((4, 2)))
    problem = BundleProblem(Pinhole, scene, seen)
    state, links = parts(problem)
    at = p.linearise(Pinhole, state, links, np.eye(4))
    assert at.valid.tolist() == [True, False, False, False]
    assert at.r[0].tolist() == [570.0, 490.0]
    for values in (at.r, at.J_view, at.J_point):
        assert not values[1:].any()
    assert p.reprojection(problem).valid.tolist() == at.valid.tolist()


def test_structure_sorts_and_nothing_is_lost(rng: np.random.Generator) -> None:
    """Every observation once, sorted by point; every free coordinate has its own column."""
    problem, _ = make(rng, views=7, points=30, seen_by=3, sets=7, intrinsics=("f",))
    pose = problem.free.pose.copy()
    pose[2] = False
    pose[4, 1] = False
    problem = dataclasses.replace(problem, free=Freedom(pose, problem.free.point, problem.free.intrinsics))
    table = structure(problem)
    assert sorted(table.order) == list(range(len(problem.seen)))
    assert (np.diff(table.links.point) >= 0).all()
    assert (problem.seen.view[table.order] == table.links.view).all()
    assert (problem.seen.point[table.order] == table.point_order[table.links.point]).all()
    used = table.columns[table.columns < table.size]
    assert sorted(used) == list(range(7 * 7 - 6 - 1))
    assert table.border == table.size
    assert (table.columns[2, :6] == table.size).all()
    assert table.columns[4, 1] == table.size


def test_shared_lenses_stand_behind_the_views(rng: np.random.Generator) -> None:
    problem, _ = make(rng, views=6, points=10, sets=2, intrinsics=("f", "cx"))
    table = structure(problem)
    assert (table.border, table.size) == (36, 40)
    assert table.columns[:, 6:].tolist() == [[36, 37], [38, 39]] * 3
