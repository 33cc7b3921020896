"""Where the Jacobians of the calibration's residual are checked: every lens, tilted boards, off the axis."""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Fisheye, Fov, Lens, Pinhole, Radtan, Rational

SENSOR = [536.1, 535.2, 342.4, 235.5]
LENSES: list[tuple[Lens, list[float]]] = [
    (Pinhole.lens, []),
    (Fov.lens, [0.88]),
    (Radtan.lens, [-0.265, -0.047, 1.8e-3, -3.1e-4, 0.25]),
    (Rational.lens, [0.9, 0.2, 1e-3, -5e-4, 0.01, 1.2, 0.5, 0.05]),
    (Fisheye.lens, [-0.0137, 0.0207, -0.0127, 0.0025]),
]
POSES = [se3.exp([-2.0, -1.5, 9.0, 0.5, -0.4, 0.1]), se3.exp([1.0, 2.0, 7.0, -0.7, 0.3, 2.9])]
CORNER = np.array([5.0, 2.0, 0.0])

CHECKS: dict[str, list[dict[str, Any]]] = {
    "vslam_ref.estimation.calibration.problem.residual_with_jacobians": [
        {
            "arguments": (np.array(SENSOR + k), T, CORNER, np.array([300.0, 200.0])),
            "fields": ("J_intrinsics", "J_pose", None, None),
            "constants": {"lens": lens},
            "groups": (None, se3, None, None),
        }
        for lens, k in LENSES
        for T in POSES
    ]
}
