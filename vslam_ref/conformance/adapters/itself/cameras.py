"""Chapter 03: cameras and their Jacobians."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import MODELS, Camera, ProjectionJacobians, pose_jacobian

Array = NDArray[Any]


def camera(model: str, params: Array) -> Camera:
    """Camera of a model's name; KeyError for a model that is not known."""
    return MODELS[model].from_params(params)


def _project(model: str, params: Array, X_cam: Array) -> dict[str, Any]:
    return camera(model, params).project(X_cam)._asdict()


def _unproject(model: str, params: Array, uv: Array) -> dict[str, Any]:
    return camera(model, params).unproject(uv)._asdict()


def _projected(model: str, params: Array, X_cam: Array) -> ProjectionJacobians:
    return camera(model, params).project_with_jacobians(X_cam)


def _jacobian_ray(model: str, params: Array, uv: Array) -> Array:
    return camera(model, params).unproject_with_jacobians(uv).J_pixel


def _jacobian_pose(model: str, params: Array, pose: Array, X_world: Array) -> Array:
    return camera(model, params).pixel_from_world_with_jacobians(pose, X_world).J_pose


def _jacobian_rig(model: str, params: Array, T_cam_rig: Array, pose: Array, X_world: Array) -> Array:
    """The rig's perturbation moves X_rig; the mount turns what it moves."""
    X_rig = se3.act(pose, X_world)
    J_cam = _projected(model, params, se3.act(T_cam_rig, X_rig)).J_point
    return pose_jacobian(J_cam @ se3.rotation(T_cam_rig), X_rig)


TABLE: Answers = {
    "camera.project": _project,
    "camera.unproject": _unproject,
    "camera.jacobian_ray": _jacobian_ray,
    "camera.jacobian_point": lambda **inputs: _projected(**inputs).J_point,
    "camera.jacobian_intrinsics": lambda **inputs: _projected(**inputs).J_intrinsics,
    "camera.jacobian_pose": _jacobian_pose,
    "camera.jacobian_rig": _jacobian_rig,
}
