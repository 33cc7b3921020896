"""Where the Jacobians of the cameras are checked: off the axis, and both sides of every threshold."""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Fisheye, Fov, Lens, Pinhole, Radtan, Rational, fisheye, fov, radtan
from vslam_ref.geometry.cameras import projection as p

SENSOR = [458.654, 457.296, 367.215, 248.375]
# on both sides of (2 tan(omega/2) r)^2 = 0.1 and of rho^2/z^2 = 0.1, 0.1^0.5 = 0.3162277660168379
NEAR, FAR = 0.3162277660168379 * (1 - 1e-9), 0.3162277660168379 * (1 + 1e-9)
DIRECTION = np.array([0.6, -0.8])
OMEGAS = (0.3, 0.5 - 1e-9, 0.5 + 1e-9, 0.9332, 2.4)
RADTAN = [
    np.array([-0.28, 0.07, 2e-3, -3e-3, 0.02]),
    np.array([0.9, 0.2, 1e-3, -5e-4, 0.01, 1.2, 0.5, 0.05]),
]
FISHEYE = [np.array([-0.0137, 0.0207, -0.0127, 0.0025]), np.array([-0.1, 0.0, 0.0, 0.0])]
BEHIND = np.array([0.05, 0.02, 0.003, 0.01])  # grows to pi, also when a step of the check is taken
T_CAM_WORLD = se3.exp([0.3, -0.2, 0.5, 0.4, -0.3, 0.2])


def at(r: float, z: float = 1.7) -> np.ndarray:
    return np.array([*(r * abs(z) * DIRECTION), z])


def lens_rows(name: str, cases: list[tuple[np.ndarray, np.ndarray]]) -> dict[str, list[dict[str, Any]]]:
    rows = [{"arguments": case, "fields": ("J_lens", "J_point")} for case in cases]
    return {f"vslam_ref.geometry.cameras.{name}.distort_with_jacobians": rows}


LENSES: list[tuple[Lens, list[float]]] = [
    (Pinhole.lens, []),
    (Fov.lens, [0.9332]),
    (Radtan.lens, RADTAN[0].tolist()),
    (Rational.lens, RADTAN[1].tolist()),
    (Fisheye.lens, FISHEYE[0].tolist()),
]
X = np.array([0.7, -0.4, 1.9])
X_WORLD = se3.act(se3.inverse(T_CAM_WORLD), X)
ROOM = "vslam_ref.geometry.cameras.projection."

CHECKS: dict[str, list[dict[str, Any]]] = {
    **lens_rows(
        "fov",
        [
            (np.array([w]), at(r / (2 * np.tan(w / 2)) if r < 0.5 else r))
            for w in OMEGAS
            for r in (1e-3, NEAR, FAR, 0.9)
        ],
    ),
    **lens_rows("radtan", [(k, at(r)) for k in RADTAN for r in (1e-3, 0.4, 0.8)]),
    **lens_rows(
        "fisheye",
        [(k, at(r)) for k in FISHEYE for r in (0.05, NEAR, FAR, 2.0)] + [(BEHIND, at(2.0, -0.6))],
    ),
    ROOM + "project_with_jacobians": [
        {
            "arguments": (np.array(SENSOR + k), X),
            "fields": ("J_intrinsics", "J_point"),
            "constants": {"lens": lens},
        }
        for lens, k in LENSES
    ],
    ROOM + "unproject_with_jacobians": [
        {
            "arguments": (np.array(SENSOR + k), p.project(SENSOR + k, X, lens=lens).uv),
            "fields": (None, "J_pixel"),
            "constants": {"lens": lens},
        }
        for lens, k in LENSES
    ],
    ROOM + "pixel_from_world_with_jacobians": [
        {
            "arguments": (np.array(SENSOR + k), T_CAM_WORLD, X_WORLD),
            "fields": ("J_intrinsics", "J_pose", "J_point"),
            "constants": {"lens": lens},
            "groups": (None, se3, None),
        }
        for lens, k in LENSES
    ],
}
assert {fov.LENS, radtan.LENS, fisheye.LENS} <= {lens for lens, _ in LENSES}
