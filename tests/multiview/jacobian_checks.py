"""Where the Jacobians of the room are checked: skew rays, directions of any length."""

from __future__ import annotations

from typing import Any

import numpy as np

ROOM = "vslam_ref.geometry.multiview.closest_point."
P_A, P_B = np.array([0.4, -1.9, 0.7]), np.array([-1.3, 0.2, 1.1])
B_A, B_B = np.array([0.2, 0.6, 1.9]), np.array([0.8, -0.3, 1.2])  # not of length 1

CHECKS: dict[str, list[dict[str, Any]]] = {
    ROOM + "midpoint_with_jacobians": [
        {"arguments": arguments, "fields": ("J_p_a", "J_b_a", "J_p_b", "J_b_b")}
        for arguments in (
            (P_A, B_A, P_B, B_B),
            (P_A, B_A / np.linalg.norm(B_A), P_B, B_B / np.linalg.norm(B_B)),
            (P_A, np.array([0.0, 0.0, 1.0]), P_B, np.array([1.0, -1.0, -0.2])),
        )
    ],
}
