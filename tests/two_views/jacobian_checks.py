"""Where the Jacobian of the Sampson distances is checked: far from fitting, directions along and off axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.geometry import se3, so3

ROOM = "vslam_ref.geometry.multiview.two_views.sampson_distance."


class Motion:
    """The five numbers of a relative pose, as the check wants a group to be."""

    DOF = 5

    @staticmethod
    def perturb(T: np.ndarray, delta: np.ndarray) -> np.ndarray:
        from vslam_ref.geometry.multiview.two_views import perturb

        return perturb(T, delta)


A, B = np.array([0.31, -0.22]), np.array([0.12, 0.35])
MOTIONS = [
    se3.from_rt(so3.exp([0.3, -0.5, 0.2]), [0.6, -0.64, 0.48]),
    se3.from_rt(so3.exp([0.01, 0.02, -0.01]), [0.0, 0.0, 1.0]),  # ahead: the epipole is in the picture
    se3.from_rt(so3.exp([1.3, 0.4, -2.1]), [-3.0, 1.0, 0.5]),  # any length
]
CHECKS: dict[str, list[dict[str, Any]]] = {
    ROOM + "sampson_with_jacobians": [
        {"arguments": (T, A, B), "fields": ("J_motion", None, None), "groups": (Motion, None, None)}
        for T in MOTIONS
    ],
}
