"""The shared lens: its covariance against dense algebra and repetition, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle import BundleProblem, Observations, Options, Robust, Scene, bundle_adjust
from vslam_ref.estimation.bundle.covariance import covariance
from vslam_ref.estimation.bundle.gauge import fix_gauge
from vslam_ref.estimation.bundle.lens_covariance import lens_covariance
from vslam_ref.estimation.bundle.self_calibration import SelfCalibration, self_calibrate
from vslam_ref.estimation.robust import tuned
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fov, Radtan

from .conftest import dense_system, make

TIGHT = Options(cost=1e-14, gradient=1e-13)
SIZE = (640, 480)
NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
TRUE = Radtan(510.0, 507.0, 326.0, 233.0, -0.12, 0.03, 1e-3, -1.5e-3)
PLAIN = Radtan(510.0, 507.0, 326.0, 233.0, 0.0, 0.0, 0.0, 0.0)
GIVEN = Radtan(500.0, 500.0, 319.5, 239.5, 0.0, 0.0, 0.0, 0.0)


def film(
    rng: np.random.Generator,
    *,
    true: Camera = TRUE,
    turns: bool = True,
    sigma: float = 0.3,
    shared: float = 0.0,
    wrong: float = 0.0,
) -> tuple[BundleProblem, Scene]:
    """Twelve views that begin at the truth, but with the camera ``GIVEN``; ``sigma`` pixels of error.

    ``shared`` is the part of the variance that is a point's own: its patch drifts off over the film, as the
    surface turns away; ``wrong`` is the share of sightings that are somewhere.
    """
    t = np.linspace(0.0, 1.0, 12)
    turn = np.stack([0.2 * np.sin(7 * t), 0.4 * np.sin(4 * t + 1), 0.5 * np.sin(5 * t)], -1) * turns
    move = np.stack([0.9 * t, 0.2 * np.sin(6 * t), 0.3 * np.cos(5 * t)], -1)
    T = se3.perturb(se3.exp(np.concatenate([np.zeros((12, 3)), turn], -1)), np.zeros(6))
    T[:, :3, 3] = -np.einsum("vij,vj->vi", T[:, :3, :3], move)
    X = rng.uniform([-2.5, -2.0, 2.0], [3.2, 2.0, 6.0], (260, 3))
    at = true.pixel_from_world(T[:, None], X)
    view, point = np.nonzero(at.valid & ((at.uv > 0) & (at.uv < SIZE)).all(-1))
    seen_often = np.bincount(point, minlength=len(X))[point] >= 3
    view, point = view[seen_often], point[seen_often]
    own = np.sqrt(1 - shared) * rng.standard_normal((len(view), 2))
    drift = np.sqrt(12) * (t - 0.5)[view, None] * rng.standard_normal((len(X), 2))[point]
    error = sigma * (own + np.sqrt(shared) * drift)
    uv = at.uv[view, point] + error
    astray = rng.random(len(view)) < wrong
    uv[astray] += rng.uniform(-60, 60, (astray.sum(), 2))
    truth = Scene(T, X, true.params[None])
    start = Scene(T, X, GIVEN.params[None])
    return fix_gauge(BundleProblem(Radtan, start, Observations(view, point, uv))), truth


def calibrate(problem: BundleProblem, robust: Robust | None = None, **more: float) -> SelfCalibration:
    return self_calibrate(problem, NAMES, SIZE, robust, Options(cost=1e-9), **more)


def distances(found: SelfCalibration) -> Array:
    """Errors of the intrinsics that were found, in their standard deviations."""
    error = dict(zip(Radtan.names(), found.camera.params - TRUE.params, strict=True))
    return np.array([error[name] / sigma for name, sigma in found.sigma.items()])


def test_the_lens_covariance_is_that_of_dense_algebra(rng: np.random.Generator) -> None:
    """Pseudo-inverse of the whole normal matrix; and influences of the points, one row at a time."""
    problem, _ = make(rng, "radtan", views=5, points=30, intrinsics=("f", "cx", "k1"))
    result = bundle_adjust(problem, options=TIGHT)
    held = fix_gauge(result.problem)
    system = dense_system(held)
    J, r, lens = system["J"], system["r"], slice(6 * 5, 6 * 5 + 3)
    inverse = np.linalg.pinv(J, rcond=1e-11) @ np.linalg.pinv(J, rcond=1e-11).T
    dof = len(r) - (6 * 5 - 7) - 3 - 3 * 30
    sigma2 = r @ r / dof
    found = lens_covariance(result)
    assert found.reason == ""
    assert found.independent is not None
    assert found.matrix is not None
    np.testing.assert_allclose(found.independent, sigma2 * inverse[lens, lens], rtol=1e-6)
    step = -(inverse[lens] @ J.T) * r  # (3, 2n): what each row moved
    each = np.stack([step[:, np.repeat(problem.seen.point == j, 2)].sum(1) for j in range(30)])
    np.testing.assert_allclose(found.matrix, len(r) / dof * 30 / 29 * each.T @ each, rtol=1e-6)
    larger = np.maximum(np.diag(found.independent), np.diag(found.matrix))
    np.testing.assert_allclose(found.sigma, np.sqrt(larger), rtol=1e-12)


def test_a_point_that_was_seen_once_tells_nothing(rng: np.random.Generator) -> None:
    problem, _ = make(rng, "radtan", views=5, points=30, intrinsics=("f",))
    result = bundle_adjust(problem, options=TIGHT)
    once = (problem.seen.point != 7) | (problem.seen.view == 2)
    without = problem.seen.point != 7
    told = []
    for rows in (once, without):
        part = dataclasses.replace(result.problem, seen=problem.seen.only(rows))
        some = dataclasses.replace(
            result, problem=part, residual=result.residual[rows], weights=result.weights[rows]
        )
        views = covariance(dataclasses.replace(some, problem=fix_gauge(part)), [1, 2], sigma=1.0).matrix
        assert views is not None
        told.append((views, lens_covariance(some).sigma))
    np.testing.assert_allclose(told[0][0], told[1][0], rtol=1e-7)
    np.testing.assert_allclose(told[0][1], told[1][1], rtol=1e-7)


def test_a_wrong_camera_is_found_with_true_deviations(rng: np.random.Generator) -> None:
    """Eight intrinsics of twelve films.  Squares of 96 errors over their sigmas: chi-squared of 96, were they
    independent; those of one film are not, so the band is that of 12 films, each worth 8 at once:
    8 chi2(12), false-alarm rate 1e-4.
    """
    from scipy import stats

    total, largest = 0.0, 0.0
    for _ in range(12):
        found = calibrate(film(rng, shared=0.5)[0])
        assert found.reason == ""
        assert not found.refused
        z = distances(found)
        total, largest = total + float(z @ z), max(largest, float(np.abs(z).max()))
    low, high = 8 * stats.chi2.ppf([5e-5, 1 - 5e-5], 12)
    assert low < total < high
    assert largest < stats.norm.isf(1e-4 / 2 / 96)


@pytest.mark.slow
def test_deviations_with_an_error_of_each_point_are_those_of_repetition() -> None:
    """200 films in which half of the variance is a point's own.  The spread of an intrinsic over its sigma
    has a relative error of 1/400^(1/2), and so has the sigma of 200 clusters; six of both are allowed.
    Sigmas of independent sightings are too small, one of them by that much at least.
    """
    z, independent = [], []
    for seed in range(200):
        found = calibrate(film(np.random.default_rng(seed), shared=0.5)[0])
        z.append(distances(found))
        errors = found.camera.params[:8] - TRUE.params[:8]
        cov = lens_covariance(found.result).independent
        assert cov is not None
        independent.append(errors / np.sqrt(np.diag(cov)))
    spread = np.sqrt(np.mean(np.square(z), axis=0))
    too_small = np.sqrt(np.mean(np.square(independent), axis=0))
    assert np.abs(spread - 1).max() < 6 / np.sqrt(200)
    assert (too_small > spread).all()
    assert too_small.max() > 1 + 6 / np.sqrt(400)


def test_wrong_sightings_do_not_spoil_it(rng: np.random.Generator) -> None:
    """Five in a hundred are somewhere; Tukey's loss.  Eight errors below 4.4 sigma: rate 1e-4."""
    problem, _ = film(rng, wrong=0.05)
    found = calibrate(problem, Robust(tuned("tukey", 2), "adaptive", 0.2))
    assert found.reason == ""
    assert np.abs(distances(found)).max() < 4.4
    plain = calibrate(problem)
    assert plain.reason or np.abs(plain.camera.params - TRUE.params)[0] > 5 * found.sigma["fx"]


