"""Published problems: costs and gradients that others computed, and minima that others reached."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.bundle_files import read_bal, read_libmv
from vslam_ref.estimation.bundle import BundleProblem, Options, Robust, Scene, bundle_adjust, freedom
from vslam_ref.estimation.bundle.normal import normal_equations
from vslam_ref.estimation.bundle.structure import structure
from vslam_ref.estimation.robust import Huber
from vslam_ref.geometry import se3, so3

BAL, LIBMV = catalogue.find("bal"), catalogue.find("bal_libmv")
needs_bal = pytest.mark.skipif(BAL is None, reason="data set bal is not in VSLAM_REF_DATA")
needs_libmv = pytest.mark.skipif(LIBMV is None, reason="data set bal_libmv is not in VSLAM_REF_DATA")

INITIAL = 4185659.51824972
"""Published by BundleAdjustmentModels.jl, as the gradient's norm."""


@pytest.fixture(scope="module")
def bal() -> BundleProblem:
    assert BAL is not None
    return read_bal(BAL / "problem-16-22106-pre.txt.bz2").problem


@needs_bal
def test_bal_cost_and_gradients(bal: BundleProblem) -> None:
    """Gradient in the house's left perturbation, and in BAL's additive rotation vector and translation.

    Exp(phi) Exp(w) = Exp(w + dw) with phi = J_l(w) dw, and t + dt = Exp(phi) t + rho, so rho = dt - phi x t.
    """
    table = structure(bal)
    state = table.state(bal)
    normal = normal_equations(bal.model, state, table, np.ones(len(bal.seen)), bal.free.intrinsics)
    house = np.concatenate([normal.g_view.ravel(), normal.g_point.ravel()])
    assert np.linalg.norm(house) == pytest.approx(1.8282809e8, rel=3e-8)
    # BAL's frame is ours turned about x, which changes no length of a gradient in phi or rho
    g_rho, g_phi = normal.g_view[:, :3], normal.g_view[:, 3:6]
    w = so3.log(state.R_cam_world)
    t = state.t_cam_world
    g_w = np.einsum("vji,vj->vi", so3.left_jacobian(w), g_phi + np.cross(g_rho, t))
    flipped = so3.log(np.diag([1.0, -1, -1]) @ state.R_cam_world)
    g_w = np.einsum("vji,vj->vi", so3.left_jacobian(flipped), (g_phi + np.cross(g_rho, t)) * [1, -1, -1])
    additive = np.concatenate([a.ravel() for a in (g_rho, g_w, normal.g_view[:, 6:], normal.g_point)])
    assert np.linalg.norm(additive) == pytest.approx(1.70677551536496e8, rel=1e-10)
    cost = bundle_adjust(bal, options=Options(max_iterations=0)).initial_cost
    assert cost == pytest.approx(INITIAL, rel=1e-10)


@needs_bal
def test_bal_minimum(bal: BundleProblem) -> None:
    result = bundle_adjust(bal)
    assert result.converged
    assert 3 <= result.iterations <= 8
    assert result.cost <= 18033.9036
    assert result.rmse_px == pytest.approx(0.6564, abs=1e-4)


@needs_bal
def test_bal_broken_points_miss(bal: BundleProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the sign of the points' back substitution flipped, 30 steps do not reach the minimum."""
    from vslam_ref.estimation.bundle import schur

    honest = schur.point_steps
    monkeypatch.setattr(schur, "point_steps", lambda *a: -honest(*a))
    broken = bundle_adjust(bal, options=Options(max_iterations=30))
    assert broken.cost > 1.01 * 18033.9036


@needs_bal
def test_small_files_converge() -> None:
    """dubrovnik 3-7: two files of three cameras; the steps end at a minimum, far below the start."""
    assert BAL is not None
    for name in ("dubrovnik-3-7-pre.txt", "dubrovnik-3-7-18-pre.txt"):
        result = bundle_adjust(read_bal(BAL / name).problem, options=Options(max_iterations=300))
        assert result.converged, result.message
        assert result.cost < 0.01 * result.initial_cost


def perturbed(problem: BundleProblem, *, seed: int, turn: float, move: float) -> BundleProblem:
    """Turn the cameras by ``turn`` rad and move points and cameras by ``move`` times the scene's size."""
    rng = np.random.default_rng(seed)
    scene = problem.scene
    size = float(np.linalg.norm(scene.X_world.std(0)))
    xi = rng.standard_normal((len(scene.T_cam_world), 6)) * np.repeat([move * size, turn], 3)
    X = scene.X_world + move * size * rng.standard_normal(scene.X_world.shape)
    return problem.at(Scene(se3.perturb(scene.T_cam_world, xi), X, scene.intrinsics))


@needs_libmv
def test_libmv_fixed_and_free_focal_length() -> None:
    """From cameras turned by 0.1 mrad and everything moved by 1 % of the scene: 4607.592 and 4566.3."""
    assert LIBMV is not None
    stored = read_libmv(LIBMV / "problem_01.bin").problem
    at_store = bundle_adjust(stored, options=Options(max_iterations=0)).cost
    assert at_store == pytest.approx(4607.594, abs=5e-4)
    start = perturbed(stored, seed=1, turn=1e-4, move=0.01)
    fixed = bundle_adjust(start)
    assert fixed.initial_cost > 100 * at_store
    assert fixed.iterations > 3
    assert fixed.cost == pytest.approx(4607.592, abs=1e-3)
    focal = freedom(start.model, start.scene, intrinsics=("f",))
    free = bundle_adjust(dataclasses.replace(start, free=focal), options=Options(max_iterations=18))
    assert free.cost <= 4566.3


@needs_libmv
def test_libmv_robust_loss_changes_the_answer_little() -> None:
    assert LIBMV is not None
    stored = read_libmv(LIBMV / "problem_01.bin").problem
    result = bundle_adjust(perturbed(stored, seed=1, turn=1e-4, move=0.01), Robust(Huber(3.0)))
    assert result.converged
    assert 4000 < result.cost < 4607.592


@needs_libmv
def test_libmv_broken_points_miss(monkeypatch: pytest.MonkeyPatch) -> None:
    """The points' steps with the other sign: as many steps as the right ones need end above."""
    from vslam_ref.estimation.bundle import schur

    assert LIBMV is not None
    stored = read_libmv(LIBMV / "problem_01.bin").problem
    honest = schur.point_steps
    monkeypatch.setattr(schur, "point_steps", lambda *a: -honest(*a))
    start = perturbed(stored, seed=1, turn=1e-4, move=0.01)
    assert bundle_adjust(start, options=Options(max_iterations=12)).cost > 1.1 * 4607.592
