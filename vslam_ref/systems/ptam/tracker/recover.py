"""A pose without a guess: patches followed from another picture, three points, and a fine pass."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.three_point_pose import AgreedPose, pose_by_three_points
from vslam_ref.features import View, finest_from_level, follow, level_from_finest, level_sigma
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.visual_map import PreparedPicture, VisualMap


class Known(NamedTuple):
    """Points seen in a picture: numbers (n,), pixels of level 0 (n, 2), levels (n,)."""

    point: IntArray
    uv: Array
    level: IntArray


def follow_known(before: PreparedPicture, now: PreparedPicture, known: Known, radius: float) -> Known:
    """Follow points from one picture into another, each on its level; what was not found is left out.

    The radius is in pixels of level 0, but 4 of the level at least.
    """
    place, ok = known.uv.copy(), np.zeros(len(known.point), np.bool_)
    for level in range(len(now.levels)):
        rows = np.flatnonzero(known.level == level)
        if len(rows) == 0:
            continue
        first = View(before.levels[level], before.corners[level])
        second = View(now.levels[level], now.corners[level])
        at = level_from_finest(known.uv[rows], level)
        went = follow(first, second, at, max(radius / 2.0**level, 4.0))
        place[rows], ok[rows] = finest_from_level(went.uv, level), went.ok
    return Known(known.point[ok], place[ok], known.level[ok])


def by_three_points(
    camera: Camera, X_world: Array, known: Known, rng: np.random.Generator
) -> AgreedPose | None:
    """Pose from three followed points (n, 3), own unit, with which most agree; None if few do."""
    return pose_by_three_points(camera, X_world, known.uv, rng, sigma_px=level_sigma(known.level))


def known_in(visual_map: VisualMap, kf: int) -> Known:
    """Points that a keyframe sees."""
    seen = visual_map.sightings
    rows = (seen["kf"] == kf) & seen["on"]
    return Known(seen["point"][rows], seen["uv"][rows], seen["level"][rows])


def picture_of(visual_map: VisualMap, kf: int) -> PreparedPicture:
    """Return a keyframe as a picture."""
    levels = tuple(visual_map.image(level)[kf] for level in range(visual_map.levels))
    return PreparedPicture(
        int(visual_map.keyframes["frame"][kf]), levels, visual_map.corners[kf], visual_map.small[kf]
    )


def most_alike(visual_map: VisualMap, picture: PreparedPicture, count: int) -> IntArray:
    """Keyframes whose small images differ least, without their means.

    Implements :eq:`eq-most-alike`, in grey levels squared; the count has no unit.
    """
    here = picture.small.value - picture.small.value.mean()
    others = np.stack([small.value - small.value.mean() for small in visual_map.small])
    order: IntArray = np.argsort(((others - here) ** 2).sum((1, 2)), kind="stable")
    return order[:count]
