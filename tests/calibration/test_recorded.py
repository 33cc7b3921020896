"""The numbers of OpenCV's pictures: recorded corners, recorded camera, from starts that are far off."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import pytest

from vslam_ref.estimation.calibration import Board, calibrate, calibrate_robustly, problem

SIZE = (640, 480)
NUMBERS = {"left": (0.40800, 0.2344), "right": (0.45777, 0.2637)}


@pytest.mark.parametrize("side", NUMBERS)
def test_radtan_from_a_perturbed_start(side: str, recorded: Callable, perturbed: Callable) -> None:
    """The recorded values are printed to 5 and 4 digits; OpenCV stops at 1e-16 of its step, far below 1e-4
    px.
    """
    data = recorded(side)
    start = perturbed(data)
    found = calibrate(data.views, SIZE, "radtan", start=start)
    rms, mean = NUMBERS[side]
    assert found.converged
    assert 5 <= found.iterations <= 30
    far = calibrate(data.views, SIZE, "radtan", start=start, max_iterations=0)
    assert far.reason == "max_iterations"
    assert far.rms_px > 30.0  # where it begins
    assert abs(found.rms_px - rms) < 1e-5
    assert abs(found.rms_px - data.rms_px) < 1e-9
    assert abs(found.mean_px - mean) < 1e-4
    assert np.abs(found.camera.matrix - data.camera.matrix).max() < 1e-4
    assert np.abs(found.camera.params[4:] - data.camera.params[4:]).max() < 1e-6
    assert np.abs(found.T_cam_board - data.T_cam_board).max() < 1e-5


@pytest.mark.parametrize("side", NUMBERS)
def test_the_start_of_its_own_leads_to_the_same_camera(side: str, recorded: Callable) -> None:
    data = recorded(side)
    found = calibrate(data.views, SIZE)
    assert found.start.rms_px < 3.0
    assert found.iterations > 5
    assert np.abs(found.camera.matrix - data.camera.matrix).max() < 1e-4


BREAKS: dict[str, Callable[[np.ndarray, np.ndarray], None]] = {
    "rotation flipped": lambda P, J: np.negative(P[..., 3:], out=P[..., 3:]),
    "translation flipped": lambda P, J: np.negative(P[..., :3], out=P[..., :3]),
    "rotation first": lambda P, J: P.__setitem__(..., P[..., [3, 4, 5, 0, 1, 2]]),
    "k1 flipped": lambda P, J: np.negative(J[..., 4], out=J[..., 4]),
    "p1 and p2 exchanged": lambda P, J: J.__setitem__((..., [6, 7]), J[..., [7, 6]]),
    "cx flipped": lambda P, J: np.negative(J[..., 2], out=J[..., 2]),
}


@pytest.mark.parametrize("name", BREAKS)
def test_a_broken_jacobian_misses_the_number(
    name: str, recorded: Callable, perturbed: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same start, one block of the Jacobian wrong: no convergence, and another rms."""
    right = problem.residual_with_jacobians

    def wrong(*args: Any, **kwargs: Any) -> problem.Residual:
        r, P, J = right(*args, **kwargs)
        P, J = P.copy(), J.copy()
        BREAKS[name](P, J)
        return problem.Residual(r, P, J)

    monkeypatch.setattr(problem, "residual_with_jacobians", wrong)
    data = recorded("left")
    found = calibrate(data.views, SIZE, "radtan", start=perturbed(data), max_iterations=100)
    assert not found.converged
    assert found.rms_px > 0.5
    assert np.abs(found.camera.matrix - data.camera.matrix).max() > 5.0


def test_tangential_coefficients_in_the_wrong_order_are_seen(recorded: Callable) -> None:
    """A camera with p1 and p2 exchanged fits as well, with exchanged numbers: only they tell."""
    found = calibrate(recorded("left").views, SIZE).camera.params
    wanted = recorded("left").camera.params
    assert abs(found[6] - wanted[6]) < 1e-6
    assert abs(found[6] - wanted[7]) > 2e-3


def test_fov_stands_beside_it(recorded: Callable) -> None:
    """One number instead of five costs 2.6 and 0.6 % of the rms. No outside oracle: OpenCV has no such
    lens.
    """
    left, right = (calibrate(recorded(side).views, SIZE, "fov") for side in NUMBERS)
    assert left.converged
    assert right.converged
    assert abs(left.rms_px - 0.41869) < 1e-5
    assert abs(right.rms_px - 0.46065) < 1e-5
    assert abs(left.camera.params[4] - right.camera.params[4]) < 4 * np.hypot(
        left.std["omega"], right.std["omega"]
    )


