"""Points from views: exact without noise, optimal with it, honest about its covariance and its failures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest

from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Fisheye, Fov, Pinhole, Radtan
from vslam_ref.geometry.multiview import PointState, Views, triangulate_linear

EPS = float(np.finfo(float).eps)


def pinhole_matrices(views: Views) -> np.ndarray:
    return np.array([c.matrix @ T[:3] for c, T in zip(views.each, views.T_cam_world, strict=True)])


def written_out(P: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Pixels (V, 2) of one point by projection matrices: nothing of the package in it."""
    h = P[:, :, :3] @ X + P[:, :, 3]
    return h[:, :2] / h[:, 2:]


def test_without_noise_the_points_are_found_with_every_lens(lens_scene: Any) -> None:
    views, X, uv = lens_scene
    rays = views.rays(uv)
    linear = triangulate_linear(views.T_cam_world, rays.bearing)
    optimal = triangulate(views, uv)
    # a bearing is known to some eps times the pixel over the focal length and, for a lens with an iterated
    # inverse, to 4 eps; distance 6 and the parallax of 0.6 rad multiply it by 10 or so
    np.testing.assert_allclose(linear.X_world, X, rtol=0, atol=500 * EPS)
    np.testing.assert_allclose(optimal.X_world, X, rtol=0, atol=500 * EPS)
    assert optimal.ok.all()
    assert (optimal.rmse_px < 1e-11).all()


def test_lenses_may_be_mixed(make: Callable[..., Any]) -> None:
    scene = make("pinhole", views=4)
    cameras = [
        Pinhole(500.0, 500.0, 320.0, 240.0),
        Fov(300.0, 300.0, 320.0, 240.0, 0.9),
        Radtan(450.0, 450.0, 320.0, 240.0, -0.2, 0.05, 1e-4, 2e-4, 0.0),
        Fisheye(250.0, 250.0, 320.0, 240.0, 0.01, -0.01, 0.0, 0.0),
    ]
    views = Views(cameras, scene.views.T_cam_world)
    found = triangulate(views, views.project(scene.X).uv)
    assert found.ok.all()
    np.testing.assert_allclose(found.X_world, scene.X, rtol=0, atol=500 * EPS)


def test_what_is_masked_out_plays_no_part(make: Callable[..., Any]) -> None:
    views, _, uv = make("radtan", views=5)
    uv = uv + np.random.default_rng(1).normal(0, 0.5, uv.shape)
    mask = np.ones(uv.shape[:2], dtype=bool)
    mask[:, [1, 4]] = False
    spoilt = np.where(mask[..., None], uv, np.nan)
    some, few = triangulate(views, spoilt, mask), triangulate(views.only([0, 2, 3]), uv[:, [0, 2, 3]])
    # the linear starts are scaled by other camera centres; both end within 1e-8 standard deviations
    sigma = np.sqrt(np.einsum("nii->ni", few.cov_X))
    assert (np.abs(some.X_world - few.X_world) < 1e-7 * sigma).all()
    np.testing.assert_allclose(some.cov_X, few.cov_X, rtol=1e-6)


def test_one_at_a_time_or_all_at_once(make: Callable[..., Any]) -> None:
    views, _, uv = make("fov")
    uv = uv + np.random.default_rng(2).normal(0, 0.5, uv.shape)
    together = triangulate(views, uv)
    alone = [triangulate(views, uv[k : k + 1]) for k in range(len(uv))]
    np.testing.assert_allclose(
        together.X_world, np.concatenate([a.X_world for a in alone]), rtol=0, atol=1e-12
    )
    assert together.iterations.tolist() == [int(a.iterations[0]) for a in alone]


def test_the_linear_point_does_not_depend_on_the_worlds_frame_or_unit(make: Callable[..., Any]) -> None:
    views, _, uv = make("pinhole")
    bearings = views.rays(uv + np.random.default_rng(3).normal(0, 1.0, uv.shape)).bearing
    T_world_new, scale = se3.exp([300.0, -200.0, 50.0, 1.0, -0.4, 2.0]), 1e-3
    moved = se3.compose(views.T_cam_world, T_world_new)  # cameras of the new world
    moved[:, :3, 3] *= scale
    here = triangulate_linear(views.T_cam_world, bearings).X_world
    there = triangulate_linear(moved, bearings).X_world
    back = se3.act(T_world_new, there / scale)
    # coordinates of 400 and a bearing's 10 eps at a parallax of 0.6 rad
    np.testing.assert_allclose(back, here, rtol=0, atol=400 * 50 * EPS)


