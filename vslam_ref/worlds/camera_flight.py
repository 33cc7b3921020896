r"""A camera that flies a closed curve in space, and an estimate of its path that is off by a known amount."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3, so3
from vslam_ref.metrics.trajectory import Trajectory


def fly(seconds: float = 30.0, rate: float = 20.0, rounds: float = 2.0) -> Trajectory:
    """Poses T_world_body on a curve of Lissajous, 4 m x 3 m x 1 m, turning with it.

    Parameters
    ----------
    seconds, rate : float
        Duration, and poses a second.
    rounds : float
        Times that the curve is flown.
    """
    times = np.arange(round(seconds * rate)) / rate
    a = 2 * np.pi * rounds * times / seconds
    t_world_body = np.stack([2.0 * np.cos(a), 1.5 * np.sin(2 * a), 0.5 * np.sin(3 * a)], axis=-1)
    turn = np.stack([0.2 * np.sin(2 * a), 0.2 * np.cos(a), a], axis=-1)
    return Trajectory(times, t_world_body, so3.exp(turn))


def estimate(truth: Trajectory, ate_rmse: float, turn_rmse: float, rng: np.random.Generator) -> Trajectory:
    """Return a path whose absolute error after the best rigid motion has exactly this root mean square.

    Errors e_i of positions are a slow drift and white noise, less their part that a rigid motion of the
    path would explain.  With p_i the true positions about their mean, sum e_i = 0 and sum e_i x p_i = 0.
    Then the matrix sum (p_i + e_i) p_i^T, from which the best rotation comes, is symmetric and positive, so
    the rotation is the identity, and the error that remains is e itself.

    Parameters
    ----------
    truth : Trajectory
    ate_rmse : float
        Metres.
    turn_rmse : float
        Of the angle of the rotations' errors, radians.
    rng : Generator

    Returns
    -------
    Trajectory
        At the times of ``truth``, in a world frame of its own.
    """
    count = len(truth)
    p = truth.t_world_body - truth.t_world_body.mean(axis=0)
    e = 0.5 * np.cumsum(rng.standard_normal((count, 3)), axis=0) / np.sqrt(count)
    e = _not_rigid(e + 0.2 * rng.standard_normal((count, 3)), p)
    e *= ate_rmse / np.sqrt(np.mean(np.sum(e**2, axis=1)))
    turn = rng.standard_normal((count, 3)) * turn_rmse / np.sqrt(3)
    frame = se3.exp(rng.uniform(-2.0, 2.0, 6))
    R = frame[:3, :3] @ so3.exp(turn) @ truth.R_world_body
    return Trajectory(truth.times, se3.act(frame, truth.t_world_body + e), R)


def _not_rigid(e: Array, p: Array) -> Array:
    """Displacements (N, 3) of points p without their part along translations and rotations of the whole."""
    axes = np.eye(3)
    moves = [np.broadcast_to(axis, p.shape) for axis in axes] + [np.cross(axis, p) for axis in axes]
    A = np.stack([move.ravel() for move in moves], axis=-1)  # (3 N, 6)
    e_flat = e.ravel()
    return np.asarray(e_flat - A @ np.linalg.lstsq(A, e_flat, rcond=None)[0]).reshape(-1, 3)
