"""Where the Jacobians of an edge's error are checked: errors of a tenth and more, every space and convention.

Steps are on the right, T Exp(step): the groups below perturb so.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from vslam_ref.estimation.posegraph.spaces import GROUPS

NAME = "vslam_ref.estimation.posegraph.errors.edge_error_with_jacobians"
RIGHT = {
    space: SimpleNamespace(
        DOF=group.DOF, perturb=lambda T, step, group=group: group.compose(T, group.exp(step))
    )
    for space, group in GROUPS.items()
}


def rows(space: str) -> list[dict[str, Any]]:
    """One row for a smaller, a middle and a large error."""
    group, rng = GROUPS[space], np.random.default_rng(3)
    found = []
    for size in (0.1, 0.3, 0.9):
        tail, head = group.random(rng), group.random(rng)
        off = size * rng.standard_normal(group.DOF)
        measured = group.compose(group.between(tail, head), group.exp(off))
        for convention in ("log", "g2o"):
            found.append(
                {
                    "arguments": (tail, head, measured),
                    "fields": ("J_tail", "J_head", None),
                    "constants": {"space": space, "convention": convention},
                    "groups": (RIGHT[space], RIGHT[space], None),
                }
            )
    return found


CHECKS = {NAME: [row for space in GROUPS for row in rows(space)]}
