"""Chapter 02: rotations and rigid motions."""

from __future__ import annotations

import numpy as np

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.geometry import quaternion, se2, se3, sim3, so2, so3

TABLE: Answers = {
    "so3.exp": lambda phi: so3.exp(phi),
    "so3.log": lambda R: so3.log(R),
    "so3.left_jacobian": lambda phi: so3.left_jacobian(phi),
    "so3.left_jacobian_inverse": lambda phi: so3.left_jacobian_inverse(phi),
    "so3.interpolate": lambda a, b, fraction: so3.interpolate(a, b, fraction),
    "so3.nearest": lambda M: so3.nearest(M),
    "so3.random": lambda N: so3.random(np.random.default_rng(), (int(N),)),
    "quaternion.from_rotation": lambda R: quaternion.from_matrix(R),
    "quaternion.to_rotation": lambda q: quaternion.matrix(q),
    **{
        f"se3.{name}": getattr(se3, name)
        for name in ("compose", "inverse", "act", "adjoint", "left_jacobian", "left_jacobian_inverse")
    },
    "se3.exp": lambda xi: se3.exp(xi),
    "se3.log": lambda T: se3.log(T),
    "se3.interpolate": lambda a, b, fraction: se3.interpolate(a, b, fraction),
    **{f"sim3.{name}": getattr(sim3, name) for name in ("exp", "compose")},
    "sim3.log": lambda S: sim3.log(S),
    "sim3.inverse": lambda S: sim3.inverse(S),
    "sim3.act": lambda S, x: sim3.act(S, x),
    "sim3.adjoint": lambda S: sim3.adjoint(S),
    "sim3.left_jacobian": lambda xi: sim3.left_jacobian(xi),
    "se3.act_jacobian": lambda pose, x: se3.act_with_jacobians(pose, x)[1],
    "so2.exp": lambda angle: so2.exp(angle),
    "so2.wrap": lambda angle: so2.wrap(angle),
    **{f"se2.{name}": getattr(se2, name) for name in ("exp", "compose", "left_jacobian")},
    "se2.log": lambda x: se2.log(x),
    "se2.inverse": lambda x: se2.inverse(x),
    "se2.adjoint": lambda x: se2.adjoint(x),
}
