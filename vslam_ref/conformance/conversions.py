"""How quantities change between the house's conventions and a program's: one small step for each choice.

A kind of quantity has a list of steps.  Out they are taken in order, home in the opposite one, each undone::

    house --order--> --side--> ... --> program
    house <--order-- <--side-- ... <-- program

A step that no declared choice touches is left out; where all are, a value stays as it is, to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.compare import numbers
from vslam_ref.geometry import se3, so3

if TYPE_CHECKING:
    from vslam_ref.conformance.conventions import Convention

ROTATION_FIRST = [3, 4, 5, 0, 1, 2]
ROTATION_FIRST_SIM3 = [3, 4, 5, 0, 1, 2, 6]
TURN = 2 * np.pi
Step = Callable[["Convention", str, Array, Mapping[str, Any], bool], Array]


def converted(c: Convention, kind: str, value: Any, inputs: Mapping[str, Any], home: bool) -> Any:
    """One quantity, from the house's form to the program's, or back ``home``."""
    if kind == "steps" and c.differs("angle_range"):
        return [{**record, "x": converted(c, "pose2", record["x"], inputs, home)} for record in value]
    steps = [step for names, step in STEPS.get(kind, ()) if c.differs(*names)]
    if not steps:
        return value
    x = numbers(value)
    for step in reversed(steps) if home else steps:
        x = step(c, kind, x, inputs, home)
    return x.tolist()


def negative(value: Any) -> Any:
    """A tangent vector of the other sign."""
    return (-numbers(value)).tolist()


def _inverted(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    return np.asarray(se3.inverse(x), dtype=np.float64)


def _transposed(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    return np.swapaxes(x, -1, -2)


def _w_last(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    return x[..., [3, 0, 1, 2] if home else [1, 2, 3, 0]]


def _conjugate(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    return np.asarray(x * np.array([1.0, -1.0, -1.0, -1.0]))


def _corner(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    moved = np.ones(x.shape)
    if kind == "intrinsics":  # cx and cy only
        moved = np.zeros(x.shape)
        moved[..., 2:4] = 1.0
    return x + (-0.5 if home else 0.5) * moved


def _other_sign(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    return -x


def _in_range(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    """Angles in the other range; one that is not in the declared range stays, and is wrong."""
    out = np.array(x, dtype=np.float64)
    heading = out[..., 2] if kind == "pose2" else out
    if c.angle_range == "[-pi, pi)":
        inside, moved = np.abs(heading) == np.pi, -heading  # either end, and what is left of the other
    elif home:
        inside, moved = (heading > np.pi) & (heading <= TURN), heading - TURN
        outside = (heading < 0) & (heading >= -np.pi)  # right in the house's range, not in the declared one
        inside, moved = inside | outside, np.where(outside, heading - TURN, moved)
    else:
        inside, moved = (heading < 0) & (heading > -np.pi), heading + TURN
    changed = np.where(inside, moved, heading)
    if kind == "pose2":
        out[..., 2] = changed
        return out
    return np.asarray(changed)


def _short_way(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    """The rotation vector of the same rotation that is at most a half turn long."""
    angle = np.linalg.norm(x, axis=-1, keepdims=True)
    long = home & (angle > np.pi) & (angle < TURN)
    return np.asarray(np.where(long, x * (1.0 - TURN / np.where(long, angle, 1.0)), x))


def _essential_size(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    """Size of an essential matrix, from that of the motion's translation."""
    t = numbers(inputs["T_b_a"])[:3, 3] if "T_b_a" in inputs else np.array([1.0, 0.0, 0.0])
    house = 2.0**0.5 * float(np.linalg.norm(t))
    theirs = 1.0 if c.essential == "unit_norm" else 2.0**0.5
    return np.asarray(x * house / theirs if home else x * theirs / house)


