"""Where the Jacobians of corners and of the likelihood field are checked; see tests/jacobians."""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.grids.landmarks import DistanceField

rng = np.random.default_rng(8)
FIELD = DistanceField((-2.0, 1.0), 0.25, rng.uniform(0.1, 1.0, (14, 12)), 1.0)
# the interpolation is smooth inside of squares between cells' middles; none of these lies near a side
POSES = (np.array([0.05, -0.03, 0.02]), np.array([0.2, 0.4, -0.3]), np.array([0.4, 1.9, 2.6]))
POINTS = (np.array([-1.30, 2.21]), np.array([-0.67, 1.71]), np.array([0.31, -0.43]))
CENTRE = np.array([[0.3, -1.0], [2.0, 0.7]])
FIRST, LAST = "vslam_ref.grids.landmarks.", "_with_jacobians"

CHECKS: dict[str, list[dict[str, Any]]] = {
    FIRST + "lines.cross" + LAST: [
        {"arguments": (CENTRE, angle, offset), "fields": (None, "J_angle", "J_offset")}
        for angle, offset in (
            (np.array([0.3, 1.9]), np.zeros(2)),
            (np.array([-2.8, 1.1]), np.array([0.2, -0.4])),
            (np.array([0.1, 0.6]), np.array([-0.1, 0.3])),
        )
    ],
    FIRST + "field.scan_residuals" + LAST: [
        {"arguments": (pose, point), "fields": ("J_pose", "J_point"), "constants": {"field": FIELD}}
        for pose, point in zip(POSES, POINTS, strict=True)
    ],
}
