r"""A program's own conventions, so that only real errors remain.

A program may say, in a JSON file, how it writes things down::

    {"transform": "world_from_cam", "perturbation": "right", "tangent_order": "rotation_first"}

Inputs are turned into its form before they are sent, outputs are turned back before they are compared.

*Poses and their tangent vectors.*  The house moves ``T_cam_world <- Exp(xi) T_cam_world``.  With eta the
program's tangent vector and T short for ``T_cam_world``:

==================  ============  =========================  =================
the program's pose  perturbation  the same motion            so xi =
==================  ============  =========================  =================
T_cam_world         left          Exp(eta) T                 eta
T_cam_world         right         T Exp(eta)                 Ad_T eta
T_world_cam         right         (T^-1 Exp(eta))^-1         -eta
T_world_cam         left          (Exp(eta) T^-1)^-1         -Ad_T eta
==================  ============  =========================  =================

With xi = M eta, a Jacobian is J_program = J M, and a covariance M P_program M^T = P
(:eq:`eq-convention-tangent` and the two after it, chapter 24).  An information H becomes M^T H M.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args, get_type_hints

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.catalogue import Function
from vslam_ref.conformance.compare import numbers
from vslam_ref.geometry import se3

CHANGED_BY = {
    "pose": "transform",
    "poses": "transform",
    "quaternion": "quaternion_order",
    "pixel": "pixel_origin",
    "intrinsics": "pixel_origin",
    "residual": "residual",
}
"""Kind of quantity -> the choice that changes it; tangents are changed by their order."""
ON_POSES = ("pose_jacobian", "pose_covariance", "pose_information")
ROTATION_FIRST = [3, 4, 5, 0, 1, 2]
ROTATION_FIRST_SIM3 = [3, 4, 5, 0, 1, 2, 6]


@dataclass(frozen=True)
class Convention:
    """How a program writes things down; the defaults are the house's.

    Parameters
    ----------
    transform : {"cam_from_world", "world_from_cam"}
        What a camera's pose maps.
    perturbation : {"left", "right"}
        On which side of its pose a program perturbs.
    tangent_order : {"translation_first", "rotation_first"}
    quaternion_order : {"wxyz", "xyzw"}
    pixel_origin : {"centre", "corner"}
        Whether (0, 0) is the centre or the outer corner of the top-left pixel.
    residual : {"predicted_minus_measured", "measured_minus_predicted"}
    """

    transform: Literal["cam_from_world", "world_from_cam"] = "cam_from_world"
    perturbation: Literal["left", "right"] = "left"
    tangent_order: Literal["translation_first", "rotation_first"] = "translation_first"
    quaternion_order: Literal["wxyz", "xyzw"] = "wxyz"
    pixel_origin: Literal["centre", "corner"] = "centre"
    residual: Literal["predicted_minus_measured", "measured_minus_predicted"] = "predicted_minus_measured"

    def inputs(self, function: Function, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Inputs in the program's form."""
        return {name: self.converted(kind, inputs[name], inputs) for name, kind in function.inputs.items()}

    def outputs(
        self, function: Function, outputs: Mapping[str, Any], inputs: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Outputs of a program in the house's form; ``inputs`` are the house's."""
        known = {name: kind for name, kind in function.outputs.items() if name in outputs}
        return {name: self.converted(kind, outputs[name], inputs, home=True) for name, kind in known.items()}

    def converted(self, kind: str, value: Any, inputs: Mapping[str, Any], *, home: bool = False) -> Any:
        """One quantity, from the house's form to the program's, or back ``home``."""
        about = "tangent_order" if kind.startswith("tangent") else CHANGED_BY.get(kind)
        on_pose = kind in ON_POSES
        if not on_pose and (about is None or getattr(self, about) == getattr(Convention, about)):
            return value
        x, order = numbers(value), np.array(self._order(kind))
        order, half = (np.argsort(order), -0.5) if home else (order, 0.5)
        if on_pose:
            return self._on_pose(kind, x, inputs, home).tolist()
        if about == "transform":
            return se3.inverse(x).tolist()
        if about == "quaternion_order":
            return x[..., [3, 0, 1, 2] if home else [1, 2, 3, 0]].tolist()
        if about == "pixel_origin":
            return (x + half * (_centre(x) if kind == "intrinsics" else 1.0)).tolist()
        if about == "residual":
            return (-x).tolist()
        turned = x[..., order, :] if kind.startswith("tangent_matrix") else x
        return turned[..., order].tolist()

    def _on_pose(self, kind: str, x: Array, inputs: Mapping[str, Any], home: bool) -> Array:
        """Jacobian, covariance or information of a pose's tangent vector.

        Implements :eq:`eq-convention-jacobian` and :eq:`eq-convention-covariance`.
        """
        M = self._from_program(inputs)[:, self._order(kind)]  # xi = M eta, eta in the program's order
        M = np.asarray(np.linalg.inv(M)) if home else M
        if kind == "pose_jacobian":
            return np.asarray(x @ M)
        if kind == "pose_information":
            return np.asarray(np.swapaxes(M, -1, -2) @ x @ M)
        back = np.linalg.inv(M)
        return np.asarray(back @ x @ np.swapaxes(back, -1, -2))

    def _order(self, kind: str) -> list[int]:
        """Where the program's coordinates stand in the house's."""
        if self.tangent_order == "translation_first":
            return list(range(7 if kind.endswith("sim3") else 6))
        return ROTATION_FIRST_SIM3 if kind.endswith("sim3") else ROTATION_FIRST

    def _from_program(self, inputs: Mapping[str, Any]) -> Array:
        """M with xi = M eta, translations first in both.

        Implements :eq:`eq-convention-tangent`.
        """
        away = self.transform == "world_from_cam"
        turned = (self.perturbation == "right") != away
        M = se3.adjoint(numbers(inputs["pose"])) if turned else np.eye(6)
        return -M if away else M


def _centre(params: Array) -> Array:
    """Ones at cx and cy."""
    ones = np.zeros(params.shape)
    ones[..., 2:4] = 1.0
    return ones


def read(path: Path) -> Convention:
    """Read a program's convention.

    Raises
    ------
    ValueError
        With one line that names the file and what is right.
    """
    hints = {name: get_args(hint) for name, hint in get_type_hints(Convention).items()}
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not JSON ({error})") from None
    if not isinstance(content, dict):
        raise ValueError(f'{path}: need an object such as {{"transform": "world_from_cam"}}')
    for name, value in content.items():
        if name not in hints:
            raise ValueError(f"{path}: unknown convention {name!r}; known: {', '.join(hints)}")
        if value not in hints[name]:
            raise ValueError(f"{path}: {name} is {value!r}; expected {' or '.join(hints[name])}")
    return Convention(**content)
