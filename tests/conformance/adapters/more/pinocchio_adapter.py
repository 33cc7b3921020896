"""Pinocchio under the vectors; its Jexp and Jlog are those of the right side, so they are asked at -xi.

vslam-ref verify --module tests/conformance/adapters/more/pinocchio_adapter.py
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from positional import asked


def se3(T: Any) -> pin.SE3:
    """A motion of a matrix."""
    return pin.SE3(np.asarray(T))


TABLE = {
    "so3.exp": pin.exp3,
    "so3.log": pin.log3,
    "so3.left_jacobian": lambda phi: pin.Jexp3(-phi),
    "so3.left_jacobian_inverse": lambda phi: pin.Jlog3(pin.exp3(-phi)),
    "se3.exp": lambda xi: pin.exp6(pin.Motion(xi)).homogeneous,
    "se3.log": lambda T: pin.log6(se3(T)).vector,
    "se3.inverse": lambda T: se3(T).inverse().homogeneous,
    "se3.adjoint": lambda T: se3(T).action,
    "se3.left_jacobian": lambda xi: pin.Jexp6(pin.Motion(-xi)),
    "se3.left_jacobian_inverse": lambda xi: pin.Jlog6(pin.exp6(pin.Motion(-xi))),
    "se3.interpolate": lambda a, b, fraction: pin.SE3.Interpolate(se3(a), se3(b), fraction).homogeneous,
}

answer = asked(TABLE)
