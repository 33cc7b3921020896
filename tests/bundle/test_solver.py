"""The solver finds minima, says why it ended, and names what it cannot do."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import least_squares

from vslam_ref.estimation.bundle import (
    BundleProblem,
    Observations,
    Options,
    Robust,
    Scene,
    bundle_adjust,
    solver,
)
from vslam_ref.estimation.bundle import projection as bundle_projection
from vslam_ref.estimation.bundle.adjustment import possible
from vslam_ref.estimation.robust import Huber, Tukey
from vslam_ref.geometry import se3
from vslam_ref.geometry.alignment import align
from vslam_ref.geometry.cameras import Pinhole, projection

from .conftest import CAMERAS, hold, make

TIGHT = Options(cost=1e-15, gradient=1e-12)


@pytest.mark.parametrize("model", CAMERAS)
def test_finds_the_truth_without_noise(model: str, rng: np.random.Generator) -> None:
    """Held by two true views, everything comes back: to 1e-9, from 0.02 m and rad away."""
    problem, truth = make(rng, model, views=4, points=15, noise=0.0)
    result = bundle_adjust(hold(problem, [0, 3], truth), options=TIGHT)
    assert result.iterations >= 3
    assert result.converged, result.message
    assert result.initial_cost > 100.0
    assert result.cost < 1e-18
    scene = result.problem.scene
    assert np.abs(scene.X_world - truth.X_world).max() < 1e-9
    assert np.abs(scene.T_cam_world - truth.T_cam_world).max() < 1e-9


def test_free_gauge_finds_the_truth_up_to_a_similarity(rng: np.random.Generator) -> None:
    problem, truth = make(rng, views=4, points=20, noise=0.0)
    result = bundle_adjust(problem, options=TIGHT)
    assert result.cost < 1e-18
    assert align(result.problem.scene.X_world, truth.X_world, with_scale=True).rmse < 1e-9
    assert np.abs(result.problem.scene.X_world - truth.X_world).max() > 1e-4  # another gauge, indeed


def test_same_minimum_as_scipy(rng: np.random.Generator) -> None:
    """SciPy's trust region on the same residuals, its own Jacobian by differences: the same cost."""
    problem, truth = make(rng, "radtan", views=3, points=10, intrinsics=("f", "k1"))
    problem = hold(problem, [0, 2], truth)
    result = bundle_adjust(problem, options=TIGHT)
    seen, scene = problem.seen, problem.scene

    def residual(x: np.ndarray) -> np.ndarray:
        T = scene.T_cam_world.copy()
        T[1] = se3.perturb(T[1], x[:6])
        k = scene.intrinsics[0] + problem.free.intrinsics @ x[6:8]
        X = scene.X_world + x[8:].reshape(-1, 3)
        uv = projection.pixel_from_world(k, T[seen.view], X[seen.point], lens=problem.model.lens).uv
        return (uv - seen.uv).ravel()

    found = least_squares(residual, np.zeros(8 + 30), x_scale="jac", ftol=1e-14, xtol=1e-14, gtol=1e-14)
    assert result.cost == pytest.approx(found.cost, rel=1e-9)
    assert result.cost < 0.01 * result.initial_cost


@pytest.mark.parametrize("with_cov", [False, True])
def test_cost_at_the_minimum_is_chi_squared(with_cov: bool) -> None:
    """Twice the cost of 40 scenes with known noise: chi-squared, dof = 2n - 6V - 3N + 7 each.

    Two-sided band with a false-alarm rate of 1e-4.
    """
    total, dof = 0.0, 0
    for seed in range(40):
        problem, _ = make(np.random.default_rng(seed), views=4, points=12, noise=0.3, with_cov=with_cov)
        cost = bundle_adjust(problem, options=Options(cost=1e-10)).cost
        total += 2.0 * cost / (1.0 if with_cov else 0.3**2)
        dof += 2 * 48 - 24 - 36 + 7
    low, high = stats.chi2.ppf([5e-5, 1 - 5e-5], dof)
    assert low < total < high


def test_gauge_does_not_drift(rng: np.random.Generator) -> None:
    """Steps along the gauge are zero to rounding: the points keep centre, turn and size to first order."""
    problem, _ = make(rng, views=4, points=20, noise=0.0, perturb=1e-4)
    result = bundle_adjust(problem, options=TIGHT)
    moved = align(problem.scene.X_world, result.problem.scene.X_world, with_scale=True)
    assert abs(moved.scale - 1.0) < 3e-4
    assert np.abs(moved.t_target_source).max() < 3e-4


