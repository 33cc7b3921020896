"""A landmark seen from the vehicle, and a landmark placed from what was seen.

The measurement is *relative Cartesian*: the landmark's coordinates in the vehicle frame, metres, x
ahead and y to the left.  The paper calls it the landmark in global coordinates (B20), an erratum.
innovation = measured - predicted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import se2, so2


class ObservationJacobians(NamedTuple):
    """Value (..., 2) and Jacobians in the pose (..., 2, 3) and in the landmark (..., 2, 2)."""

    value: Array
    J_pose: Array
    J_landmark: Array


class PlacementJacobians(NamedTuple):
    """Value (..., 2) and Jacobians in the pose (..., 2, 3) and in the measurement (..., 2, 2)."""

    value: Array
    J_pose: Array
    J_measurement: Array


def vehicle_from_world(T_world_vehicle: ArrayLike, landmark: ArrayLike) -> Array:
    """Landmark in the vehicle frame, R(theta)^T (landmark - position).

    Implements :eq:`eq-b21` (B21).

    Parameters
    ----------
    T_world_vehicle : array_like, shape (..., 3)
        Vehicle pose (x, y, theta) in the world, metres and radians.
    landmark : array_like, shape (..., 2)
        World coordinates, metres.

    Returns
    -------
    ndarray, shape (..., 2)
        Vehicle coordinates, metres.
    """
    return se2.act(se2.inverse(T_world_vehicle), landmark)


def vehicle_from_world_with_jacobians(
    T_world_vehicle: ArrayLike, landmark: ArrayLike
) -> ObservationJacobians:
    """:func:`vehicle_from_world` and its Jacobians; same parameters."""
    pose, landmark = np.asarray(T_world_vehicle, dtype=np.float64), np.asarray(landmark, dtype=np.float64)
    d = landmark - pose[..., :2]
    c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    value, J_pose, J_landmark = np.empty(d.shape), np.empty((*d.shape, 3)), np.empty((*d.shape, 2))
    value[..., 0] = c * d[..., 0] + s * d[..., 1]
    value[..., 1] = c * d[..., 1] - s * d[..., 0]
    J_landmark[..., 0, 0] = J_landmark[..., 1, 1] = c  # eq-jacobians-measurement
    J_landmark[..., 0, 1] = s
    J_landmark[..., 1, 0] = -s
    J_pose[..., :2] = -J_landmark
    J_pose[..., 0, 2] = value[..., 1]
    J_pose[..., 1, 2] = -value[..., 0]
    return ObservationJacobians(value, J_pose, J_landmark)


def world_from_vehicle(T_world_vehicle: ArrayLike, measurement: ArrayLike) -> Array:
    """World coordinates of a landmark measured in the vehicle frame.

    Implements :eq:`eq-b25` (B25), which is :eq:`eq-b23` (B23) composed as in :eq:`eq-b24` (B24).

    Parameters
    ----------
    T_world_vehicle : array_like, shape (..., 3)
        Vehicle pose in the world.
    measurement : array_like, shape (..., 2)
        Vehicle coordinates of the landmark, metres.
    """
    return se2.act(T_world_vehicle, measurement)


def world_from_vehicle_with_jacobians(
    T_world_vehicle: ArrayLike, measurement: ArrayLike
) -> PlacementJacobians:
    """:func:`world_from_vehicle` and its Jacobians; same parameters."""
    pose, z = np.asarray(T_world_vehicle, dtype=np.float64), np.asarray(measurement, dtype=np.float64)
    J_z = np.broadcast_to(so2.exp(pose[..., 2]), (*np.broadcast_shapes(pose.shape[:-1], z.shape[:-1]), 2, 2))
    turned = np.einsum("...ij,...j->...i", J_z, z)
    value = turned + pose[..., :2]
    J_pose = np.zeros((*value.shape[:-1], 2, 3))
    J_pose[..., 0, 0] = J_pose[..., 1, 1] = 1.0  # eq-jacobians-new
    J_pose[..., 0, 2] = -turned[..., 1]
    J_pose[..., 1, 2] = turned[..., 0]
    return PlacementJacobians(value, J_pose, J_z)
