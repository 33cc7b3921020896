"""Worlds of the samples: an eight that closes, squares where they belong, an error of known size."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.estimation.calibration import Board
from vslam_ref.geometry.cameras import Camera, Fov, Radtan
from vslam_ref.metrics.trajectory import evaluate
from vslam_ref.worlds import board_pictures
from vslam_ref.worlds.camera_flight import estimate, fly
from vslam_ref.worlds.figure_eight import EightConfig, drive, scatter

BOARD, SIZE = Board(5, 4, 0.1), (160, 120)
CAMERAS = [Radtan(140, 141, 80.3, 58.9, -0.2, 0.05, 1e-3, -5e-4, 0.0), Fov(120.0, 121.0, 79.0, 60.5, 0.9)]


def test_an_eight_comes_back() -> None:
    """To a step, as 16 pi s is no whole number of steps; and it turns left, then right."""
    config = EightConfig(seconds=60.0)
    world = drive(config, np.zeros((0, 2)))
    end = round(16 * np.pi / config.dt)
    step = config.speed * config.dt
    assert np.hypot(*(world.poses[end] - world.poses[0])[:2]) < 2 * step
    middle = world.poses[end // 4]
    side = np.array([-np.sin(0.4), np.cos(0.4)])
    assert (middle[:2] - world.poses[0, :2]) @ side == pytest.approx(4.0, abs=0.05)  # left: one diameter


def test_landmarks_keep_apart_or_are_refused() -> None:
    X = scatter(20, np.random.default_rng(0))
    gaps = np.linalg.norm(X[:, None] - X, axis=-1) + 9 * np.eye(20)
    assert gaps.min() >= 0.8
    with pytest.raises(ValueError, match="no room"):
        scatter(500, np.random.default_rng(0))
    with pytest.raises(ValueError, match="speed=0: must be > 0"):
        EightConfig(speed=0)


@pytest.mark.parametrize("camera", CAMERAS, ids=["radtan", "fov"])
def test_squares_are_where_the_camera_projects_them(camera: Camera) -> None:
    """Grey in the middle of each square, by the camera's own projection, and bright paper around the ring."""
    pictures = board_pictures.take(BOARD, camera, SIZE, 3, np.random.default_rng(0), fill=(0.6, 0.8))
    column, row = (k.ravel() for k in np.meshgrid(np.arange(-1, 5), np.arange(-1, 4)))
    X = np.stack([(column + 0.5) * 0.1, (row + 0.5) * 0.1, 0.0 * row], axis=-1)
    dark = (column + row) % 2 == 0
    for image, T in zip(pictures.images, pictures.T_cam_board, strict=True):
        u, v = np.round(camera.pixel_from_world(T, X).uv).astype(int).T
        np.testing.assert_array_equal(image[v, u], np.where(dark, 30, 220))
        share = (image < 125).mean() / dark.mean()
        assert 0.1 < share < 1.0


@pytest.mark.parametrize("seed", [0, 1])
def test_the_error_after_alignment_is_the_one_asked_for(seed: int) -> None:
    """Rounding: some hundred operations on numbers of 4 m, against an error of 0.1 m."""
    truth = fly(10.0)
    found = evaluate(estimate(truth, 0.1, 0.02, np.random.default_rng(seed)), truth, "se3")
    assert found.numbers()["ate_rmse"] == pytest.approx(0.1, rel=1e-11)
    assert (
        evaluate(estimate(truth, 0.1, 0.02, np.random.default_rng(seed)), truth, "none").numbers()["ate_rmse"]
        > 1
    )