def _ordered(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    """Coordinates of tangent vectors, and rows and columns of matrices of them."""
    order = np.argsort(_order(c, kind)) if home else np.array(_order(c, kind))
    turned = (x[..., order, :] if kind.startswith("tangent_matrix") else x)[..., order]
    return np.asarray(turned)


def _order(c: Convention, kind: str) -> list[int]:
    """Where the program's coordinates stand in the house's."""
    if kind.endswith("se2"):
        return [2, 0, 1] if c.se2_order == "angle_first" else [0, 1, 2]
    order = ROTATION_FIRST if c.tangent_order == "rotation_first" else list(range(6))
    if not kind.endswith("sim3"):
        return order
    return [6, *order] if c.sim3_scale == "first" else [*order, 6]


def _on_pose(c: Convention, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
    """Jacobian, covariance or information of a pose's tangent vector.

    Implements :eq:`eq-convention-jacobian` and :eq:`eq-convention-covariance`.
    """
    M = from_program(c, inputs)[:, _order(c, "tangent")]  # xi = M eta, eta in the program's order
    M = np.asarray(np.linalg.inv(M)) if home else M
    if kind == "pose_jacobian":
        return np.asarray(x @ M)
    if kind == "pose_information":
        return np.asarray(np.swapaxes(M, -1, -2) @ x @ M)
    back = np.linalg.inv(M)
    return np.asarray(back @ x @ np.swapaxes(back, -1, -2))


def from_program(c: Convention, inputs: Mapping[str, Any]) -> Array:
    """M with xi = M eta, translations first in both.

    Implements :eq:`eq-convention-tangent`, and :eq:`eq-convention-split` where a step is split.
    """
    T, away = numbers(inputs["pose"]), c.transform == "world_from_cam"
    if c.pose_step == "split":
        own = np.asarray(se3.inverse(T) if away else T)  # the program's pose
        M = _split(own, c.perturbation)  # in left steps of that pose
        return np.asarray(-se3.adjoint(T) @ M) if away else M
    turned = (c.perturbation == "right") != away
    M = np.asarray(se3.adjoint(T)) if turned else np.eye(6)
    return -M if away else M


def _split(T: Array, side: str) -> Array:
    """Left step of a pose whose rotation is perturbed on a side, and whose translation is added to."""
    R, t = T[:3, :3], T[:3, 3]
    phi = R if side == "right" else np.eye(3)
    M = np.zeros((6, 6))
    M[:3, :3], M[:3, 3:], M[3:, 3:] = np.eye(3), so3.hat(t) @ phi, phi
    return M


POSE = (("transform",), _inverted)
ROWS = (("vectors",), _transposed)
RANGE = (("angle_range",), _in_range)
STEP = (("transform", "perturbation", "tangent_order", "pose_step"), _on_pose)
ORDER = (("tangent_order",), _ordered)
ORDER_SIM3 = (("tangent_order", "sim3_scale"), _ordered)
ORDER_SE2 = (("se2_order",), _ordered)
STEPS: dict[str, tuple[tuple[tuple[str, ...], Step], ...]] = {
    "pose": (POSE, ROWS),
    "poses": (POSE, ROWS),
    "motion": (ROWS,),
    "rotation": (ROWS,),
    "similarity": (ROWS,),
    "quaternion": ((("quaternion_product",), _conjugate), (("quaternion_order",), _w_last)),
    "rotation_vector": ((("rotation_angle",), _short_way),),
    "angle": (RANGE,),
    "pose2": (RANGE,),
    "essential": ((("essential",), _essential_size),),
    "tangent": (ORDER,),
    "tangent_matrix": (ORDER,),
    "tangent_sim3": (ORDER_SIM3,),
    "tangent_matrix_sim3": (ORDER_SIM3,),
    "tangent_se2": (ORDER_SE2,),
    "tangent_matrix_se2": (ORDER_SE2,),
    "pose_jacobian": (STEP,),
    "pose_covariance": (STEP,),
    "pose_information": (STEP,),
    "pixel": ((("pixel_origin",), _corner),),
    "intrinsics": ((("pixel_origin",), _corner),),
    "residual": ((("residual",), _other_sign),),
}
"""Kind of quantity -> choices, and the step that they make."""
