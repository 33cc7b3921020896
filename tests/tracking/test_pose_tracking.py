"""The reweighted pose: against SciPy, exact scenes, wrong matches, its covariance, and what it refuses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from scipy import integrate, optimize, stats

from vslam_ref.arrays import Array
from vslam_ref.estimation.pose_tracking import TrackedPose, _pinhole_weighed, _weighed, track_pose
from vslam_ref.estimation.robust import L2, covariance_factor, efficiency, tuned
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fov, Pinhole

PINHOLE = Pinhole(400.0, 410.0, 319.5, 239.5)
FOV = Fov(390.0, 380.0, 319.5, 239.5, 0.9)
FALSE_ALARM = 1e-3
"""Of each statistical test, both sides together."""


class Scene(NamedTuple):
    camera: Camera
    X: Array
    uv: Array
    T: Array
    s: Array


def scene(seed: int, n: int = 60, camera: Camera = PINHOLE, noise: float = 0.0) -> Scene:
    """Points in front of a camera that stands anywhere; noise in pixels of each point's level."""
    rng = np.random.default_rng(seed)
    T = se3.exp(rng.normal(0, [1, 1, 1, 0.5, 0.5, 0.5]))
    z = rng.uniform(2, 6, n)
    X_cam = np.column_stack([rng.uniform(-0.6, 0.6, n) * z, rng.uniform(-0.5, 0.5, n) * z, z])
    s = 2.0 ** rng.integers(0, 4, n)
    uv = camera.project(X_cam).uv + noise * s[:, None] * rng.standard_normal((n, 2))
    return Scene(camera, se3.act(se3.inverse(T), X_cam), uv, T, s)


def track(w: Scene, T_start: Array, **options: object) -> TrackedPose:
    return track_pose(w.camera, w.X, w.uv, T_start, sigma_px=w.s, **options)  # type: ignore[arg-type]


def away(found: Array, T: Array) -> Array:
    """Left perturbation from one pose to another."""
    return se3.log(se3.compose(found, se3.inverse(T)))


def residuals(w: Scene, xi: Array, T: Array) -> Array:
    """Predicted minus measured in pixels of the levels, (n, 2)."""
    return np.asarray((w.camera.pixel_from_world(se3.perturb(T, xi), w.X).uv - w.uv) / w.s[:, None])


@pytest.mark.parametrize("camera", [PINHOLE, FOV], ids=["pinhole", "fov"])
@pytest.mark.parametrize("seed", range(4))
def test_exact_matches_give_the_exact_pose(camera: Camera, seed: int) -> None:
    """Quadratic convergence to rounding: pixels have 1e-13 of 640, and a pixel is 1/400 radians."""
    w = scene(seed, camera=camera)
    start = se3.perturb(w.T, np.random.default_rng(seed).normal(0, 0.02, 6))
    found = track(w, start)
    assert found.reason == ""
    assert np.abs(away(found.T_cam_world, w.T)).max() < 1e-11
    assert found.sigma == 0.4
    assert found.weights.min() > 1 - 1e-12


@pytest.mark.parametrize("camera", [PINHOLE, FOV], ids=["pinhole", "fov"])
@pytest.mark.parametrize("name", ["tukey", "huber", "l2"])
def test_at_the_end_it_is_the_weighted_least_squares_of_scipy(camera: Camera, name: str) -> None:
    """With the weights of the end held fixed, SciPy (its own differences of the residuals) stays there.

    Three-point differences are good to 1e-9 or so of the Jacobian; enough steps for the weights to settle.
    """
    w = scene(11, camera=camera, noise=0.8)
    w.uv[::6] += np.random.default_rng(2).uniform(-40, 40, w.uv[::6].shape)
    loss = L2() if name == "l2" else tuned(name, 2)
    found = track(w, se3.perturb(w.T, np.full(6, 0.01)), loss=loss, steps=80)
    root = np.sqrt(found.weights)[:, None]
    there = optimize.least_squares(
        lambda xi: (root * residuals(w, xi, found.T_cam_world)).ravel(),
        np.zeros(6), jac="3-point", xtol=1e-14, ftol=1e-14, gtol=1e-12, x_scale=1e-3,
    )  # fmt: skip
    assert np.abs(there.x).max() < 1e-7
    weigh = covariance_factor(loss, 2)
    expected = weigh * found.sigma**2 * np.linalg.inv(there.jac.T @ there.jac)
    np.testing.assert_allclose(found.cov_pose, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())


