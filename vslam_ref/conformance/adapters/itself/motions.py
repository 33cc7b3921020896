"""Chapter 02: rotations and rigid motions."""

from __future__ import annotations

from types import ModuleType

import numpy as np

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.geometry import quaternion, se2, se3, sim3, so2, so3


def _of(group: ModuleType, *names: str) -> Answers:
    return {f"{group.__name__.rpartition('.')[2]}.{name}": getattr(group, name) for name in names}


TABLE: Answers = {
    **_of(so3, "exp", "log", "left_jacobian", "left_jacobian_inverse", "interpolate", "nearest"),
    **_of(se3, "exp", "log", "compose", "inverse", "act", "adjoint", "interpolate"),
    **_of(se3, "left_jacobian", "left_jacobian_inverse"),
    **_of(sim3, "exp", "log", "compose", "inverse", "adjoint", "left_jacobian"),
    **_of(se2, "exp", "compose", "left_jacobian"),
    "so3.random": lambda N: so3.random(np.random.default_rng(), (int(N),)),
    "quaternion.from_rotation": quaternion.from_matrix,
    "quaternion.to_rotation": quaternion.matrix,
    "sim3.act": lambda S, x: sim3.act(S, x),
    "se3.act_jacobian": lambda pose, x: se3.act_with_jacobians(pose, x).J_pose,
    "so2.exp": lambda angle: so2.exp(angle),
    "so2.wrap": so2.wrap,
    "se2.log": lambda x: se2.log(x),
    "se2.inverse": lambda x: se2.inverse(x),
    "se2.adjoint": lambda x: se2.adjoint(x),
}
