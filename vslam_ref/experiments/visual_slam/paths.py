"""Paths of a run as trajectories, and how far their scale drifts."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3
from vslam_ref.metrics.trajectory import Trajectory, absolute_error

LEAST_THIRD = 3
"""Pairs of poses in a third of the path, that its scale may be measured."""


def trajectory(times: Array | None, T_cam_world: Array) -> Trajectory:
    """Poses ``T_cam_world`` (n, 4, 4) as a trajectory of the camera in the world, in the order of time."""
    T = se3.inverse(T_cam_world)
    path = Trajectory(None, T[:, :3, 3], T[:, :3, :3])
    if times is None:
        return path
    order = np.argsort(times, kind="stable")  # stamps may fall
    sorted_path = path.take(order)
    return Trajectory(times[order], sorted_path.t_world_body, sorted_path.R_world_body)


def scale_drift(estimate: Trajectory, truth: Trajectory) -> float | None:
    """Scale S_truth_estimate of the last third over that of the first; None where one is not known."""
    third = len(truth) // 3
    if third < LEAST_THIRD:
        return None
    scale = []
    for rows in (np.arange(third), np.arange(len(truth) - third, len(truth))):
        try:
            scale.append(absolute_error(estimate.take(rows), truth.take(rows), "sim3").alignment.scale)
        except ValueError:
            return None
    return scale[1] / scale[0]
