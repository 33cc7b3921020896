"""Exercise 7.1: a camera from homographies.  Oracle: the camera and the poses that made them."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from vslam_ref.geometry import se3

EXERCISE = "07_zhang"

K = np.array([[536.0, 0.0, 342.0], [0.0, 512.0, 235.0], [0.0, 0.0, 1.0]])


def boards(seed: int, views: int, tilt: float = 0.8) -> np.ndarray:
    """Poses (V, 4, 4), each board tilted about an axis of its own, 4 to 8 board units away."""
    rng = np.random.default_rng(seed)
    phi = tilt * rng.uniform(-1, 1, (views, 3))
    phi[:, 2] = rng.uniform(-1, 1, views)
    t = rng.uniform([-1, -1, 4], [1, 1, 8], (views, 3))
    return se3.from_rt(se3.exp(np.concatenate([0 * phi, phi], 1))[:, :3, :3], t)


def homographies(T: np.ndarray, seed: int = 0) -> np.ndarray:
    """K [r1 r2 t], each with a factor of its own, half of them negative."""
    rng = np.random.default_rng(seed)
    factor = rng.uniform(0.1, 10, len(T)) * np.where(np.arange(len(T)) % 2, -1, 1)
    return factor[:, None, None] * (K @ T[:, :3, [0, 1, 3]])


@pytest.mark.parametrize("views", [2, 3, 10])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_sensor_comes_back(answer: ModuleType, seed: int, views: int) -> None:
    """Exact input; two views may meet a condition of 1e6, so nine digits."""
    found = answer.sensor(homographies(boards(seed, views)))
    assert found is not None, "these boards determine the camera"
    assert np.shape(found) == (3, 3), f"K has shape {np.shape(found)}, need (3, 3)"
    assert np.isfinite(found).all(), "a number of K is not finite"
    assert np.allclose(found, K, rtol=1e-8, atol=1e-5), f"K\n{found}\nmust be\n{K}"


def test_the_factor_of_a_homography_means_nothing(answer: ModuleType) -> None:
    """Noisy homographies, so that the views disagree: equal answers for other factors."""
    rng = np.random.default_rng(3)
    H = homographies(boards(3, 8))
    H = H / np.linalg.norm(H, axis=(1, 2), keepdims=True)
    H = H * (1 + 1e-4 * rng.standard_normal(H.shape))
    a, b = answer.sensor(H), answer.sensor(-H * np.geomspace(1e-3, 1e3, 8)[:, None, None])
    assert a is not None, "8 boards with a little noise determine the camera"
    assert b is not None, "8 boards with a little noise determine the camera"
    assert np.allclose(a, b, rtol=1e-6), "scaling a homography changed K: give each view the same weight"


def test_parallel_boards_are_not_enough(answer: ModuleType) -> None:
    """Facing the camera, or all tilted alike, or a single one: among 40 of them some look like a camera."""
    facing = [boards(seed, 6, tilt=0.0) for seed in range(10)]
    alike = [np.repeat(boards(seed, 1), 5, axis=0) for seed in range(20)]
    single = [boards(seed, 1) for seed in range(10)]
    for T in [*facing, *alike, *single]:
        T[:, 0, 3] += np.arange(len(T)) * 0.1  # moved, not turned out of their plane
        assert answer.sensor(homographies(T)) is None, (
            "boards that are all parallel (or one board) fit many cameras: two singular values are 0"
        )


def test_the_pose_comes_back(answer: ModuleType) -> None:
    T = boards(7, 6)
    for H, right in zip(homographies(T), T, strict=True):
        found = answer.pose(H, K)
        assert np.shape(found) == (4, 4), f"T has shape {np.shape(found)}, need (4, 4)"
        assert found[2, 3] > 0, "the board is behind the camera: H and -H are the same homography"
        assert np.allclose(found, right, rtol=0, atol=1e-10), f"T\n{found}\nmust be\n{right}"


def test_a_noisy_homography_gives_a_rotation(answer: ModuleType) -> None:
    """Noise of 2 % in each entry: columns that are neither of length 1 nor at right angles."""
    rng = np.random.default_rng(8)
    for H, right in zip(homographies(boards(8, 6)), boards(8, 6), strict=True):
        found = answer.pose(H * (1 + 0.02 * rng.standard_normal((3, 3))), K)
        R = found[:3, :3]
        orthogonal = np.allclose(R @ R.T, np.eye(3), rtol=0, atol=1e-12)
        assert orthogonal, "R R^T is not the identity: take the nearest rotation"
        assert abs(np.linalg.det(R) - 1) < 1e-12, "R is a reflection"
        assert np.allclose(R, right[:3, :3], rtol=0, atol=0.3)
        assert np.array_equal(found[3], [0, 0, 0, 1])


def test_both_columns_share_the_scale(answer: ModuleType) -> None:
    """First column 2 % too long, second 2 % too short: their mean length is right, and so is the distance."""
    T = boards(9, 1)[0]
    H = K @ (T[:3, [0, 1, 3]] * [1.02, 0.98, 1.0])
    assert np.allclose(answer.pose(H, K)[:3, 3], T[:3, 3], rtol=1e-9)
