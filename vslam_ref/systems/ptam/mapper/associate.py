"""Points that are in the map already, looked for where a known pose says that they are."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.systems.ptam.tracker.recover import picture_of
from vslam_ref.systems.visual_map import Looks, PreparedPicture, VisualMap, look, visible


def look_again(
    visual_map: VisualMap, kf: int, picture: PreparedPicture, points: IntArray, radius: float, looks: Looks
) -> IntArray:
    """Look in a keyframe for points (n,) that it does not see yet, within a radius in pixels.

    What is found is added to the map; its points are returned.
    """
    new = np.setdiff1d(points, visual_map.measured_in(kf))
    seen = visible(visual_map, visual_map.T_kf_world[kf], new)
    found = look(visual_map, seen, picture, radius, looks)
    visual_map.observe(kf, seen.point[found.ok], seen.level[found.ok], found.uv[found.ok])
    return seen.point[found.ok]


def look_in_neighbours(
    visual_map: VisualMap, keyframes: IntArray, points: IntArray, radius: float, looks: Looks
) -> int:
    """Look for new points (n,) in other keyframes (k,), within a radius in pixels.

    Return how many sightings were added.
    """
    total = 0
    for kf in keyframes:
        picture = picture_of(visual_map, int(kf))
        total += len(look_again(visual_map, int(kf), picture, points, radius, looks))
    return total


def seldom_found(visual_map: VisualMap, tries: int, share: float) -> IntArray:
    """Points that were looked for often and found in too small a share of the looks.

    Implements :eq:`eq-seldom-found`.
    """
    table = visual_map.points
    often = table["alive"] & (table["tried"] >= tries)
    return np.flatnonzero(often & (table["found"] < share * table["tried"]))
