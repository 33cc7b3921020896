"""A camera from its points: linear starts, the refined pose, and what is wrong when there is none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vslam_ref.estimation.least_squares import Options
from vslam_ref.estimation.resection import refine_pose, refine_pose_robust, resect
from vslam_ref.estimation.robust import tuned
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan
from vslam_ref.geometry.multiview import PoseState, dlt, planar_dlt, resect_linear, tilted_twin

LENS = Pinhole(500.0, 520.0, 320.0, 240.0)
WIDE: list[Camera] = [
    LENS,
    Fov(300.0, 310.0, 320.0, 240.0, 0.93),
    Radtan(458.0, 457.0, 367.0, 248.0, -0.28, 0.07, 2e-4, 1e-4, 0.0),
    Fisheye(200.0, 205.0, 320.0, 240.0, -0.01, 0.02, -0.01, 0.002),
]


def unit(X: np.ndarray) -> np.ndarray:
    return X / np.linalg.norm(X, axis=-1, keepdims=True)


def box(
    count: int, rng: np.random.Generator, flat: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pose, world points, and the same in the camera; a turned plane if flat."""
    T = se3.random(rng, spread=3.0)
    X_cam = rng.uniform(-1, 1, (count, 3))
    if flat:
        X_cam[:, 2] = 0.0
        X_cam = so3.act(so3.exp(rng.uniform(-1, 1, 3)), X_cam)
    X_cam = X_cam + [0, 0, 4]
    return T, se3.act(se3.inverse(T), X_cam), X_cam


@pytest.mark.parametrize(
    ("count", "flat", "method"),
    [
        (6, False, "dlt"),
        (30, False, "dlt"),
        (4, True, "planar"),
        (12, True, "planar"),
        (4, False, "p3p"),
        (5, False, "p3p"),
    ],
)
def test_without_noise_the_linear_pose_is_the_pose(count: int, flat: bool, method: str) -> None:
    rng = np.random.default_rng(count)
    errors = []
    for _ in range(100):
        T, X, X_cam = box(count, rng, flat)
        found = resect_linear(unit(X_cam), X)
        if not flat and found.method == "planar":  # four random points may be nearly flat
            continue
        assert found.method == method
        assert found.ok, found.reason
        errors.append(np.abs(found.T_cam_world - T).max())
    assert len(errors) > 95
    # coordinates of 5 times eps, times the condition of four points in general position, 1e5 at worst in 100
    assert max(errors) < 1e-9
    assert np.median(errors) < 1e-12


def test_the_linear_pose_is_good_enough_to_start_from() -> None:
    """With a pixel of noise: within the reach of the refinement, and not optimal."""
    rng = np.random.default_rng(1)
    ratio = []
    for flat in (False, True):
        for _ in range(20):
            _, X, X_cam = box(20, rng, flat)
            uv = LENS.project(X_cam).uv + rng.normal(0, 1.0, (20, 2))
            start = resect_linear(LENS.unproject(uv).bearing, X)
            assert start.ok
            found = refine_pose(LENS, X, uv, start.T_cam_world)
            assert found.converged, found.reason
            assert found.iterations > 0
            at_start = np.sqrt(np.mean(np.sum((LENS.pixel_from_world(start.T_cam_world, X).uv - uv) ** 2, 1)))
            ratio.append(at_start / found.rmse_px)
            assert found.rmse_px < 2.0
    assert min(ratio) > 1.0


@pytest.mark.parametrize("lens", WIDE, ids=lambda lens: type(lens).__name__)
def test_the_refined_pose_is_scipys(lens: Camera) -> None:
    from scipy.optimize import least_squares

    rng = np.random.default_rng(2)
    T, X, X_cam = box(15, rng)
    uv = lens.project(X_cam).uv + rng.normal(0, 0.5, (15, 2))
    start = se3.perturb(T, [0.2, -0.1, 0.3, 0.1, 0.15, -0.1])
    found = refine_pose(lens, X, uv, start)

    def residual(x: np.ndarray) -> np.ndarray:  # rotation vector and translation, added: not our coordinates
        return (lens.project(so3.act(so3.exp(x[3:]), X) + x[:3]).uv - uv).ravel()

    theirs = least_squares(residual, [*T[:3, 3], *so3.log(T[:3, :3])], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert found.converged
    assert found.iterations > 0
    # a flat bottom, and SciPy's differences: half of the digits
    np.testing.assert_allclose(found.T_cam_world[:3, 3], theirs.x[:3], atol=2e-6)
    np.testing.assert_allclose(found.T_cam_world[:3, :3], so3.exp(theirs.x[3:]), atol=2e-6)
    assert found.solution is not None
    assert found.solution.cost <= theirs.cost * (1 + 1e-12)


def test_without_noise_opencvs_linear_method_has_the_same_pose() -> None:
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(13)
    for _ in range(10):
        _, X, X_cam = box(12, rng)
        done, rotation, t = cv2.solvePnP(
            X, LENS.project(X_cam).uv, LENS.matrix, None, flags=cv2.SOLVEPNP_EPNP
        )
        found = resect_linear(unit(X_cam), X)
        assert done
        # EPnP works with normal equations: half of the digits
        np.testing.assert_allclose(found.T_cam_world[:3, :3], cv2.Rodrigues(rotation)[0], atol=1e-6)
        np.testing.assert_allclose(found.T_cam_world[:3, 3], t.ravel(), atol=1e-5)


TILE = np.array([[x, y, 0.0] for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)])


