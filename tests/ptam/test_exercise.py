"""Exercise 12.1: what a map leaves open, with the mistakes that are usually made."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.geometry import camera_pose, se3, so3
from vslam_ref.geometry.alignment import align

EXERCISE = "12_open"


def test_who_waits(answer: ModuleType) -> None:
    """By hand: at 30 every 10, the next three wait 20, 13 and 6; then nobody."""
    found = answer.latencies(np.array([3.0, 30.0, 3.0, 3.0, 3.0, 3.0]), 10.0)
    np.testing.assert_allclose(found, [3.0, 30.0, 23.0, 16.0, 9.0, 3.0], atol=1e-12)
    np.testing.assert_allclose(answer.latencies(np.full(5, 4.0), 10.0), 4.0, atol=1e-12)
    late = answer.latencies(np.full(50, 11.0), 10.0)
    assert late[-1] == pytest.approx(60.0), "one that never catches up is later by 1 each time"


def a_map(seed: int) -> tuple[Array, Array]:
    """Five keyframes that look at forty points, in a world that begins elsewhere."""
    rng = np.random.default_rng(seed)
    T = se3.compose(se3.exp(0.1 * rng.standard_normal((5, 6))), se3.exp([0, 0, 6.0, 0.4, -1.0, 0.3]))
    X_cam = np.column_stack([rng.uniform(-1, 1, (40, 2)), rng.uniform(2, 9, 40)])
    return T, se3.act(se3.inverse(T[0]), X_cam)


def pixels(T: Array, X: Array) -> Array:
    at = se3.act(T[:, None], X[None])
    return np.asarray(at[..., :2] / at[..., 2:])


@pytest.mark.parametrize("seed", range(3))
def test_the_map_in_its_own_unit(answer: ModuleType, seed: int) -> None:
    T, X = a_map(seed)
    own_T, own_X = answer.own_unit(T.copy(), X.copy())
    np.testing.assert_allclose(own_T[0], np.eye(4), atol=1e-12)
    assert np.median(own_X[:, 2]) == pytest.approx(1.0, rel=1e-12)
    if np.allclose(own_T[:, :3, 3], (T @ np.linalg.inv(T[0]))[:, :3, 3]):
        pytest.fail("the points have a new unit, the cameras the old one")
    np.testing.assert_allclose(pixels(own_T, own_X), pixels(T, X), atol=1e-11)
    R = own_T[:, :3, :3]
    np.testing.assert_allclose(R @ np.swapaxes(R, 1, 2), np.broadcast_to(np.eye(3), R.shape), atol=1e-12)


def test_pictures_go_with_their_keyframes(answer: ModuleType) -> None:
    """All keyframes moved by one motion of the world: the pictures move by it, too."""
    rng = np.random.default_rng(4)
    T_kf, kf = se3.exp(0.3 * rng.standard_normal((4, 6))), np.array([0, 3, 1, 1, 2, 0])
    T_cam = se3.exp(0.3 * rng.standard_normal((6, 6)))
    moved = se3.exp([0.3, -0.2, 0.5, 0.2, 0.4, -0.3])
    found = answer.final_path(T_cam, kf, T_kf[kf], T_kf @ moved)
    if np.allclose(found, T_cam):
        pytest.fail("the pictures stay where they were told live")
    np.testing.assert_allclose(found, T_cam @ moved, atol=1e-12)
    others = T_kf.copy()
    others[1] = se3.exp([0.1, 0, 0, 0, 0.2, 0]) @ T_kf[1]
    found = answer.final_path(T_cam, kf, T_kf[kf], others)
    stays = kf != 1
    np.testing.assert_allclose(found[stays], T_cam[stays], atol=1e-12)
    beside = found[~stays] @ np.linalg.inv(others[1])
    np.testing.assert_allclose(beside, T_cam[~stays] @ np.linalg.inv(T_kf[1]), atol=1e-12)


def grown(n: int, factor: float, seed: int) -> tuple[Array, Array]:
    """A path that turned, moved, and became larger by a factor from its first to its last third."""
    rng = np.random.default_rng(seed)
    true = np.cumsum(rng.standard_normal((n, 3)), axis=0)
    scale = np.linspace(0, 1, n - 1)
    size = np.where(scale < 0.4, 1.0, np.where(scale > 0.6, factor, 1 + (factor - 1) * (scale - 0.4) / 0.2))
    steps = np.diff(true, axis=0) * size[:, None]
    path = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return 0.3 * path @ so3.exp([0.5, -1.2, 0.8]).T + [4, 5, 6], true


@pytest.mark.parametrize("factor", [1.3, 0.8, 1.0])
def test_drift(answer: ModuleType, factor: float) -> None:
    path, true = grown(31, factor, 1)
    found = answer.scale_drift(path, true)
    if factor != 1.0 and found == pytest.approx(factor, rel=1e-6):
        pytest.fail("upside down: below 1 the map has grown")
    assert found == pytest.approx(1 / factor, rel=1e-9)


def test_drift_of_a_path_with_errors(answer: ModuleType) -> None:
    """Least squares, not lengths of steps: the house's own alignment is the oracle."""
    path, true = grown(30, 1.1, 2)
    path = path + np.random.default_rng(3).normal(0, 0.05, path.shape)
    first, last = (align(path[p], true[p], with_scale=True).scale for p in (slice(0, 10), slice(20, 30)))
    assert answer.scale_drift(path, true) == pytest.approx(last / first, rel=1e-9)
    flat, level = path * [1, 1, 0], true * [1, 1, 0]  # in a plane a mirror image fits as well as a turn
    assert np.isfinite(answer.scale_drift(flat, level))


def test_drift_does_not_mirror(answer: ModuleType) -> None:
    """A mirrored path is no turned one: its scale is smaller than one."""
    true = grown(30, 1.0, 5)[1]
    mirrored = true.copy()
    mirrored[20:] *= [1, 1, -1]
    part = align(mirrored[20:], true[20:], with_scale=True).scale
    assert answer.scale_drift(mirrored, true) == pytest.approx(part, rel=1e-9)
    assert part < 0.99


def test_centres(answer: ModuleType) -> None:
    """The pieces together: a picture's centre follows from its kept pose."""
    T, _ = a_map(7)
    kept = answer.final_path(T[2:3], np.array([1]), T[1:2], T)
    np.testing.assert_allclose(
        camera_pose.centre_from_pose(kept), camera_pose.centre_from_pose(T[2:3]), atol=1e-12
    )