def test_scale_of_the_cost_is_a_square(rng: np.random.Generator) -> None:
    """A covariance of 4 I divides the cost by 4 and moves no minimum."""
    problem, _ = make(rng, noise=0.5)
    cov = np.tile(4.0 * np.eye(2), (len(problem.seen), 1, 1))
    weighted = dataclasses.replace(problem, seen=dataclasses.replace(problem.seen, cov_uv=cov))
    a, b = bundle_adjust(problem, options=TIGHT), bundle_adjust(weighted, options=TIGHT)
    assert a.cost == pytest.approx(4.0 * b.cost, rel=1e-9)
    assert a.rmse_px == pytest.approx(b.rmse_px, rel=1e-6)


def spoil(problem: BundleProblem, share: float, rng: np.random.Generator) -> tuple[BundleProblem, np.ndarray]:
    """Move a share of the measurements by 30 to 60 pixels."""
    bad = rng.random(len(problem.seen)) < share
    angle = rng.uniform(0, 2 * np.pi, len(bad))
    away = rng.uniform(30, 60, len(bad))[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    uv = problem.seen.uv + bad[:, None] * away
    return dataclasses.replace(problem, seen=dataclasses.replace(problem.seen, uv=uv)), bad


def test_adaptive_tukey_ignores_wrong_matches(rng: np.random.Generator) -> None:
    """15 % wrong: Tukey with the scale from the median is near the clean answer, least squares is not."""
    problem, truth = make(rng, views=6, points=40, noise=0.5, perturb=0.003)
    problem = hold(problem, [0, 5], truth)
    spoiled, bad = spoil(problem, 0.15, rng)

    def error(result: solver.BundleResult) -> float:
        return float(np.sqrt(np.mean((result.problem.scene.X_world - truth.X_world) ** 2)))

    clean = bundle_adjust(problem)
    tukey = bundle_adjust(spoiled, Robust(Tukey(5.123), "adaptive", least_scale=0.05))
    plain = bundle_adjust(spoiled)
    huber = bundle_adjust(spoiled, Robust(Huber(1.5), 0.5))
    assert error(tukey) < 1.5 * error(clean) < error(huber) < error(plain)
    assert (tukey.weights[bad] == 0).mean() > 0.95
    assert (tukey.weights[~bad] > 0).mean() > 0.97
    # residuals of a fit are smaller than errors: 24 + 120 parameters for the 408 honest coordinates
    assert tukey.sigma == pytest.approx(0.5 * np.sqrt(1 - 144 / 408), rel=0.1)
    assert tukey.converged
    assert len({step.sigma for step in tukey.history}) > 2  # the scale did adapt


def test_adaptive_scale_has_a_floor(rng: np.random.Generator) -> None:
    """PTAM's 0.4 pixels: without noise the scale would fall to zero and every error be an outlier."""
    problem, truth = make(rng, noise=0.0, perturb=1e-3)
    result = bundle_adjust(hold(problem, [0], truth), Robust(Tukey(5.123), "adaptive"))
    assert result.sigma == 0.4
    assert result.cost < 1e-12


def test_behind_at_the_start_is_set_aside_or_costs_a_constant(rng: np.random.Generator) -> None:
    problem, _ = make(rng, noise=0.1)
    X = problem.scene.X_world.copy()
    X[3] = [0.0, 0.0, -9.0]  # behind every camera
    problem = problem.at(dataclasses.replace(problem.scene, X_world=X))
    plain = bundle_adjust(problem)
    assert plain.aside.sum() == 4
    assert (problem.seen.point[plain.aside] == 3).all()
    assert math.isfinite(plain.cost)
    assert plain.converged
    assert not plain.weights[plain.aside].any()
    assert (plain.problem.scene.X_world[3] == X[3]).all()
    bounded = bundle_adjust(problem, Robust(Tukey(6.0)))
    assert not bounded.aside.any()
    assert bounded.cost >= 4 * 6.0**2 / 6


def test_no_step_goes_behind_a_camera() -> None:
    """A depth of 10 that should be 0.5: the linear step would be -190.  It is refused, not taken."""
    T = se3.from_rt(np.eye(3), [[0.0, 0, 0], [-0.1, 0, 0]])
    scene = Scene(T, [[0.0, 0.0, 10.0]], [[100.0, 100, 0, 0]])
    seen = Observations([0, 1], [0, 0], [[0.0, 0.0], [-20.0, 0.0]])
    problem = BundleProblem(Pinhole, scene, seen)
    free = dataclasses.replace(problem.free, pose=np.zeros((2, 6), dtype=bool))
    result = bundle_adjust(dataclasses.replace(problem, free=free), options=TIGHT)
    assert sum(not step.accepted for step in result.history) > 3
    assert result.valid.all()
    assert result.problem.scene.X_world[0] == pytest.approx([0, 0, 0.5], abs=1e-9)


def test_an_intrinsic_never_leaves_its_domain(rng: np.random.Generator) -> None:
    """A step to a negative omega or focal length is refused."""
    problem, _truth = make(rng, "fov", intrinsics=("f", "omega"), perturb=0.05)
    result = bundle_adjust(hold(problem, [0, 3], problem.scene))
    assert possible(problem.model, result.problem.scene.intrinsics)


EMPTY = np.zeros(0, dtype=int)


@pytest.mark.parametrize(
    ("reason", "change"),
    [
        ("no_observations", {"seen": Observations(EMPTY, EMPTY, np.zeros((0, 2)))}),
        ("max_iterations", {}),
    ],
)
def test_named_ends(reason: str, change: dict[str, object], rng: np.random.Generator) -> None:
    problem, _ = make(rng)
    result = bundle_adjust(dataclasses.replace(problem, **change), options=Options(max_iterations=1))
    assert result.reason == reason
    assert not result.converged
    assert np.isfinite(result.problem.scene.X_world).all()


def test_nothing_free_and_no_images_and_all_outliers(rng: np.random.Generator) -> None:
    problem, _ = make(rng)
    views, points, _ = problem.sizes
    stuck = dataclasses.replace(
        problem.free, pose=np.zeros((views, 6), dtype=bool), point=np.zeros(points, dtype=bool)
    )
    assert bundle_adjust(dataclasses.replace(problem, free=stuck)).reason == "nothing_free"
    X = problem.scene.X_world - [0, 0, 100.0]
    behind = problem.at(dataclasses.replace(problem.scene, X_world=X))
    assert bundle_adjust(behind).reason == "no_images"
    far = bundle_adjust(problem, Robust(Tukey(1e-3)))
    assert far.reason == "all_outliers"
    assert (far.problem.scene.X_world == problem.scene.X_world).all()


def test_wrong_sign_in_one_block_of_the_jacobian_is_noticed(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A deliberately broken solver: the rotation's columns with the other sign never reach the minimum."""
    from vslam_ref import _kernels

    problem, truth = make(rng, noise=0.5)
    problem = hold(problem, [0, 3], truth)
    good = bundle_adjust(problem)
    honest = bundle_projection._Polynomial.linearised

    def broken(self: object, *arguments: object) -> bundle_projection.Linearised:
        at = honest(self, *arguments)  # type: ignore[arg-type]
        at.J_view[:, :, 3:6] *= -1.0
        return at

    monkeypatch.setattr(bundle_projection._Polynomial, "linearised", broken)
    with _kernels.use_backend("numpy"):
        bad = bundle_adjust(problem)
    assert bad.cost > 1.5 * good.cost


def test_views_and_points_without_observations_stay(rng: np.random.Generator) -> None:
    """They are no error, and get no NaN."""
    problem, _truth = make(rng, views=5, points=12)
    keep = (problem.seen.view != 2) & (problem.seen.point != 7)
    problem = dataclasses.replace(problem, seen=problem.seen.only(keep))
    for method in ("dense", "banded"):
        result = bundle_adjust(problem, options=Options(method=method))  # type: ignore[arg-type]
        assert result.converged, result.message
        assert (result.problem.scene.X_world[7] == problem.scene.X_world[7]).all()
        assert np.abs(result.problem.scene.T_cam_world[2] - problem.scene.T_cam_world[2]).max() < 1e-15


def test_point_seen_once_tells_nothing(rng: np.random.Generator) -> None:
    """It fits its only observation, and the rest is where it would be without it."""
    problem, truth = make(rng, views=4, points=14)
    problem = hold(problem, [0, 3], truth)
    once = (problem.seen.point != 5) | (problem.seen.view == 1)
    never = problem.seen.point != 5
    a = bundle_adjust(dataclasses.replace(problem, seen=problem.seen.only(once)), options=TIGHT)
    b = bundle_adjust(dataclasses.replace(problem, seen=problem.seen.only(never)), options=TIGHT)
    assert a.cost == pytest.approx(b.cost, rel=1e-9)
    others = np.arange(14) != 5
    assert np.abs(a.problem.scene.X_world - b.problem.scene.X_world)[others].max() < 1e-6


def test_options_and_scales_are_checked() -> None:
    for bad in ({"damping": 0.0}, {"damping": math.inf}, {"max_iterations": -1}):
        with pytest.raises(ValueError, match=r"need|must"):
            Options(**bad)  # type: ignore[arg-type]
    for bad in ({"scale": 0.0}, {"scale": "automatic"}, {"least_scale": -1.0}):
        with pytest.raises(ValueError, match="scale"):
            Robust(**bad)  # type: ignore[arg-type]
