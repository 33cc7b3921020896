"""The robot's way: from point to point, turning on the spot, and what its wheels report of it.

Poses (x, y, theta) and increments (ds, dalpha) are in metres and radians.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.filters import vehicle
from vslam_ref.geometry import so2
from vslam_ref.worlds.floor_plan.config import RobotConfig


class Odometry(NamedTuple):
    """Measured increments.

    Attributes
    ----------
    increment : ndarray, shape (n, 2)
        ``ds`` (m) along the heading, then ``dalpha`` (rad), between scan k and scan k + 1.
    cov : ndarray, shape (n, 2, 2)
        Covariance of its errors.
    """

    increment: Array
    cov: Array


def true_increments(route: ArrayLike, config: RobotConfig) -> tuple[Array, Array]:
    """Start pose (3,) and true increments (n, 2) of a route (k, 2): turn, drive, turn, drive.

    Raises
    ------
    ValueError
        If the route has fewer than two points, or two neighbours are the same.
    """
    route = np.asarray(route, dtype=np.float64)
    legs = np.diff(route, axis=0)
    lengths = np.linalg.norm(legs, axis=1)
    if len(legs) == 0 or not np.isfinite(lengths).all() or lengths.min() == 0.0:
        raise ValueError("route: need at least two points, finite, each away from the one before")
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    turns = so2.wrap(np.diff(headings, append=headings[-1:]))
    pieces = []
    for length, turn in zip(lengths, turns, strict=True):
        pieces.append(_steps(length, config.speed * config.scan_period, 0))
        if turn != 0.0:
            pieces.append(_steps(turn, config.turn_rate * config.scan_period, 1))
    start = np.array([*route[0], headings[0]])
    return start, np.concatenate(pieces)


def _steps(amount: float, most: float, axis: int) -> Array:
    """Equal increments of at most ``most`` that add up to ``amount``."""
    n = int(np.ceil(abs(amount) / most - 1e-9))
    steps = np.zeros((n, 2))
    steps[:, axis] = amount / n
    return steps


def drive(start: ArrayLike, increments: ArrayLike) -> Array:
    """Poses (n + 1, 3) from a start pose (3,) by increments (n, 2)."""
    T_world_robot = [np.asarray(start, dtype=np.float64)]
    for increment in np.asarray(increments, dtype=np.float64):
        T_world_robot.append(vehicle.propagate(T_world_robot[-1], increment))
    return np.stack(T_world_robot)


def measure(increments: ArrayLike, config: RobotConfig, rng: np.random.Generator) -> Odometry:
    """Noisy odometry of true increments (n, 2); the covariance is that of the true increments."""
    true = np.asarray(increments, dtype=np.float64)
    ds, dalpha = np.abs(true[:, 0]), np.abs(true[:, 1])
    variance = np.stack(
        [config.drift_ds**2 * ds, config.drift_turn**2 * dalpha + config.drift_heading**2 * ds], axis=1
    )
    noisy = true + np.sqrt(variance) * rng.standard_normal(true.shape)
    return Odometry(noisy, variance[:, :, None] * np.eye(2))
