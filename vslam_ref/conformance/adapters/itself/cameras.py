"""Chapter 03: cameras and their Jacobians."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import MODELS, Camera, pose_jacobian

Array = NDArray[Any]


def camera(model: str, params: Array) -> Camera:
    """Camera of a model's name; KeyError for a model that is not known."""
    return MODELS[model].from_params(params)


def _project(model: str, params: Array, X_cam: Array) -> dict[str, Any]:
    seen = camera(model, params).project(X_cam)
    return {"uv": seen.uv, "valid": seen.valid}


def _unproject(model: str, params: Array, uv: Array) -> dict[str, Any]:
    ray = camera(model, params).unproject(uv)
    return {"bearing": ray.bearing, "valid": ray.valid}


def _jacobian_rig(model: str, params: Array, T_cam_rig: Array, pose: Array, X_world: Array) -> Array:
    """The rig's perturbation moves X_rig; the mount turns what it moves."""
    X_rig = se3.act(pose, X_world)
    J_cam = camera(model, params).project_with_jacobians(se3.act(T_cam_rig, X_rig)).J_point
    return pose_jacobian(J_cam @ se3.rotation(T_cam_rig), X_rig)


TABLE: Answers = {
    "camera.project": _project,
    "camera.unproject": _unproject,
    "camera.jacobian_ray": lambda model, params, uv: (
        camera(model, params).unproject_with_jacobians(uv).J_pixel
    ),
    "camera.jacobian_point": lambda model, params, X_cam: (
        camera(model, params).project_with_jacobians(X_cam).J_point
    ),
    "camera.jacobian_intrinsics": lambda model, params, X_cam: (
        camera(model, params).project_with_jacobians(X_cam).J_intrinsics
    ),
    "camera.jacobian_pose": lambda model, params, pose, X_world: (
        camera(model, params).pixel_from_world_with_jacobians(pose, X_world).J_pose
    ),
    "camera.jacobian_rig": _jacobian_rig,
}