def test_the_linear_point_is_the_null_vector_at_forty_digits(scene: Any) -> None:
    views, _, uv = scene
    T = views.T_cam_world
    bearings = views.rays(uv + np.random.default_rng(4).normal(0, 1.0, uv.shape)).bearing
    found = triangulate_linear(T, bearings).X_world
    centres = views.centres
    middle = centres.mean(axis=0)
    size = np.sqrt(np.mean(np.sum((centres - middle) ** 2, axis=1)))
    for n in range(3):
        with mpmath.workdps(40):
            rows = mpmath.matrix(0, 4)
            total = mpmath.zeros(4)
            for v in range(len(T)):
                R = mpmath.matrix(T[v, :3, :3].tolist())
                t = -R * mpmath.matrix(((centres[v] - middle) / size).tolist())
                b = mpmath.matrix(bearings[n, v].tolist())
                skew = mpmath.matrix([[0, -b[2], b[1]], [b[2], 0, -b[0]], [-b[1], b[0], 0]])
                P = mpmath.matrix(3, 4)
                P[:, 0:3], P[:, 3] = R, t
                rows = skew * P  # the cross product has the singular values of two rows across b
                total += rows.T * rows
            _, vectors = mpmath.eigsy(total)
            h = [float(vectors[k, 0] / vectors[3, 0]) for k in range(3)]
        np.testing.assert_allclose(found[n], size * np.array(h) + middle, rtol=0, atol=500 * EPS)


@pytest.mark.parametrize("views", [2, 3, 6])
def test_the_optimum_is_scipys(make: Callable[..., Any], views: int) -> None:
    from scipy.optimize import least_squares

    scene = make("pinhole", views=views, points=8)
    uv = scene.uv + np.random.default_rng(5).normal(0, 1.0, scene.uv.shape)
    found, P = triangulate(scene.views, uv), pinhole_matrices(scene.views)
    assert found.ok.all()
    assert (found.iterations > 0).all()
    for n in range(len(uv)):
        theirs = least_squares(
            lambda x, n=n: (written_out(P, x) - uv[n]).ravel(), scene.X[n], xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        # SciPy's differences leave a gradient of 1e-7, and the cost is flat at its bottom: half of the digits
        np.testing.assert_allclose(found.X_world[n], theirs.x, rtol=0, atol=1e-6)
        mine = 0.5 * views * found.rmse_px[n] ** 2
        assert mine <= theirs.cost * (1 + 1e-12)


def test_opencv_finds_the_same_points_without_noise(scene: Any) -> None:
    cv2 = pytest.importorskip("cv2")
    P = pinhole_matrices(scene.views)
    h = cv2.triangulatePoints(P[0], P[2], scene.uv[:, 0].T, scene.uv[:, 2].T)
    theirs = (h[:3] / h[3]).T
    found = triangulate(scene.views.only([0, 2]), scene.uv[:, [0, 2]])
    np.testing.assert_allclose(
        found.X_world, theirs, rtol=0, atol=1e-9
    )  # OpenCV's is in pixels: 500 times eps


def test_no_small_step_is_better(lens_scene: Any) -> None:
    """The minimum itself, not the derivative that led there."""
    views, _, uv = lens_scene
    uv = uv + np.random.default_rng(6).normal(0, 0.7, uv.shape)
    found = triangulate(views, uv)
    best = np.sum((views.project(found.X_world).uv - uv) ** 2, axis=(1, 2))
    sigma = np.sqrt(np.einsum("nii->ni", found.cov_X))
    for k in range(3):
        for sign in (-1.0, 1.0):
            step = sign * 1e-3 * sigma[:, k : k + 1] * np.eye(3)[k]
            there = np.sum((views.project(found.X_world + step).uv - uv) ** 2, axis=(1, 2))
            assert (there > best).all()


def test_the_covariance_is_that_of_many_draws() -> None:
    """2000 noises; the sum of their NEES is chi-squared with 6000 degrees of freedom.

    The band holds it with probability 0.9999 (normal approximation, 3.89 standard deviations); curvature
    adds some sigma^2 (noise over depth) ~ 1e-3 of it.
    """
    T = np.array([se3.identity(), se3.exp([-0.8, 0.1, 0.0, 0.05, -0.2, 0.1])])
    views = Views(Fov(300.0, 310.0, 320.0, 240.0, 0.93), T)
    X, sigma = np.array([0.3, -0.2, 4.0]), np.array([0.2, 0.4])  # one camera is twice as good
    draws = 2000
    noise = np.random.default_rng(7).normal(size=(draws, 2, 2)) * sigma[:, None]
    found = triangulate(views, views.project(X[None]).uv + noise, sigma_px=sigma)
    assert found.ok.all()
    error = found.X_world - X
    nees = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.cov_X), error)
    assert abs(nees.sum() - 3 * draws) < 3.89 * np.sqrt(2 * 3 * draws)
    # and each axis: a variance from 2000 draws is known to 3.2 %, 3.89 of that is 12 %
    np.testing.assert_allclose(error.var(axis=0), np.diag(found.cov_X.mean(axis=0)), rtol=0.125)


