"""The book's calibration and the fast one take the same steps and are equally sure."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.estimation.calibration import Board, Start, book, calibrate
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan
from vslam_ref.worlds import boards

SIZE, BOARD = (640, 480), Board(7, 5, 0.04)
SENSOR = {"fx": 500.0, "fy": 505.0, "cx": 322.0, "cy": 238.0}
CAMERAS = {
    "pinhole": Pinhole(**SENSOR),
    "radtan": Radtan(**SENSOR, k1=-0.2, k2=0.05, p1=1e-3, p2=-5e-4),
    "fov": Fov(**SENSOR, omega=0.9),
    "fisheye": Fisheye(**SENSOR, k1=-0.02, k2=0.01, k3=-0.003, k4=0.001),
}


@pytest.mark.parametrize("model", CAMERAS)
@pytest.mark.parametrize("seed", range(3))
def test_same_steps_and_covariance(model: str, seed: int) -> None:
    """Five steps from 2 % and some degrees off.

    The scaled normal matrix has a condition of 1e8 or less: 1e-16 times this, over five steps.
    """
    rng = np.random.default_rng(seed)
    truth: Camera = CAMERAS[model]
    T = boards.poses(BOARD, truth, SIZE, 5, rng)
    views = [(X, uv) for X, uv in boards.views(BOARD, truth, T, 0.2, rng)]
    params = truth.params * np.where(np.arange(len(truth.params)) < 4, 1 + 0.02 * rng.uniform(-1, 1), 1.0)
    camera = type(truth).from_params(params)
    T_start = se3.perturb(T, 0.01 * rng.standard_normal((5, 6)))
    slow = book.calibrate_book(camera, T_start, views, iterations=5)
    fast = calibrate(views, SIZE, model, start=Start(camera, T_start, 0.0), max_iterations=5)
    costs = [h.cost for h in fast.history]
    assert len(costs) >= 3
    assert costs == pytest.approx(slow.costs[1 : 1 + len(costs)], rel=1e-7)
    assert slow.costs[-1] < 0.1 * slow.costs[0]
    assert np.abs(fast.camera.params - slow.camera.params).max() < 1e-5
    assert fast.covariance is not None
    deviation = np.sqrt(np.diag(slow.covariance))
    assert np.abs((fast.covariance - slow.covariance) / np.outer(deviation, deviation)).max() < 1e-4


def test_a_flipped_sign_is_another_algorithm(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the poses' part of the reduced right side turned round the first step makes no camera."""
    rng = np.random.default_rng(1)
    truth = CAMERAS["radtan"]
    T = boards.poses(BOARD, truth, SIZE, 5, rng)
    views = [(X, uv) for X, uv in boards.views(BOARD, truth, T, 0.2, rng)]
    T_start = se3.perturb(T, 0.01 * rng.standard_normal((5, 6)))
    reduced = book.reduced
    monkeypatch.setattr(book, "reduced", lambda N: (reduced(N)[0], -2 * N.g_c - reduced(N)[1]))
    with pytest.raises(ValueError, match="focal lengths must be more than 0"):
        book.calibrate_book(truth, T_start, views, iterations=1)
