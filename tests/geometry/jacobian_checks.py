"""Where the Jacobians of the groups are checked: generic, near the identity, at the threshold, near pi."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from vslam_ref.geometry import se2, se3, sim3, so3

AXIS = np.array([0.36, -0.48, 0.8])
ANGLES = (1e-7, 1.0 - 1e-9, 1.0 + 1e-9, 0.5, 2.1, np.pi - 0.05)  # the differences step by 0.006
RHO = np.array([1.3, -2.1, 0.7])
POINT = np.array([0.4, -1.9, 5.2])


def elements(group: ModuleType) -> list[np.ndarray]:
    """Elements for which ``log`` is smooth nearby, none of them the identity."""
    if group is so3:
        return [so3.exp(angle * AXIS) for angle in ANGLES]
    if group is se3:
        return [se3.exp([*RHO, *(angle * AXIS)]) for angle in ANGLES]
    if group is sim3:
        logs = (0.3, 1e-9, -0.8, 0.8660254, 1.2, -1e-3)  # with angle 0.5, 0.8660254 is at the threshold too
        return [sim3.exp([*RHO, *(a * AXIS), s]) for a, s in zip(ANGLES, logs, strict=True)]
    return [np.array([1.3, -2.1, angle]) for angle in (0.05 - 1e-9, 0.5 + 1e-9, -1.2, 3.0)]


def rows(group: ModuleType) -> dict[str, list[dict[str, Any]]]:
    name = group.__name__
    some = elements(group)
    point = POINT[:2] if group is se2 else POINT
    pairs = [(a, b) for a in some[-3:] for b in some[:3]]
    two = [
        {"arguments": pair, "fields": ("J_a", "J_b"), "groups": (group, group), "output": group}
        for pair in pairs
    ]
    one: list[dict[str, Any]] = [{"arguments": (a,), "fields": ("J_pose",), "groups": (group,)} for a in some]
    return {
        f"{name}.act_with_jacobians": [
            {"arguments": (a, point), "fields": ("J_pose", "J_point"), "groups": (group, None)} for a in some
        ],
        f"{name}.compose_with_jacobians": two,
        f"{name}.between_with_jacobians": two,
        f"{name}.inverse_with_jacobians": [{**row, "output": group} for row in one],
        f"{name}.log_with_jacobians": one,
    }


CHECKS = {name: row for group in (se2, so3, se3, sim3) for name, row in rows(group).items()}
