"""Where the Jacobians of the vehicle and of its sightings are checked; see tests/jacobians."""

from __future__ import annotations

from typing import Any

import numpy as np

POSES = (np.array([1.3, -2.1, 0.7]), np.array([-40.0, 3.0, -2.9]), np.array([0.2, 0.1, np.pi - 1e-4]))
CHECKS: dict[str, list[dict[str, Any]]] = {
    "vslam_ref.filters.vehicle.ackermann_with_jacobians": [
        {
            "arguments": (np.array(u),),
            "fields": ("J_control",),
            "constants": {"wheelbase": 2.7, "dt": 0.13},
        }
        for u in ([1.2, 0.4], [-0.8, -1.1], [5.0, 1e-9])
    ],
    "vslam_ref.filters.vehicle.propagate_with_jacobians": [
        {"arguments": (pose, np.array(u)), "fields": ("J_pose", "J_increment"), "angle": 2}
        for pose in POSES
        for u in ([0.6, 0.2], [-3.0, -1.4])
    ],
    "vslam_ref.filters.observation.vehicle_from_world_with_jacobians": [
        {"arguments": (pose, np.array([4.2, -1.9])), "fields": ("J_pose", "J_landmark")} for pose in POSES
    ],
    "vslam_ref.filters.observation.world_from_vehicle_with_jacobians": [
        {"arguments": (pose, np.array([3.1, 2.4])), "fields": ("J_pose", "J_measurement")} for pose in POSES
    ],
}
