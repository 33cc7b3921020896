"""Where the Jacobian of both images is checked: a scale far from 1, two lenses."""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.geometry import sim3
from vslam_ref.geometry.cameras import Camera, Pinhole, Radtan
from vslam_ref.worlds.keyframe_pair import make_keyframe_pair

PAIR = make_keyframe_pair(np.random.default_rng(3), count=5, wrong=0.0)
STEPS = ([0.0] * 7, [0.2, -0.1, 0.3, 0.1, -0.2, 0.05, -0.6])
LENSES = (
    Pinhole(500.0, 480.0, 320.0, 240.0),
    Radtan(420.0, 430.0, 310.0, 250.0, -0.2, 0.05, 1e-3, -2e-3, 0.0),
)


def row(camera: Camera, k: int, step: np.ndarray) -> dict[str, Any]:
    return {
        "arguments": (sim3.perturb(PAIR.S_b_a, step), PAIR.matches.X_a[k], PAIR.matches.X_b[k]),
        "fields": ("J_S", None, None),
        "constants": {"camera": camera},
        "groups": (sim3, None, None),
    }


def ratio(k: int, step: np.ndarray) -> dict[str, Any]:
    return {
        "arguments": (sim3.perturb(PAIR.S_b_a, step), PAIR.matches.X_a[k], PAIR.matches.X_b[k]),
        "fields": ("J_S", None, None),
        "groups": (sim3, None, None),
    }


CHECKS = {
    "vslam_ref.estimation.similarity.matches.distance_ratio_with_jacobians": [
        ratio(k, np.array(step)) for k, step in enumerate(STEPS)
    ],
    "vslam_ref.estimation.similarity.matches.both_images_with_jacobians": [
        row(camera, k, np.array(step)) for camera in LENSES for k, step in enumerate(STEPS)
    ],
}
