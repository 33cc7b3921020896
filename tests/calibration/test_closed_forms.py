"""Homographies, Zhang's sensor and poses: exact where the input is exact."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vslam_ref.estimation.calibration import (
    Board,
    apply_homography,
    homography,
    pose_from_homography,
    sensor_from_homographies,
)
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.worlds import boards

EPS = float(np.finfo(float).eps)
SIZE = (640, 480)
BOARD = Board(7, 5, 0.04)


def images(seed: int, sigma: float = 0.0, views: int = 6) -> tuple[Pinhole, np.ndarray, np.ndarray]:
    """A random pinhole camera, poses, and what it sees (V, N, 2)."""
    rng = np.random.default_rng(seed)
    f = rng.uniform(300, 900)
    camera = Pinhole(f, f * rng.uniform(0.9, 1.1), rng.uniform(280, 360), rng.uniform(200, 280))
    T = boards.poses(BOARD, camera, SIZE, views, rng)
    seen = boards.views(BOARD, camera, T, sigma, rng)
    return camera, T, np.stack([view.uv for view in seen])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_exact_pictures_give_camera_and_poses_back(seed: int) -> None:
    """Pixels are rounded to eps of 640; Zhang's system then loses its condition, at most 1e4 / gap here."""
    camera, T, uv = images(seed)
    H = homography(np.broadcast_to(BOARD.points[:, :2], uv.shape), uv)
    K_H = camera.matrix @ T[:, :3, [0, 1, 3]]
    K_H /= np.linalg.norm(K_H, axis=(1, 2), keepdims=True)
    assert np.abs(H - K_H).max() < 1e-11  # the same sign: the board is in front
    found = sensor_from_homographies(H, SIZE)
    assert found.numbers is not None
    assert np.abs(found.numbers / camera.params - 1).max() < 1e3 * EPS * 1e4 / found.gap
    xn = camera.unproject(uv).xn
    poses = pose_from_homography(homography(np.broadcast_to(BOARD.points[:, :2], xn.shape), xn))
    assert np.abs(poses - T).max() < 1e-10


def test_homography_is_opencvs() -> None:
    """Both take the smallest singular vector of the normalised system; OpenCV then refines the pixel error,
    so with noise the two differ by a share of the noise: 0.05 px of noise over 35 points.
    """
    _, _, uv = images(3, sigma=0.05)
    X = BOARD.points[:, :2]
    for view in uv:
        wanted, _ = cv2.findHomography(X, view, 0)
        ours = homography(X, view)
        assert np.abs(apply_homography(ours, X) - apply_homography(wanted, X)).max() < 0.02


def test_normalisation_is_what_makes_it_independent_of_units() -> None:
    """Moving and scaling the pixels moves and scales the answer: to rounding of the larger numbers."""
    _, _, uv = images(4, sigma=0.5)
    X = BOARD.points[:, :2]
    a = apply_homography(homography(X, uv[0]), X)
    b = apply_homography(homography(1000 * X - 7, 0.01 * uv[0] + 30), 1000 * X - 7)
    assert np.abs(100 * (b - 30) - a).max() < 1e-8


def test_four_points_fit_exactly() -> None:
    X = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    x = np.array([[10, 12], [50, 8], [61, 55], [5, 40.0]])
    assert np.abs(apply_homography(homography(X, x), X) - x).max() < 1e-11


def test_parallel_boards_do_not_determine_the_sensor() -> None:
    """Rotations about the axis and translations only: every focal length solves Zhang's equations."""
    rng = np.random.default_rng(0)
    K = Pinhole(500, 500, 320, 240).matrix
    xi = np.concatenate([rng.uniform(-0.2, 0.2, (8, 2)), rng.uniform(1, 2, (8, 1)), np.zeros((8, 3))], 1)
    xi[:, 5] = rng.uniform(-3, 3, 8)
    found = sensor_from_homographies(K @ se3.exp(xi)[:, :3, [0, 1, 3]], SIZE)
    assert found.numbers is None
    assert "parallel" in found.reason
    one = sensor_from_homographies(K @ se3.exp([[0, 0, 2, 0.5, 0.3, 0]])[:, :3, [0, 1, 3]], SIZE)
    assert one.numbers is None


def test_distortion_that_bends_homographies_is_named_or_small() -> None:
    """Corners at random are no image of a board: the squared focal lengths come out negative for some
    seeds.
    """
    reasons = set()
    for seed in range(20):
        rng = np.random.default_rng(seed)
        found = sensor_from_homographies(rng.standard_normal((3, 3, 3)), SIZE)
        assert (found.numbers is None) == bool(found.reason)
        assert found.numbers is None or np.isfinite(found.numbers).all()
        reasons.add(found.reason)
    assert any("negative" in reason for reason in reasons)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: homography(np.zeros((3, 2)), np.zeros((3, 2))), "N at least 4"),
        (lambda: homography(np.zeros((5, 2)), np.zeros((4, 2))), "need"),
        (lambda: sensor_from_homographies(np.eye(3), SIZE), r"need \(V, 3, 3\)"),
        (lambda: pose_from_homography(np.zeros((3, 3))), "columns are zero"),
    ],
)
def test_bad_input_is_refused(call: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()  # type: ignore[operator]