def test_depth_is_known_as_the_stereo_formula_says() -> None:
    f, B, Z, sigma = 500.0, 0.2, 4.0, 0.3
    views = Views(Pinhole(f, f, 320.0, 240.0), [se3.identity(), se3.exp([-B, 0, 0, 0, 0, 0])])
    found = triangulate(views, views.project([[0.0, 0.0, Z]]).uv, sigma_px=sigma)
    depth = Z**2 / (f * B) * np.sqrt(2) * sigma
    np.testing.assert_allclose(np.sqrt(found.cov_X[0, 2, 2]), depth, rtol=1e-9)
    np.testing.assert_allclose(np.sqrt(found.cov_X[0, 1, 1]), Z / f * sigma / np.sqrt(2), rtol=1e-9)
    assert found.parallax[0] == pytest.approx(np.arctan(B / Z), rel=1e-12)


def test_the_parallax_is_the_widest_angle_at_the_point(make: Callable[..., Any]) -> None:
    views, X, uv = make("pinhole", views=4)
    found, centres = triangulate(views, uv), views.centres
    for n in range(len(X)):
        arrows = centres - X[n]
        arrows /= np.linalg.norm(arrows, axis=1, keepdims=True)
        widest = np.arccos((arrows @ arrows.T).min())
        # the arc cosine loses eps / sin(angle), the angles are half a radian and more
        assert found.parallax[n] == pytest.approx(widest, rel=1e-13)


PAIR = np.array([se3.identity(), se3.exp([-1.0, 0, 0, 0, 0, 0])])


def pair(X: list[float], **options: Any) -> tuple[int, np.ndarray]:
    """State and point from exact rays of two cameras side by side."""
    X_cam = se3.act(PAIR, np.array(X))
    b = X_cam / np.linalg.norm(X_cam, axis=-1, keepdims=True)
    found = triangulate_linear(PAIR, b[None], **options)
    return int(found.state[0]), found.X_world[0]


def test_every_state_has_its_case() -> None:
    assert pair([0.3, 0.1, 5.0])[0] == PointState.OK
    assert pair([0.3, 0.1, 200.0])[0] == PointState.SMALL_PARALLAX
    assert pair([0.3, 0.1, 200.0], min_parallax=0.001)[0] == PointState.OK
    assert pair([0.4, 0.0, 0.0])[0] == PointState.NO_DEPTH  # on the baseline
    b = np.array([[[0.1, 0.2, 1.0], [0.1, 0.2, 1.0]]]) / np.linalg.norm([0.1, 0.2, 1.0])
    assert triangulate_linear(PAIR, b).state[0] == PointState.NO_DEPTH  # parallel: at infinity
    assert triangulate_linear(PAIR[[0, 0]], b).state[0] == PointState.NO_DEPTH  # one centre
    assert triangulate_linear(PAIR[:1], b[:, :1]).state[0] == PointState.TOO_FEW
    one = np.array([[True, False]])
    assert triangulate_linear(PAIR, b, one).state[0] == PointState.TOO_FEW


def test_rays_that_meet_behind_are_told() -> None:
    X_cam = se3.act(PAIR, np.array([0.3, 0.1, -5.0]))
    b = -X_cam / np.linalg.norm(X_cam, axis=-1, keepdims=True)  # the pixels of a point that is not there
    found = triangulate_linear(PAIR, b[None])
    assert found.state[0] == PointState.BEHIND
    np.testing.assert_allclose(found.X_world[0], [0.3, 0.1, -5.0], atol=1e-12)