def test_scale_and_weights_are_those_of_norms_in_the_plane() -> None:
    """0.8493 of the median, and nothing beyond 5.1230 of it: chapter 4's two constants, written out."""
    w = scene(5, noise=1.0)
    w.uv[:12] += 30 * w.s[:12, None]
    found = track(w, w.T, steps=30)
    x = np.hypot(*residuals(w, np.zeros(6), found.T_cam_world).T)
    sigma = np.median(x) / np.sqrt(2 * np.log(2))
    assert found.sigma == pytest.approx(sigma, rel=1e-12)
    expected = np.where(x < 5.1230 * sigma, (1 - (x / (5.1230 * sigma)) ** 2) ** 2, 0)
    np.testing.assert_allclose(found.weights, expected, atol=1e-4)  # of the five digits
    assert not found.inliers[:12].any()


@pytest.mark.parametrize("n", [3, 60])
def test_the_form_for_a_pinhole_is_the_one_for_any_lens(n: int) -> None:
    """Sums of n products, of size 1e6 at most, in another order: n eps of the largest entry, times ten."""
    w = scene(3, n, noise=0.7)
    X = w.X.copy()
    X[0] = se3.act(se3.inverse(w.T), [0.1, 0.2, -3.0])  # behind the camera
    w.uv[0] = w.camera.params[2:4]  # where a fast form might put it, with no error
    T, loss = se3.perturb(w.T, np.full(6, 0.01)), tuned("tukey", 2)
    a = _weighed(w.camera, X, w.uv, 1.0 / w.s, T, loss, 0.4)
    b = _pinhole_weighed(w.camera.params, X, w.uv, 1.0 / w.s, T, loss.c, 0.4)
    assert a.trouble == b.trouble
    for p, q in zip(a[:4], b[:4], strict=True):
        limit = 10 * n * np.finfo(float).eps * np.abs(p).max()
        np.testing.assert_allclose(p, q, rtol=0, atol=limit)


def test_wrong_matches_do_not_count_and_squares_fall_for_them() -> None:
    """30 % wrong by 10 to 60 pixels of their level: the pose is that of the others, within their noise."""
    w = scene(3, n=120, noise=0.5)
    rng = np.random.default_rng(4)
    turn = rng.uniform(0, np.pi, 36)  # all to one side, as when something moves
    w.uv[:36] += (rng.uniform(10, 60, 36) * w.s[:36])[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    start = se3.perturb(w.T, np.full(6, 0.01))
    robust, squares = track(w, start, steps=20), track(w, start, loss=L2(), steps=20)
    right = Scene(w.camera, w.X[36:], w.uv[36:], w.T, w.s[36:])
    alone = track(right, start, steps=20)
    assert not robust.inliers[:36].any()
    sd = np.sqrt(np.diag(alone.cov_pose))
    assert (np.abs(away(robust.T_cam_world, alone.T_cam_world)) < 0.5 * sd).all()
    assert (np.abs(away(squares.T_cam_world, w.T)) / sd).max() > 10


def test_the_error_is_predicted_minus_measured() -> None:
    """One step takes a small error away; the step with the other sign would double it."""
    w = scene(6)
    xi = np.array([0.004, -0.003, 0.002, 0.001, 0.002, -0.002])
    start = se3.perturb(w.T, xi)
    step = away(track(w, start, steps=1).T_cam_world, start)
    after = away(se3.perturb(start, step), w.T)
    flipped = away(se3.perturb(start, -step), w.T)
    assert np.linalg.norm(after) < 0.05 * np.linalg.norm(xi)
    assert np.linalg.norm(flipped) > 1.9 * np.linalg.norm(xi)


@pytest.mark.parametrize("camera", [PINHOLE, FOV], ids=["pinhole", "fov"])
def test_the_step_has_the_jacobian_of_numeric_differences(camera: Camera) -> None:
    """One step, made by hand from central differences of the projection (good to 1e-8 at h = 1e-5)."""
    w = scene(7, camera=camera, noise=0.6)
    start = se3.perturb(w.T, np.full(6, 0.003))
    h = 1e-5
    columns = [residuals(w, h * d, start) - residuals(w, -h * d, start) for d in np.eye(6)]
    J = np.stack(columns, -1) / (2 * h)
    e = residuals(w, np.zeros(6), start)
    x = np.hypot(*e.T)
    c = tuned("tukey", 2).c * max(0.4, np.median(x) / np.sqrt(2 * np.log(2)))
    weight = np.where(x < c, (1 - (x / c) ** 2) ** 2, 0)
    H = np.einsum("n,nai,naj->ij", weight, J, J)
    mu = -np.linalg.solve(H, np.einsum("n,nai,na->i", weight, J, e))
    assert np.abs(away(track(w, start, steps=1).T_cam_world, start) - mu).max() < 1e-8


def nees(loss: object, runs: int) -> tuple[Array, Array]:
    """Squared errors by the covariance with the true scale, and estimated scales, of many noisy scenes."""
    exact, values, scales = scene(9, n=150), [], []
    rng = np.random.default_rng(10)
    for _ in range(runs):
        noise = exact.s[:, None] * rng.standard_normal((150, 2))
        w = exact._replace(uv=exact.uv + noise)
        found = track(w, w.T, loss=loss, steps=6)
        d = away(found.T_cam_world, w.T)
        values.append(d @ np.linalg.solve(found.cov_pose / found.sigma**2, d))
        scales.append(found.sigma)
    return np.array(values), np.array(scales)


def test_the_covariance_of_squares_is_the_spread_of_the_poses() -> None:
    """Sum of 6 x 100 squared Gaussians: chi-square, both sides; and the scale that goes with it.

    Median of norms: standard deviation 0.72 / sqrt(150) each; a fit of 6 numbers to 300 takes 1 % of it.
    """
    values, scales = nees(L2(), 100)
    low, high = stats.chi2.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], 6 * len(values))
    assert low < values.sum() < high
    error = stats.norm.ppf(1 - FALSE_ALARM / 2) * 0.72 / np.sqrt(150 * len(scales))
    assert abs(scales.mean() - 0.99) < error + 0.005