def test_a_motion_that_never_turns_leaves_focal_lengths_and_centre_open(rng: np.random.Generator) -> None:
    """Without distortion, images of a world that is stretched or sheared are the same: K hides in it."""
    problem, _ = film(rng, true=PLAIN, turns=False)
    found = calibrate(problem)
    assert {"fx", "fy", "cx", "cy", "p1", "p2"} <= set(found.refused)
    assert {"k1", "k2"} >= set(found.sigma)
    for name, why in found.refused.items():
        row = Radtan.names().index(name)
        assert found.camera.params[row] == GIVEN.params[row]
        assert why.shift_px > 5.0 or name in ("p1", "p2")


def test_round_distortion_shows_the_ratio_of_focal_lengths_but_not_their_size(
    rng: np.random.Generator,
) -> None:
    """What is round on the sensor tells fx / fy even without a turn; one of them stays as it was given."""
    found = calibrate(film(rng, turns=False)[0])
    assert len({"fx", "fy"} & set(found.refused)) == 1


def test_exact_translation_is_open_before_any_step() -> None:
    """No error, no turn, no distortion: the null space is exact, and sigmas are infinite."""
    problem, truth = film(np.random.default_rng(1), true=PLAIN, turns=False, sigma=0.0)
    free = dataclasses.replace(problem.free, intrinsics=np.eye(9)[:, [0, 2]])
    result = bundle_adjust(dataclasses.replace(problem.at(truth), free=free))
    told = lens_covariance(dataclasses.replace(result, residual=result.residual + 0.3))
    assert np.isinf(told.sigma).all()
    assert told.matrix is None
    turned = film(np.random.default_rng(1), true=PLAIN, sigma=0.0)
    free = dataclasses.replace(turned[0].free, intrinsics=np.eye(9)[:, [0, 2]])
    result = bundle_adjust(dataclasses.replace(turned[0].at(turned[1]), free=free))
    told = lens_covariance(dataclasses.replace(result, residual=result.residual + 0.3))
    assert np.isfinite(told.sigma).all()


