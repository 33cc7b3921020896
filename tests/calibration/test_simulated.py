"""Cameras that are known: found again, for every lens, with honest deviations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from vslam_ref.estimation.calibration import (
    Board,
    Start,
    calibrate,
    calibrate_robustly,
    ptam,
    stack,
)
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.estimation.calibration.problem import CalibrationProblem, CalibrationState
from vslam_ref.estimation.robust import L2
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import MODELS, Camera, Fisheye, Fov, Pinhole, Radtan, Rational
from vslam_ref.worlds import boards

SIZE = (640, 480)
BOARD = Board(11, 8, 0.03)
CAMERAS: dict[str, Camera] = {
    "pinhole": Pinhole(500, 505, 322, 238),
    "fov, PTAM's lens": Fov(400, 402, 322, 238, 0.93),
    "fov, 1.4": Fov(300, 300, 310, 250, 1.4),
    "radtan": Radtan(500, 505, 322, 238, -0.3, 0.1, 1e-3, -5e-4),
    "radtan, 90 degrees": Radtan(350, 352, 322, 238, -0.33, 0.13, 1e-3, -5e-4, -0.02),
    "radtan, tele": Radtan(3000, 3000, 322, 238, -0.3, 0.1, 1e-3, -5e-4),
    "rational": Rational(500, 505, 322, 238, 0.9, 0.2, 1e-3, -5e-4, 0.01, 1.2, 0.5, 0.05),
    "fisheye, 170 degrees": Fisheye(220, 221, 318, 242, -0.01, 0.02, -0.01, 0.002),
    "fisheye, 240 degrees": Fisheye(150, 151, 318, 242, 0.05, -0.02, 0.01, 0.0),
}


def model_of(camera: Camera) -> str:
    return next(name for name, model in MODELS.items() if type(camera) is model)


def scene(
    camera: Camera, views: int = 12, seed: int = 1, **more: object
) -> tuple[np.ndarray, np.random.Generator]:
    rng = np.random.default_rng(seed)
    return boards.poses(BOARD, camera, SIZE, views, rng, **more), rng  # type: ignore[arg-type]


@pytest.mark.parametrize("name", CAMERAS)
def test_found_without_being_told_a_start(name: str) -> None:
    """Noise of 0.2 px. The squared error in the calibration's own covariance is chi^2 with as many degrees
    of freedom as intrinsics: beyond its 1e-6 quantile once in a million cameras.
    """
    camera = CAMERAS[name]
    T, rng = scene(camera, fill=(0.5, 1.0), tilt=(0.1, 0.9))
    found = calibrate(boards.views(BOARD, camera, T, 0.2, rng), SIZE, model_of(camera))
    assert found.converged
    assert not found.undetermined
    assert abs(found.sigma_px / 0.2 - 1) < 5 / np.sqrt(2 * 2 * 12 * 88)
    assert found.covariance is not None
    error = found.camera.params - camera.params
    nees = error @ np.linalg.solve(found.covariance, error)
    assert nees < chi2.ppf(1 - 1e-6, len(error))


@pytest.mark.parametrize("name", ["radtan", "fov, 1.4", "fisheye, 170 degrees", "pinhole"])
def test_exact_corners_give_the_camera_back(name: str) -> None:
    """Corners are rounded to eps of 640 px, 1e-13; deviations are below 1e3 px per px of noise."""
    camera = CAMERAS[name]
    T, _ = scene(camera)
    found = calibrate(boards.views(BOARD, camera, T), SIZE, model_of(camera))
    assert found.converged
    assert (np.abs(found.camera.params - camera.params) < 1e-9 * np.maximum(1.0, camera.params)).all()
    assert np.abs(found.T_cam_board - T).max() < 1e-9


def test_covariance_is_honest() -> None:
    """60 calibrations with new noise: the sum of their NEES is chi^2 with 540 degrees of freedom to first
    order in the noise; the band misses by chance once in 1e4.
    """
    camera = CAMERAS["radtan"]
    T, rng = scene(camera, views=8)
    start = Start(camera, T, 0.0)
    total, runs = 0.0, 60
    for _ in range(runs):
        found = calibrate(boards.views(BOARD, camera, T, 0.3, rng), SIZE, start=start)
        assert found.covariance is not None
        error = found.camera.params - camera.params
        total += error @ np.linalg.solve(found.covariance, error)
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 9 * runs)
    assert low < total < high
    # the mistake, poses taken as known, is far outside: the true deviations are several times larger
    problem = CalibrationProblem(stack(boards.views(BOARD, camera, T)), Free(Radtan), L2())
    point = problem.linearise(CalibrationState(camera.params, T))
    assert point is not None
    naive = 0.3 * np.sqrt(np.diag(np.linalg.inv(point.normal.C)))
    assert found.std["cx"] > 3 * naive[2]


def test_fixed_parameters_stay_and_the_rest_is_better_known() -> None:
    camera = CAMERAS["radtan"]
    T, rng = scene(camera)
    views = boards.views(BOARD, camera, T, 0.2, rng)
    all_free = calibrate(views, SIZE)
    fixed = {"k3": 0.0, "cx": 322.0, "cy": 238.0}
    some = calibrate(views, SIZE, fixed=fixed, aspect=505 / 500)
    got = dict(zip(some.camera.names(), some.camera.params.tolist(), strict=True))
    assert {name: got[name] for name in fixed} == fixed
    assert abs(got["fy"] / got["fx"] - 1.01) < 1e-14
    assert all(some.std[name] == 0.0 for name in fixed)
    assert abs(some.std["fy"] - 1.01 * some.std["fx"]) < 1e-12
    for name in ("fx", "k1", "k2", "p1", "p2"):
        assert 0 < some.std[name] < all_free.std[name]
        assert abs(got[name] - getattr(camera, name)) < 5 * some.std[name]


def test_views_may_have_different_corners() -> None:
    """Half-visible boards: each view drops other corners."""
    camera = CAMERAS["radtan"]
    T, rng = scene(camera)
    views = [
        (X[keep], uv[keep])
        for X, uv in boards.views(BOARD, camera, T, 0.1, rng)
        for keep in [rng.permutation(88)[: rng.integers(20, 88)]]
    ]
    found = calibrate(views, SIZE)
    assert found.converged
    assert np.abs((found.camera.params - camera.params) / list(found.std.values())).max() < 5
    assert len(found.view_rms_px) == 12
    counts = np.array([len(X) for X, _ in views])
    assert abs((found.view_rms_px**2 @ counts) / counts.sum() - found.rms_px**2) < 1e-12


def test_wrong_corners_bend_least_squares_and_not_tukey() -> None:
    """Five corners in a hundred 2 to 6 px off, all to the right."""
    camera = CAMERAS["radtan"]
    T, rng = scene(camera)
    views = boards.views(BOARD, camera, T, 0.2, rng)
    bad = rng.random((12, 88)) < 0.05
    for view, lost in zip(views, bad, strict=True):
        view.uv[lost, 0] += rng.uniform(2, 6, lost.sum())
    plain, robust = calibrate(views, SIZE), calibrate_robustly(views, SIZE)
    assert robust.calibration.converged
    assert abs(robust.scale_px / 0.2 - 1) < 0.1
    assert (robust.ignored == bad.ravel()).mean() > 0.995
    truth = camera.params
    deviation = np.array(list(robust.calibration.std.values()))
    assert np.abs((robust.calibration.camera.params - truth) / deviation).max() < 5
    assert np.abs((plain.camera.params - truth) / deviation).max() > 5


def test_ptams_step_leaves_nine_tenths() -> None:
    """Near the minimum the step is 0.1 of Gauss-Newton's, so the cost's excess, a square, falls by 0.81; the
    prior of 1 on the diagonal holds the weakest directions back a little, never the other way.
    """
    camera = CAMERAS["fov, PTAM's lens"]
    T, rng = scene(camera, views=6)
    views = boards.views(BOARD, camera, T, 0.2, rng)
    best = calibrate(views, SIZE, "fov")
    problem = CalibrationProblem(stack(views), Free(Fov), L2())
    near = se3.perturb(best.T_cam_board, 1e-3 * np.ones(6))
    state = CalibrationState(best.camera.params + [2.0, 2.0, 1.0, -1.0, 0.01], near)
    point = problem.linearise(state)
    assert point is not None
    least = 0.5 * float((best.residual**2).sum())
    gaps = [point.cost - least]
    for _ in range(40):
        point = problem.linearise(ptam.ptam_step(problem, point, SIZE))
        assert point is not None
        gaps.append(point.cost - least)
    ratios = np.array(gaps[1:]) / gaps[:-1]
    assert (ratios < 1).all()
    assert ((ratios[5:25] > 0.805) & (ratios[5:25] < 0.83)).all()


@pytest.mark.slow
def test_any_camera_any_image_size() -> None:
    """100 random cameras of four models, 320 to 4000 px wide, 4 to 19 views, none told a start: each
    converges, and the p-values of their NEES are uniform (Kolmogorov-Smirnov; below 1e-4 once in 1e4 seeds).
    """
    rng, board, p_values = np.random.default_rng(123), Board(9, 6, 0.03), []
    for _ in range(100):
        width = int(rng.choice([320, 640, 1280, 4000]))
        size = (width, int(width * rng.choice([0.75, 0.5625])))
        f = width * rng.uniform(0.35, 1.6)
        sensor = (f, f * rng.uniform(0.97, 1.03), *(np.array(size) / 2 + width * rng.uniform(-0.05, 0.05, 2)))
        k = rng.uniform([-0.35, 0.0, -2e-3, -2e-3], [0.1, 0.1, 2e-3, 2e-3])
        lens = {"pinhole": [], "fov": [rng.uniform(0.3, 1.3)], "radtan": [*k, 0.0]}
        lens["fisheye"] = [*(0.1 * k[:2]), 0.0, 0.0]
        model = str(rng.choice(list(lens)))
        camera = MODELS[model].from_params([*sensor, *lens[model]])
        T = boards.poses(board, camera, size, int(rng.integers(4, 20)), rng, fill=(0.3, 0.9))
        found = calibrate(boards.views(board, camera, T, 0.3, rng), size, model)
        assert found.converged
        assert found.covariance is not None
        error = found.camera.params - camera.params
        p_values.append(chi2.sf(error @ np.linalg.solve(found.covariance, error), len(error)))
    assert kstest(p_values, "uniform").pvalue > 1e-4