@pytest.mark.parametrize("name", ["tukey", "huber"])
def test_the_covariance_of_a_robust_pose_is_the_spread_of_the_poses(name: str) -> None:
    """H counts a measurement by its weight, E w; it is worth B^2 / A, the efficiency of chapter 4.

    A chi-square band for 300 runs, both sides; and beside squares of the same noise, whose covariance is
    known to be right: what both have in common cancels, and a tenth shows.
    """
    loss = tuned(name, 2)
    mean_weight = integrate.quad(lambda r: loss.weight(r) * r * np.exp(-r * r / 2), 0, 12, points=[loss.c])[0]
    factor = covariance_factor(loss, 2)
    assert factor == pytest.approx(mean_weight / efficiency(loss, 2), rel=1e-9)
    values, squares = nees(loss, 300)[0], nees(L2(), 300)[0]
    low, high = stats.chi2.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], 6 * len(values))
    assert low < values.sum() < high
    apart = stats.norm.ppf(1 - FALSE_ALARM / 2) * np.std(values - squares) / np.sqrt(len(values))
    assert abs(values.mean() - squares.mean()) < apart
    assert abs(factor * values.mean() - squares.mean()) > apart  # the covariance of weights alone


@pytest.mark.parametrize("n", [0, 1, 3])
def test_too_few_points_give_a_reason_and_the_start(n: int) -> None:
    w = scene(1, n=max(n, 1))
    w = w._replace(X=w.X[:n], uv=w.uv[:n], s=w.s[:n])
    found = track(w, w.T)
    assert "4" in found.reason
    np.testing.assert_array_equal(found.T_cam_world, w.T)
    assert np.isinf(np.diag(found.cov_pose)).all()


def test_points_on_a_line_or_at_one_place_give_a_reason() -> None:
    """The camera may turn around the line."""
    for X in (np.linspace([-1.0, 0, 4], [1.0, 0.5, 5], 20), np.tile([0.2, 0.1, 4.0], (20, 1))):
        found = track_pose(PINHOLE, X, PINHOLE.project(X).uv, np.eye(4))
        assert found.reason == "the points do not determine the pose"


def test_points_behind_the_camera_have_no_weight() -> None:
    w = scene(2)
    X = w.X.copy()
    X[:5] = se3.act(se3.inverse(w.T), np.array([0.1, 0.2, -3.0]))
    found = track(w._replace(X=X), se3.perturb(w.T, np.full(6, 0.005)))
    assert found.reason == ""
    assert not found.inliers[:5].any()
    assert np.abs(away(found.T_cam_world, w.T)).max() < 1e-11
    assert "0 measurements" in track(w._replace(X=np.tile(X[:1], (len(X), 1))), w.T).reason


@pytest.mark.parametrize(
    ("change", "needed"),
    [
        ({"uv": np.zeros((3, 2))}, r"\(N, 2\)"),
        ({"sigma_px": 0.0}, "more than 0"),
        ({"sigma_px": -1.0}, "more"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, object], needed: str) -> None:
    w = scene(0)
    given = {"uv": w.uv, "sigma_px": w.s} | change
    with pytest.raises(ValueError, match=needed):
        track_pose(w.camera, w.X, given.pop("uv"), w.T, **given)  # type: ignore[arg-type]
