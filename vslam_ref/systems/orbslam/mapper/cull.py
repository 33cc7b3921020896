"""What is taken out again: young points that do not prove themselves, keyframes that add nothing."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.settings import MapperSettings
from vslam_ref.systems.orbslam.spanning_tree import cull_keyframe
from vslam_ref.systems.visual_map import shared_points


def unproven(feature_map: FeatureMap, newest: int, s: MapperSettings) -> IntArray:
    """Young points that were found too seldom where they were expected, or are seen by too few keyframes.

    Implements A§3.1, the choice of points; those of the start count as proven.
    """
    table = feature_map.points
    age = newest - table["born"]
    young = table["alive"] & (age <= s.young) & (table["born"] > 1)
    seldom = table["found"] < s.found * table["tried"]
    few = (age >= 2) & (feature_map.times_seen() < s.least_seen)
    return np.flatnonzero(young & (seldom | few))


def cull_redundant(feature_map: FeatureMap, newest: int, s: MapperSettings) -> int:
    """Cull neighbours of the newest keyframe that see little that others do not see as well.

    A point counts as seen as well by another keyframe on the same octave, a finer one, or the next coarser.
    Return how many keyframes were culled.
    """
    before = feature_map.culled
    around = np.flatnonzero(shared_points(feature_map, newest))
    for kf in around[(around > 0) & (around < newest)].tolist():
        if redundant_share(feature_map, kf, s.others) > s.redundant:
            cull_keyframe(feature_map, kf)
    return feature_map.culled - before


def redundant_share(feature_map: FeatureMap, kf: int, others: int) -> float:
    """Share of a keyframe's points that at least so many other keyframes see as well; no unit."""
    seen, own = feature_map.sightings, feature_map.rows_in(kf)
    if len(own) == 0:
        return 1.0
    level = np.full(len(feature_map.points), -1)
    level[seen["point"][own]] = seen["level"][own]
    rows = np.flatnonzero(seen["on"])
    rows = rows[(seen["kf"][rows] != kf) & (seen["level"][rows] <= level[seen["point"][rows]] + 1)]
    count = np.bincount(seen["point"][rows], minlength=len(feature_map.points))
    return float((count[seen["point"][own]] >= others).mean())
