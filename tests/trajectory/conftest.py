"""Paths with known errors, and the recorded pairs with their published numbers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vslam_ref.metrics.trajectory import Trajectory


def random_path(seed: int, n: int = 40) -> Trajectory:
    """A smooth random walk, poses 0.1 s apart."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.normal(size=(n, 3)), axis=0) + 20
    phi = np.cumsum(0.2 * rng.normal(size=(n, 3)), axis=0)
    return Trajectory(0.1 * np.arange(n), t, Rotation.from_rotvec(phi).as_matrix())


def moved(path: Trajectory, seed: int, scale: float = 1.0) -> Trajectory:
    """The path in another world frame, and in another unit of length."""
    rng = np.random.default_rng(seed)
    R, t = Rotation.random(random_state=rng).as_matrix(), 10 * rng.normal(size=3)
    return Trajectory(path.times, scale * path.t_world_body @ R.T + t, R @ path.R_world_body)


def noisy(path: Trajectory, seed: int, size: float = 0.1) -> Trajectory:
    rng = np.random.default_rng(seed)
    n = len(path)
    turn = Rotation.from_rotvec(size * rng.normal(size=(n, 3))).as_matrix()
    return Trajectory(
        path.times, path.t_world_body + size * rng.normal(size=(n, 3)), turn @ path.R_world_body
    )


@pytest.fixture
def make() -> tuple[Callable[..., Trajectory], ...]:
    """Return ``random_path``, ``moved`` and ``noisy``."""
    return random_path, moved, noisy