def test_a_fisheye_sees_points_beside_and_behind_its_plane() -> None:
    """z < 0 is not behind for a lens of more than half a space: the ray decides."""
    lens = Fisheye(200.0, 200.0, 320.0, 240.0, 0.0, 0.0, 0.0, 0.0)
    views, X = Views(lens, PAIR), np.array([[0.5, 2.0, -0.4]])
    seen = views.project(X)
    assert seen.valid.all()
    found = triangulate(views, seen.uv)
    assert found.ok.all()
    np.testing.assert_allclose(found.X_world, X, atol=500 * EPS)


def test_pixels_without_a_ray_are_told() -> None:
    lens = Fov(200.0, 200.0, 320.0, 240.0, 1.2)
    views = Views(lens, PAIR)
    edge = 200.0 * np.pi / 2 / 1.2 + 1  # outside the circle of the FOV camera
    found = triangulate(views, [[[320.0 + edge, 240.0], [300.0, 240.0]]])
    assert found.state[0] == PointState.NO_RAY
    assert np.isinf(np.diag(found.cov_X[0])).all()
    assert np.isfinite(found.X_world).all()


def test_no_state_leaves_a_nan() -> None:
    rng = np.random.default_rng(8)
    views = Views(Pinhole(500.0, 500.0, 320.0, 240.0), PAIR)
    found = triangulate(views, rng.uniform(-3000, 3000, (2000, 2, 2)))  # most of it nonsense
    assert set(np.unique(found.state)) >= {PointState.OK, PointState.BEHIND}
    assert np.isfinite(found.X_world).all()
    assert not np.isnan(found.cov_X).any()
    assert not np.isnan(found.rmse_px).any()
    assert all(state.reason or state is PointState.OK for state in PointState)


def test_a_search_that_is_cut_short_is_told() -> None:
    views = Views(Pinhole(500.0, 500.0, 320.0, 240.0), PAIR)
    found = triangulate(
        views, [[[320.0, 250.0], [220.0, 230.0]], [[300.0, 270.0], [190.0, 230.0]]], max_iterations=0
    )
    assert found.state.tolist() == [PointState.NOT_CONVERGED] * 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"uv": np.zeros((4, 3, 2))}, r"uv has shape \(4, 3, 2\): need \(N, 2, 2\)"),
        ({"uv": np.full((4, 2, 2), np.nan)}, "pixel of point 0 in view 0"),
        ({"uv": np.full((4, 2, 2), np.inf)}, "must be finite, or masked out"),
        ({"mask": np.ones((4, 3), bool)}, "mask is bool of shape"),
        ({"mask": np.ones((4, 2))}, "mask is float64"),
        ({"sigma_px": 0.0}, "sigma_px must be finite and more than 0"),
        ({"sigma_px": np.nan}, "sigma_px must be finite"),
    ],
)
def test_bad_input_is_refused(change: dict[str, Any], words: str) -> None:
    views = Views(Pinhole(500.0, 500.0, 320.0, 240.0), PAIR)
    with pytest.raises(ValueError, match=words):
        triangulate(views, **({"uv": np.zeros((4, 2, 2))} | change))


def test_bad_views_and_bearings_are_refused() -> None:
    lens = Pinhole(500.0, 500.0, 320.0, 240.0)
    with pytest.raises(ValueError, match="3 cameras for 2 poses"):
        Views([lens] * 3, PAIR)
    with pytest.raises(ValueError, match="pose 1 is not finite"):
        Views(lens, np.array([np.eye(4), np.full((4, 4), np.nan)]))
    with pytest.raises(ValueError, match=r"need \(V, 4, 4\)"):
        Views(lens, np.eye(4))
    with pytest.raises(ValueError, match=r"bearing of point 0 in view 1 is .*unit vector"):
        triangulate_linear(PAIR, [[[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]]])
    with pytest.raises(ValueError, match="need"):
        triangulate_linear(PAIR, np.zeros((4, 3, 3)))


def test_no_points_are_no_trouble() -> None:
    views = Views(Pinhole(500.0, 500.0, 320.0, 240.0), PAIR)
    assert triangulate(views, np.zeros((0, 2, 2))).X_world.shape == (0, 3)