def seen_tile(distance: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A tile of 2 m, tilted by some 0.3 radians each way, with half a pixel of noise."""
    tilt = se3.exp([*np.zeros(3), *rng.normal(0, 0.35, 3)])
    T = se3.compose(se3.exp([0.3, 0.2, distance, 0, 0, 0]), tilt)
    return T, LENS.pixel_from_world(T, TILE).uv + rng.normal(0, 0.5, (9, 2))


def test_of_two_tilts_the_better_one_is_taken() -> None:
    """No start of a fan of tilts ends lower."""
    rng = np.random.default_rng(12)
    for _ in range(6):
        T, uv = seen_tile(20.0, rng)
        found = resect(LENS, TILE, uv)
        assert found.converged
        assert found.solution is not None
        about = so3.exp([0, 0, so3.log(T[:3, :3])[2]])
        for angle in np.linspace(0, 2 * np.pi, 5, endpoint=False):
            tilt = so3.exp([0.6 * np.cos(angle), 0.6 * np.sin(angle), 0.0]) @ about
            other = refine_pose(LENS, TILE, uv, se3.from_rt(tilt, T[:3, 3]))
            assert other.solution is not None
            assert found.solution.cost <= other.solution.cost * (1 + 1e-9)


def test_the_rival_tells_where_the_tilt_is_a_guess() -> None:
    """Near by the other tilt is clearly worse; far away it is as good, and sometimes the truth."""
    rng = np.random.default_rng(13)
    rivals, off = [], []
    for distance in (6.0, 30.0):
        found = [(T, resect(LENS, TILE, uv)) for T, uv in (seen_tile(distance, rng) for _ in range(25))]
        rivals.append(np.median([min(f.rival, 1e6) for _, f in found]))
        turns = [np.linalg.norm(so3.log(f.T_cam_world[:3, :3] @ T[:3, :3].T)) for T, f in found]
        off.append(np.mean(np.array(turns) > 0.25))
        assert all(f.rival >= 1.0 for _, f in found)
    assert rivals[0] > 10.0
    assert rivals[1] < 2.0
    assert off[0] == 0.0
    assert off[1] > 0.05
    _, X, X_cam = box(12, rng)
    assert resect(LENS, X, LENS.project(X_cam).uv).rival == np.inf


def test_the_twin_shows_nearly_the_same_picture() -> None:
    """Relative to the size of the image the difference falls as one over the distance."""
    off = []
    for distance in (20.0, 40.0):
        T = se3.compose(se3.exp([0.5, -0.3, distance, 0, 0, 0]), se3.exp([0, 0, 0, 0.5, 0.2, 0.1]))
        twin = tilted_twin(T, TILE)
        assert np.linalg.norm(so3.log(twin[:3, :3] @ T[:3, :3].T)) > 0.5  # another pose
        np.testing.assert_allclose(twin[:3, :3] @ twin[:3, :3].T, np.eye(3), atol=1e-14)
        assert np.linalg.det(twin) > 0
        np.testing.assert_allclose(tilted_twin(twin, TILE), T, atol=1e-12)  # and the twin's twin is the first
        here, there = (LENS.pixel_from_world(pose, TILE).uv for pose in (T, twin))
        off.append(np.abs(there - here).max() / np.ptp(here, axis=0).max())
    assert off[0] < 0.05
    assert off[0] / off[1] == pytest.approx(2.0, rel=0.1)


def test_opencv_ends_at_the_same_pose() -> None:
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(3)
    for flat in (False, True):
        _, X, X_cam = box(20, rng, flat)
        uv = LENS.project(X_cam).uv + rng.normal(0, 0.3, (20, 2))
        found = resect(LENS, X, uv)
        done, rotation, t = cv2.solvePnP(X, uv, LENS.matrix, None, flags=cv2.SOLVEPNP_ITERATIVE)
        rotation, t = cv2.solvePnPRefineLM(X, uv, LENS.matrix, None, rotation, t)
        assert done
        # OpenCV stops when a step is below 1e-7 or so
        np.testing.assert_allclose(found.T_cam_world[:3, :3], cv2.Rodrigues(rotation)[0], atol=1e-5)
        np.testing.assert_allclose(found.T_cam_world[:3, 3], t.ravel(), atol=1e-4)


def test_the_covariance_is_that_of_many_draws() -> None:
    """150 noises: the sum of their NEES is chi-squared, 900 degrees of freedom; 3.89 of its deviations."""
    rng = np.random.default_rng(4)
    T, X, X_cam = box(25, rng)
    sigma = np.where(np.arange(25) < 12, 0.2, 0.8)
    exact, total = LENS.project(X_cam).uv, 0.0
    for _ in range(150):
        uv = exact + rng.normal(size=(25, 2)) * sigma[:, None]
        found = refine_pose(LENS, X, uv, T, sigma_px=sigma)
        assert found.cov_pose is not None
        error = se3.log(se3.compose(found.T_cam_world, se3.inverse(T)))  # left, as the covariance
        total += error @ np.linalg.solve(found.cov_pose, error)
    assert abs(total - 900) < 3.89 * np.sqrt(2 * 900)


def spoilt(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    T, X, X_cam = box(60, rng)
    uv = LENS.project(X_cam).uv + rng.normal(0, 0.3, (60, 2))
    uv[:18] = uv[np.roll(np.arange(18), 1)]  # wrong matches: pixels of other points
    return T, X, uv, se3.perturb(T, [0.1, -0.1, 0.2, 0.05, 0.05, -0.1])


def test_wrong_matches_are_given_up_and_least_squares_follows_them() -> None:
    rng = np.random.default_rng(5)
    for _ in range(10):
        T, X, uv, start = spoilt(rng)
        robust, plain = refine_pose_robust(LENS, X, uv, start), refine_pose(LENS, X, uv, start)
        assert robust.converged, robust.reason
        assert robust.iterations > 0
        assert robust.inliers[18:].mean() > 0.9
        assert robust.inliers[:18].sum() <= 1  # two neighbours may be close by chance
        errors = [np.abs(se3.log(se3.compose(f.T_cam_world, se3.inverse(T)))).max() for f in (robust, plain)]
        # 42 honest points of 0.3 px at 4 m and 500 px: some 1 mm; a third of all off by 100 px: decimetres
        assert errors[0] < 0.01
        assert errors[1] > 0.05


def test_a_picture_of_something_else_does_not_look_like_success() -> None:
    """Every match wrong: some pose comes out, and its error says that it is none."""
    rng = np.random.default_rng(11)
    T, X, X_cam = box(60, rng)
    uv = LENS.project(X_cam).uv[np.roll(np.arange(60), 7)]
    found = refine_pose_robust(LENS, X, uv, T)
    assert np.isfinite(found.T_cam_world).all()
    assert found.rmse_px > 20  # honest ones have 0.3


def test_tukey_alone_does_not_come_home_from_afar() -> None:
    """Why there is a first pass: beyond its cut the loss is flat."""
    rng = np.random.default_rng(6)
    T, X, uv, start = spoilt(rng)
    alone = refine_pose(LENS, X, uv, start, loss=tuned("tukey", 2), sigma_px=0.3)
    assert np.abs(se3.log(se3.compose(alone.T_cam_world, se3.inverse(T)))).max() > 0.05


def test_points_that_say_too_little_are_told() -> None:
    rng = np.random.default_rng(7)
    line = np.outer(np.arange(1.0, 9.0), [0.1, 0.2, 0.3]) + [0, 0, 4]
    assert dlt(unit(line), line).state is PoseState.COLLINEAR
    assert planar_dlt(unit(line), line).state is PoseState.COLLINEAR
    assert resect_linear(unit(line), line).state is PoseState.COLLINEAR
    _, X, X_cam = box(9, rng, flat=True)
    assert dlt(unit(X_cam), X).state is PoseState.COPLANAR
    _, X, X_cam = box(9, rng)
    assert planar_dlt(unit(X_cam), X).state is PoseState.NOT_COPLANAR
    assert dlt(unit(X_cam[:5]), X[:5]).state is PoseState.TOO_FEW
    assert resect_linear(unit(X_cam[:3]), X[:3]).state is PoseState.TOO_FEW
    assert resect_linear(unit(X_cam[:0]), X[:0]).state is PoseState.TOO_FEW
    same = np.tile(X_cam[:1], (8, 1))
    assert resect_linear(unit(same), np.tile(X[:1], (8, 1))).state is PoseState.ONE_PLACE
    three_on_a_line = np.array([[0, 0, 4], [1, 0, 4], [2, 0, 4], [0, 1, 4.0]])
    assert planar_dlt(unit(three_on_a_line), three_on_a_line).state is PoseState.AMBIGUOUS
    assert all(state.value or state is PoseState.OK for state in PoseState)


def test_points_on_a_twisted_cubic_through_the_centre_are_ambiguous() -> None:
    """The classical degenerate set of the twelve-number DLT, centre included."""
    s = np.linspace(0.4, 2.0, 12)
    X = np.stack([s**3, s**2, s], 1)  # through the origin, where the camera stands
    T = se3.from_rt(so3.exp([0.2, -0.3, 0.1]), np.zeros(3))
    found = dlt(unit(se3.act(T, X)), X)
    assert found.state is PoseState.AMBIGUOUS


def test_points_behind_the_camera_are_told() -> None:
    rng = np.random.default_rng(8)
    T, X, X_cam = box(12, rng)
    b = unit(X_cam)
    b[3] *= -1.0
    found = dlt(b, X)
    assert found.state is PoseState.BEHIND
    np.testing.assert_allclose(found.T_cam_world, T, atol=1e-9)
    turned = se3.compose(se3.exp([0, 0, 0, 0, np.pi, 0]), T)
    refined = refine_pose(LENS, X, LENS.project(X_cam).uv, turned)
    assert not refined.converged
    assert refined.reason == "12 of 12 points cannot be seen from the start"
    assert np.isinf(refined.errors_px).all()
    assert refined.rmse_px == np.inf


def test_poses_that_are_not_determined_are_told() -> None:
    line = np.outer(np.arange(1.0, 9.0), [0.1, 0.2, 0.3]) + [0, 0, 4]
    found = refine_pose(LENS, line, LENS.project(line).uv, np.eye(4))
    assert found.reason.startswith("the pose is not determined: rank 5 of 6")
    assert found.cov_pose is None
    two = refine_pose(LENS, line[:2], LENS.project(line[:2]).uv, np.eye(4))
    assert two.reason == "2 points: a pose needs at least 3"
    assert resect(LENS, line, LENS.project(line).uv).reason.startswith(
        "no linear start: the points lie on one line"
    )
    few = refine_pose_robust(
        LENS,
        np.array([[0, 0, 4], [1, 0, 4], [0, 1, 4.0]]),
        np.array([[320, 240], [440, 240], [320, 370.0]]),
        np.eye(4),
    )
    assert few.reason.startswith("too few points for a robust loss")
    circle = Fov(200.0, 200.0, 320.0, 240.0, 1.2)
    outside = resect(circle, line, np.full((8, 2), 1000.0))
    assert outside.reason == "8 of 8 pixels lie outside the camera's invertible field"
    cut = refine_pose(LENS, *seen_box(), se3.exp([0.1, 0, 0, 0, 0.1, 0]), options=Options(max_iterations=1))
    assert (cut.converged, cut.iterations) == (False, 1)
    assert cut.reason


def seen_box() -> tuple[np.ndarray, np.ndarray]:
    X = np.array([[x, y, 4.0 + x * y] for x in (-1.0, 0.2, 1.0) for y in (-1.0, 0.1, 1.0)])
    return X, LENS.project(X).uv


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"X": np.zeros((9, 2))}, r"X_world has shape \(9, 2\)"),
        ({"uv": np.zeros((8, 2))}, "need"),
        ({"uv": np.full((9, 2), np.nan)}, "pixel 0 is .*must be finite"),
        ({"X": np.full((9, 3), np.inf)}, "point 0 is .*must be finite"),
        ({"T": np.full((4, 4), np.nan)}, "need a finite"),
        ({"T": np.zeros((2, 4, 4))}, "need a finite"),
        ({"sigma_px": -1.0}, "sigma_px must be finite"),
    ],
)
def test_bad_input_is_refused(change: dict[str, Any], words: str) -> None:
    X, uv = seen_box()
    given = {"X": X, "uv": uv, "T": np.eye(4), "sigma_px": 1.0} | change
    with pytest.raises(ValueError, match=words):
        refine_pose(LENS, given["X"], given["uv"], given["T"], sigma_px=given["sigma_px"])


@pytest.mark.parametrize("method", [dlt, planar_dlt, resect_linear])
def test_bad_bearings_are_refused(method: Callable[..., Any]) -> None:
    X, _ = seen_box()
    for b, words in ((X, "must be a unit vector"), (np.full((9, 3), np.nan), "bearing 0"), (X[:3], "need")):
        with pytest.raises(ValueError, match=words):
            method(b, X)
    with pytest.raises(ValueError, match="least_sigma_px"):
        refine_pose_robust(LENS, *seen_box(), np.eye(4), least_sigma_px=0.0)
