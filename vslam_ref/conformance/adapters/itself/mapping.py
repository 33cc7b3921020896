"""Chapter 11: two rays and their depths, the curve of a ray, matches there and back, the nearest keyframe."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.itself.cameras import camera
from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.features.templates import cut
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.systems.ptam import policy
from vslam_ref.systems.ptam.mapper import book, curve_search

Array = NDArray[Any]


def _ray_depths(a: Array, b: Array, T_b_a: Array) -> Array:
    found: Array = curve_search.ray_depths(a[None], b[None], T_b_a)[0]
    return found


def _triangulated(params: Array, uv_a: Array, uv_b: Array, T_b_a: Array, sigma_px: float) -> dict[str, Any]:
    found = book.triangulate(Pinhole(*params), uv_a, uv_b, T_b_a, float(sigma_px))
    return {"X": found.X_a, "sigma": found.depth_sigma}


def _on_curve(model: str, params: Array, uv_a: Array, distance: float, T_b_a: Array) -> Array:
    lens = camera(model, params)
    there = lens.project(se3.act(T_b_a, float(distance) * lens.unproject(uv_a).bearing))
    if not there.valid:
        raise ValueError("the point has no image there")
    return there.uv


def _curve_distance(model: str, params: Array, bearing_a: Array, uv_b: Array, T_b_a: Array) -> float:
    return book.curve_distance(camera(model, params), bearing_a, uv_b, T_b_a)


def _keyframe_distance(T_kfs: Array, pose: Array, X_world: Array) -> float:
    seen = SimpleNamespace(depth=se3.act(pose, X_world)[:, 2])
    fine = SimpleNamespace(seen=seen, weights=np.ones(len(X_world)))
    made, tracked = SimpleNamespace(T_kf_world=T_kfs), SimpleNamespace(fine=fine, T_cam_world=pose)
    return policy.distance(made, tracked)  # type: ignore[arg-type]


def _match(
    params: Array, images: Array, corners_a: Array, corners_b: Array, T_b_a: Array, gates: Array
) -> dict[str, Any]:
    """The fast search there, and the plain one back."""
    distance, near, limit, back = (float(v) for v in gates)
    lens, (first, second) = Pinhole(*params), np.asarray(images).astype(np.uint8)
    xy_a, xy_b = (np.asarray(xy).astype(np.int32) for xy in (corners_a, corners_b))
    asked, there = (curve_search.with_bearings(lens, xy, 0) for xy in (xy_a[:1], xy_b))
    rules = curve_search.Gates(0, near, distance, limit)
    found = curve_search.search_curve(cut(first, xy_a[:1]).patch, asked, second, there, T_b_a, rules)
    number = int(found.corner[0])
    if number < 0:
        return {"number": -1, "kept": False}
    a, b = (
        book.Side(0, image, [(int(x), int(y)) for x, y in xy])
        for image, xy in ((first, xy_a), (second, xy_b))
    )
    slow = book.Gates(distance, near, limit, back)
    return {
        "number": number,
        "kept": book.comes_back(lens, a.corners[0], b.corners[number], a, b, T_b_a, slow),
    }


TABLE: Answers = {
    "mapping.ray_depths": _ray_depths,
    "mapping.depth_sigma": lambda depths, parallax, eps_a, eps_b: book.depth_sigma(
        depths, float(parallax), float(eps_a), float(eps_b)
    ),
    "mapping.triangulated_depth": _triangulated,
    "mapping.on_curve": _on_curve,
    "mapping.curve_distance": _curve_distance,
    "mapping.keyframe_distance": _keyframe_distance,
    "mapping.match_on_line": _match,
}
