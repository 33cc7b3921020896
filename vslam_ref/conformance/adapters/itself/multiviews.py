"""Chapter 01: points from rays, poses from points, similarities."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.estimation.resection import refine_pose, resect
from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.geometry.alignment import align
from vslam_ref.geometry.camera_pose import camera_from_world, pose_from_centre
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.geometry.multiview.closest_point import midpoint, midpoint_with_jacobians
from vslam_ref.geometry.multiview.epipolar import (
    epipolar_distance,
    essential_from_motion,
    sampson_distance,
)
from vslam_ref.geometry.multiview.point_state import PointState
from vslam_ref.geometry.multiview.three_points import p3p
from vslam_ref.geometry.multiview.triangulation import triangulate_linear
from vslam_ref.geometry.multiview.views import Views

Array = NDArray[Any]

LEAST_PARALLAX = 1e-6
"""Radians.  Noise-free rays may be triangulated at far smaller angles than noisy ones."""


def _triangulate(T_cams: Array, bearings: Array) -> Array:
    found = triangulate_linear(T_cams, bearings[None], min_parallax=LEAST_PARALLAX)
    _require(found.state[0])
    X: Array = found.X_world[0]
    return X


def _optimal(T_cams: Array, params: Array, uv: Array) -> dict[str, Array]:
    found = triangulate(Views(Pinhole.from_params(params), T_cams), uv[None], min_parallax=LEAST_PARALLAX)
    _require(found.state[0])
    return {"X": found.X_world[0], "covariance": found.cov_X[0]}


def _require(state: int) -> None:
    if state != PointState.OK:
        raise ValueError(PointState(state).reason)


def _pnp(params: Array, X_world: Array, uv: Array) -> Array:
    found = resect(Pinhole.from_params(params), X_world, uv)
    if not found.converged:
        raise ValueError(found.reason)
    return found.T_cam_world


def _pose_optimal(params: Array, X_world: Array, uv: Array, start: Array) -> Array:
    found = refine_pose(Pinhole.from_params(params), X_world, uv, start)
    if not found.converged:
        raise ValueError(found.reason)
    return found.T_cam_world


def _midpoint_jacobian(p_a: Array, b_a: Array, p_b: Array, b_b: Array) -> dict[str, Array]:
    found = midpoint_with_jacobians(p_a, b_a, p_b, b_b)
    return {"J_p_a": found.J_p_a, "J_b_a": found.J_b_a}


def _p3p(bearings: Array, X_world: Array) -> Array:
    found = p3p(bearings[None], X_world[None])
    if found.reason[0]:
        raise ValueError(found.reason[0])
    poses: Array = found.T_cam_world[0][found.valid[0]]
    return poses


def _umeyama(source: Array, target: Array, with_scale: bool) -> dict[str, Any]:
    found = align(source, target, with_scale=bool(with_scale))
    if not found.unique:
        raise ValueError(found.reason)
    return {"scale": found.scale, "R": found.R_target_source, "t": found.t_target_source}


TABLE: Answers = {
    "multiview.triangulate": _triangulate,
    "multiview.triangulate_optimal": _optimal,
    "multiview.pnp": _pnp,
    "multiview.pose_optimal": _pose_optimal,
    "multiview.midpoint_jacobian": _midpoint_jacobian,
    "multiview.p3p": _p3p,
    "multiview.essential": lambda T_b_a: essential_from_motion(T_b_a),
    "multiview.umeyama": _umeyama,
    "multiview.alignment_error": lambda source, target, with_scale: (
        align(source, target, with_scale=bool(with_scale)).rmse
    ),
    "multiview.pose_from_centre": pose_from_centre,
    "multiview.epipolar_distance": epipolar_distance,
    "multiview.sampson_distance": sampson_distance,
    "multiview.midpoint": midpoint,
    "multiview.camera_from_world": camera_from_world,
}