@pytest.mark.parametrize("side", NUMBERS)
def test_pinhole_and_fisheye_are_opencvs(side: str, recorded: Callable) -> None:
    """Both programs minimise the same sum; both at its minimum, they agree to what is left to win."""
    data = recorded(side)
    X = [view.X_board.astype(np.float32) for view in data.views]
    uv = [view.uv.astype(np.float32)[:, None] for view in data.views]
    flags = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 300, 1e-14)
    rms, K, *_ = cv2.calibrateCamera(X, uv, SIZE, None, None, flags=flags, criteria=until)
    pinhole = calibrate(data.views, SIZE, "pinhole")
    assert abs(pinhole.rms_px - rms) < 1e-8
    assert np.abs(pinhole.camera.matrix - K).max() < 1e-3
    flags = 0
    for name in ("CALIB_FIX_SKEW", "CALIB_RECOMPUTE_EXTRINSIC"):
        flags |= getattr(cv2.fisheye, name) if hasattr(cv2.fisheye, name) else getattr(cv2, name)
    rms, K, k, *_ = cv2.fisheye.calibrate(
        [x[None].astype(float) for x in X],
        [p.reshape(1, -1, 2).astype(float) for p in uv],
        SIZE, None, None, flags=flags, criteria=until,
    )  # fmt: skip
    fisheye = calibrate(data.views, SIZE, "fisheye")
    assert abs(fisheye.rms_px - rms) < 1e-8
    assert np.abs(fisheye.camera.matrix - K).max() < 1e-3
    assert np.abs(fisheye.camera.params[4:] - k.ravel()).max() < 1e-3


def test_standard_deviations_are_opencvs(recorded: Callable) -> None:
    """OpenCV inverts the whole J^T J; its sigma^2 is the squared error over (2M - unknowns)."""
    data = recorded("left")
    X = [view.X_board.astype(np.float32) for view in data.views]
    uv = [view.uv.astype(np.float32)[:, None] for view in data.views]
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 300, 1e-14)
    *_, wanted, _, _ = cv2.calibrateCameraExtended(X, uv, SIZE, None, None, criteria=until)
    found = calibrate(data.views, SIZE)
    ratio = np.array(list(found.std.values())) / wanted.ravel()[:9]
    assert np.abs(ratio - 1).max() < 1e-5


def test_a_few_corners_carry_most_of_the_rms(recorded: Callable) -> None:
    """Left02's lowest corners were pulled to the board's border by a window of 11 px. A robust loss drops
    them, and moves the focal length by more than two of its deviations.
    """
    data = recorded("left")
    plain = calibrate(data.views, SIZE)
    squares = np.sort(plain.errors_px**2)[::-1]
    assert squares[:10].sum() > 0.5 * squares.sum()  # ten of 702
    robust = calibrate_robustly(data.views, SIZE)
    assert robust.calibration.converged
    assert 6 <= robust.ignored.sum() <= 40
    assert abs(robust.calibration.camera.fx - plain.camera.fx) > 2 * plain.std["fx"]
    assert robust.calibration.std["fx"] < 0.6 * plain.std["fx"]
    assert set(robust.calibration.corners.view[robust.ignored]) >= {1}


def test_rational_is_not_determined_and_says_so(recorded: Callable) -> None:
    """Eight lens parameters on 13 pictures run towards a pole inside the image (OpenCV goes there: its
    denominator nearly vanishes at r = 0.288).  The solver stops at the edge of the invertible field."""
    data = recorded("left")
    found = calibrate(data.views, SIZE, "rational", max_iterations=400)
    assert found.reason == "stalled"
    assert "invertible field" in found.message
    X = [view.X_board.astype(np.float32) for view in data.views]
    uv = [view.uv.astype(np.float32)[:, None] for view in data.views]
    _, _, k, *_ = cv2.calibrateCamera(X, uv, SIZE, None, None, flags=cv2.CALIB_RATIONAL_MODEL)
    q = np.linspace(0, 0.3, 30001)  # the corners reach r = 0.55
    denominator = 1 + k.ravel()[5] * q + k.ravel()[6] * q**2 + k.ravel()[7] * q**3
    assert denominator.min() < 0.01


def test_squares_only_scale_the_poses(recorded: Callable) -> None:
    data = recorded("left")
    found = calibrate([(0.025 * v.X_board, v.uv) for v in data.views], SIZE)
    assert Board(9, 6, 0.025).points[1, 0] == 0.025
    assert np.abs(found.camera.matrix - data.camera.matrix).max() < 1e-4
    assert np.abs(found.T_cam_board[:, :3, 3] - 0.025 * data.T_cam_board[:, :3, 3]).max() < 1e-6