def test_a_limit_is_kept_and_none_is_asked_for_what_is_not_free(rng: np.random.Generator) -> None:
    problem, _ = film(rng)
    loose = calibrate(problem)
    worst = max(loose.sigma, key=lambda name: loose.sigma[name] if name in ("cx", "cy") else 0.0)
    strict = calibrate(problem, most_shift_px=0.99 * loose.sigma[worst])
    assert worst in strict.refused
    assert strict.refused[worst].shift_px == pytest.approx(loose.sigma[worst], rel=0.3)
    some = self_calibrate(problem, ("fx", "fy"), SIZE, options=Options(cost=1e-9))
    assert set(some.sigma) == {"fx", "fy"}
    assert np.array_equal(some.camera.params[2:], GIVEN.params[2:])


def test_everything_refused_and_bad_names_are_told(rng: np.random.Generator) -> None:
    problem, _ = film(rng)
    nothing = calibrate(problem, most_shift_px=1e-9)
    assert nothing.reason == "the views determine no intrinsic"
    assert np.array_equal(nothing.camera.params, GIVEN.params)
    assert nothing.sigma == {}
    with pytest.raises(ValueError, match="omega"):
        self_calibrate(problem, ("omega",), SIZE)


def test_an_angle_of_a_wide_lens_is_found(rng: np.random.Generator) -> None:
    """The FOV camera: five intrinsics; errors below 4.3 sigma, rate 1e-4."""
    problem, truth = film(rng)
    true, given = Fov(400.0, 402.0, 322.0, 238.0, 0.93), Fov(392.0, 394.0, 319.5, 239.5, 0.85)
    at = true.pixel_from_world(truth.T_cam_world[problem.seen.view], truth.X_world[problem.seen.point])
    uv = at.uv + 0.3 * rng.standard_normal(at.uv.shape)
    rows = at.valid
    seen = Observations(problem.seen.view, problem.seen.point, uv).only(rows)
    start = Scene(truth.T_cam_world, truth.X_world, given.params[None])
    wide = fix_gauge(BundleProblem(Fov, start, seen))
    found = self_calibrate(wide, Fov.names(), SIZE, options=Options(cost=1e-9))
    assert set(found.sigma) == set(Fov.names())
    error = (found.camera.params - true.params) / np.array(list(found.sigma.values()))
    assert np.abs(error).max() < 4.3
