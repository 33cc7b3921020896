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


What else may be declared stands in :data:`DECLARABLE`, a line each; how a quantity changes, in
:mod:`.conversions`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args, get_type_hints

from vslam_ref.conformance import conversions
from vslam_ref.conformance.catalogue import Function
from vslam_ref.conformance.conversions import ROTATION_FIRST, ROTATION_FIRST_SIM3

__all__ = [
    "DECLARABLE",
    "ROTATION_FIRST",
    "ROTATION_FIRST_SIM3",
    "Convention",
    "Declarable",
    "read",
]

JACOBIANS = tuple(f"{group}.left_jacobian" for group in ("so3", "se3", "se2", "sim3"))
"""Of the groups; their inverses have the same names with _inverse."""


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
        Of SE(3) and Sim(3).
    quaternion_order : {"wxyz", "xyzw"}
    pixel_origin : {"centre", "corner"}
        Whether (0, 0) is the centre or the outer corner of the top-left pixel.
    residual : {"predicted_minus_measured", "measured_minus_predicted"}
    angle_range : {"(-pi, pi]", "[-pi, pi)", "[0, 2pi)"}
        Where angles and headings lie.
    rotation_angle : {"[0, pi]", "[0, 2pi)"}
        Length of the logarithm of a rotation.
    group_jacobian : {"left", "right"}
        Which Jacobian of a group a program has.
    vectors : {"columns", "rows"}
        Rows: x' = x M, and all matrices of motions are transposed.
    pose_step : {"screw", "split"}
        Split: rotation and translation of a pose step apart, SO(3) x R^3.
    essential : {"of_the_translation", "unit_translation", "unit_norm"}
        Size of an essential matrix.
    quaternion_product : {"hamilton", "jpl"}
        JPL: the quaternion of a rotation matrix is the conjugate of Hamilton's.
    se2_order : {"translation_first", "angle_first"}
        Of the tangent vectors of SE(2).
    sim3_scale : {"last", "first"}
        Where the logarithm of the scale stands in a tangent vector of Sim(3).
    """

    transform: Literal["cam_from_world", "world_from_cam"] = "cam_from_world"
    perturbation: Literal["left", "right"] = "left"
    tangent_order: Literal["translation_first", "rotation_first"] = "translation_first"
    quaternion_order: Literal["wxyz", "xyzw"] = "wxyz"
    pixel_origin: Literal["centre", "corner"] = "centre"
    residual: Literal["predicted_minus_measured", "measured_minus_predicted"] = "predicted_minus_measured"
    angle_range: Literal["(-pi, pi]", "[-pi, pi)", "[0, 2pi)"] = "(-pi, pi]"
    rotation_angle: Literal["[0, pi]", "[0, 2pi)"] = "[0, pi]"
    group_jacobian: Literal["left", "right"] = "left"
    vectors: Literal["columns", "rows"] = "columns"
    pose_step: Literal["screw", "split"] = "screw"
    essential: Literal["of_the_translation", "unit_translation", "unit_norm"] = "of_the_translation"
    quaternion_product: Literal["hamilton", "jpl"] = "hamilton"
    se2_order: Literal["translation_first", "angle_first"] = "translation_first"
    sim3_scale: Literal["last", "first"] = "last"

    def inputs(self, function: Function, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Inputs in the program's form."""
        given = {name: inputs[name] for name in function.inputs}
        if self.group_jacobian == "right" and function.name.removesuffix("_inverse") in JACOBIANS:
            given = {name: conversions.negative(value) for name, value in given.items()}  # J_r(-x) = J_l(x)
        return {name: self.converted(kind, given[name], inputs) for name, kind in function.inputs.items()}

    def outputs(
        self, function: Function, outputs: Mapping[str, Any], inputs: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Outputs of a program in the house's form; ``inputs`` are the house's."""
        known = {name: kind for name, kind in function.outputs.items() if name in outputs}
        return {name: self.converted(kind, outputs[name], inputs, home=True) for name, kind in known.items()}

    def converted(self, kind: str, value: Any, inputs: Mapping[str, Any], *, home: bool = False) -> Any:
        """One quantity, from the house's form to the program's, or back ``home``."""
        return conversions.converted(self, kind, value, inputs, home)

    def differs(self, *names: str) -> bool:
        """Whether one of these choices is not the house's."""
        return any(getattr(self, name) != getattr(Convention, name) for name in names)


class Declarable(NamedTuple):
    """A choice that a program may declare.

    Attributes
    ----------
    name, value : str
        As in the JSON file.
    changes : str
        What it means.
    """

    name: str
    value: str
    changes: str


DECLARABLE = (
    Declarable("transform", "world_from_cam", "poses map the camera's coordinates to the world's"),
    Declarable("perturbation", "right", "poses are perturbed on the right, T Exp(eta)"),
    Declarable("tangent_order", "rotation_first", "rotation stands before translation"),
    Declarable("quaternion_order", "xyzw", "w stands last"),
    Declarable("pixel_origin", "corner", "(0, 0) is the corner of the top-left pixel"),
    Declarable("residual", "measured_minus_predicted", "residuals have the other sign"),
    Declarable("angle_range", "[0, 2pi)", "angles and headings lie in [0, 2 pi)"),
    Declarable("angle_range", "[-pi, pi)", "half a turn is -pi"),
    Declarable("rotation_angle", "[0, 2pi)", "rotation vectors are up to a whole turn long"),
    Declarable("group_jacobian", "right", "Jacobians of groups are the right ones, J(-xi)"),
    Declarable("vectors", "rows", "vectors are rows: matrices of motions are transposed"),
    Declarable("pose_step", "split", "rotation and translation of a pose step apart, SO(3) x R^3"),
    Declarable("essential", "unit_translation", "essential matrices are those of a unit translation"),
    Declarable("essential", "unit_norm", "essential matrices have norm 1"),
    Declarable("quaternion_product", "jpl", "quaternions are JPL's: the conjugates of Hamilton's"),
    Declarable("se2_order", "angle_first", "the angle stands before the translation in SE(2)"),
    Declarable("sim3_scale", "first", "the scale stands first in Sim(3)"),
)
"""Every choice that is not the house's, with what it changes."""


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
