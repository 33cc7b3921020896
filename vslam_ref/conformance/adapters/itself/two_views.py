"""Chapter 09: matrices, motions, distances and costs of two pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.geometry.multiview import fundamental_from_essential, two_views
from vslam_ref.geometry.multiview._rays import across

Array = NDArray[Any]


def _signed(E: Array) -> Array:
    """The one of both signs whose entry of largest size is positive."""
    signed: Array = E * np.sign(E.flat[np.argmax(np.abs(E))])
    return signed


def _five(xn_a: Array, xn_b: Array) -> Array:
    found = two_views.five_point_essentials(xn_a[None, :5], xn_b[None, :5])
    E = found.E[found.valid]
    best = np.argmin(np.abs(two_views.essential_sampson(E, xn_a[5:], xn_b[5:]))[:, 0])
    return _signed(E[best])


def _K(params: Array) -> Array:
    fx, fy, cx, cy = params
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _motion(E: Array, xn_a: Array, xn_b: Array) -> Array:
    motions = two_views.essential_motions(E)
    costs = two_views.cheirality(motions, xn_a, xn_b).squared.sum(axis=1)
    best: Array = motions[np.argmin(costs)]
    return best


def _planar(H: Array, xn_a: Array) -> Array:
    found = two_views.homography_motions(H, xn_a)
    if found.reason:
        raise ValueError(found.reason)
    best: Array = found.T_b_a[np.argmax(found.possible)]
    return best


def _of_plane(T_b_a: Array, normal: Array, d: float) -> Array:
    return two_views.plane_homography(T_b_a, normal, d)


def _turn_slope(T_b_a: Array, xn_a: Array, xn_b: Array) -> dict[str, Any]:
    at = two_views.sampson_with_jacobians(T_b_a, xn_a, xn_b)
    return {"value": float(at.residual[0]), "J_turn": at.J_motion[0, 2:]}


def _direction_slope(T_b_a: Array, xn_a: Array, xn_b: Array, v: Array) -> float:
    """The two numbers of a direction are those along two vectors across it."""
    J = two_views.sampson_with_jacobians(T_b_a, xn_a, xn_b).J_motion[0, :2]
    return float(J @ across(T_b_a[:3, 3]) @ v)


TABLE: Answers = {
    "two_views.eight_point": lambda xn_a, xn_b: _signed(two_views.linear_essential(xn_a, xn_b).E),
    "two_views.five_point": _five,
    "two_views.homography": lambda x_a, x_b: two_views.fit_homography(x_a, x_b),
    "two_views.nearest_essential": lambda M: two_views.nearest_essential(M),
    "two_views.fundamental": lambda E, params_a, params_b: fundamental_from_essential(
        E, _K(params_a), _K(params_b)
    ),
    "two_views.homography_of_plane": _of_plane,
    "two_views.motion_from_essential": _motion,
    "two_views.motion_from_homography": _planar,
    "two_views.homography_distance": lambda H, x_a, x_b: float(
        np.sum(two_views.homography_sampson(H, x_a[None], x_b[None]) ** 2)
    ),
    "two_views.sampson_turn_jacobian": _turn_slope,
    "two_views.sampson_direction_derivative": _direction_slope,
    "two_views.depths": lambda T_b_a, xn_a, xn_b: two_views.depths(T_b_a, xn_a[None], xn_b[None])[0],
    "two_views.cheirality_cost": lambda T_b_a, xn_a, xn_b, sigma: float(
        two_views.cheirality(T_b_a, xn_a[None], xn_b[None], sigma).squared[0]
    ),
    "two_views.draws": lambda share, size, confidence: two_views.draws_needed(share, int(size), confidence),
    "two_views.truncated_cost": lambda squared, most: float(two_views.truncated_cost(squared, most)),
    "two_views.model_criterion": lambda squared, dimension, unknowns: two_views.torr_criterion(
        squared, int(dimension), int(unknowns)
    ),
}
