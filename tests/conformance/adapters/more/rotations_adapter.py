"""Small libraries of rotations under the vectors; the variable ROTATIONS says which one is asked.

    ROTATIONS=transforms3d vslam-ref verify --module tests/conformance/adapters/more/rotations_adapter.py

Known: transforms3d, rowan, ahrs, pytransform3d.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from positional import asked


def transforms3d() -> dict[str, Any]:
    """Axis and angle, quaternions with w first."""
    from transforms3d import axangles, quaternions

    def log(R: Any) -> Any:
        axis, angle = axangles.mat2axangle(R)
        return axis * angle

    return {
        "so3.log": log,
        "quaternion.from_rotation": quaternions.mat2quat,
        "quaternion.to_rotation": quaternions.quat2mat,
    }


def rowan() -> dict[str, Any]:
    """Quaternions with w first."""
    import rowan as r

    def log(R: Any) -> Any:
        axis, angle = r.to_axis_angle(r.from_matrix(R))
        return (axis * angle).reshape(3)

    return {
        "so3.log": log,
        "quaternion.from_rotation": r.from_matrix,
        "quaternion.to_rotation": r.to_matrix,
        "so3.exp": lambda phi: r.to_matrix(r.exp(np.array([0.0, *(phi / 2)]))),
        "so3.random": lambda N: r.to_matrix(r.random.rand(int(N))),
    }


def ahrs() -> dict[str, Any]:
    """Direction cosine matrices, quaternions with w first."""
    import ahrs as a
    from ahrs.common.orientation import q_random

    def log(R: Any) -> Any:
        W = np.asarray(a.DCM(R).log)
        return -np.array([W[2, 1], W[0, 2], W[1, 0]])  # its matrices turn the axes

    return {
        "so3.log": log,
        "quaternion.from_rotation": lambda R: a.DCM(R).to_quaternion(),
        "quaternion.to_rotation": lambda q: a.Quaternion(q).to_DCM(),
        "so3.random": lambda N: np.array([a.Quaternion(q_random()).to_DCM() for _ in range(int(N))]),
    }


def pytransform3d() -> dict[str, Any]:
    """Rotations and screws; dual quaternions are not asked."""
    from pytransform3d import rotations as r
    from pytransform3d import transformations as t

    first = [3, 4, 5, 0, 1, 2]
    return {
        "so3.exp": r.matrix_from_compact_axis_angle,
        "so3.log": r.compact_axis_angle_from_matrix,
        "so3.left_jacobian": r.left_jacobian_SO3,
        "so3.left_jacobian_inverse": r.left_jacobian_SO3_inv,
        "quaternion.from_rotation": r.quaternion_from_matrix,
        "quaternion.to_rotation": r.matrix_from_quaternion,
        "se3.exp": lambda xi: t.transform_from_exponential_coordinates(xi[first]),
        "se3.log": lambda T: t.exponential_coordinates_from_transform(T)[first],
        "se3.left_jacobian": lambda xi: t.left_jacobian_SE3(xi[first])[np.ix_(first, first)],
        "se3.left_jacobian_inverse": lambda xi: t.left_jacobian_SE3_inv(xi[first])[np.ix_(first, first)],
        "se3.inverse": t.invert_transform,
        "se3.adjoint": lambda T: t.adjoint_from_transform(T)[np.ix_(first, first)],
        "so3.random": lambda N: np.array(
            [r.matrix_from_quaternion(r.random_quaternion(np.random.default_rng(k))) for k in range(int(N))]
        ),
    }


TABLE = {"transforms3d": transforms3d, "rowan": rowan, "ahrs": ahrs, "pytransform3d": pytransform3d}[
    os.environ.get("ROTATIONS", "transforms3d")
]()

answer = asked(TABLE)
