"""Points looked for in keyframes that may see them: one more sighting, or the same point made twice."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.projection import expected, find
from vslam_ref.systems.orbslam.settings import FeatureSettings, MapperSettings
from vslam_ref.systems.visual_map import neighbours


def fuse_with_neighbours(
    feature_map: FeatureMap, kf: int, s: MapperSettings, f: FeatureSettings
) -> tuple[int, int]:
    """Look for a keyframe's points in its neighbours, and for theirs in it.

    Implements A§3.1, the map without points that were made twice.  Return how many sightings were added,
    and how many points were fused into others; numbers without a unit.
    """
    around = second_neighbours(feature_map, kf, s)
    seen = fused = 0
    for other in around.tolist():
        more = fuse(feature_map, other, feature_map.measured_in(kf), s.fuse_radius, f.near)
        seen, fused = seen + more[0], fused + more[1]
    table = feature_map.sightings
    rows = np.flatnonzero(table["on"])
    theirs = np.unique(table["point"][rows[np.isin(table["kf"][rows], around)]])
    more = fuse(feature_map, kf, theirs, s.fuse_radius, f.near)
    feature_map.refresh(feature_map.measured_in(kf))
    return seen + more[0], fused + more[1]


def second_neighbours(feature_map: FeatureMap, kf: int, s: MapperSettings) -> IntArray:
    """Neighbours of a keyframe and some of theirs, by number (n,); no unit."""
    first = neighbours(feature_map, kf, s.neighbours)
    more = [neighbours(feature_map, int(other), s.second) for other in first]
    return np.setdiff1d(np.concatenate([first, *more]), kf)


def fuse(feature_map: FeatureMap, kf: int, points: IntArray, radius: float, limit: int) -> tuple[int, int]:
    """Look for points (n,) in a keyframe that does not see them, ``radius`` pixels of the octave around.

    A feature that shows none gets the point.  Where it shows another one, both are fused into that which
    more keyframes see.  Return how many sightings were added, and how many points were fused.
    """
    new = np.setdiff1d(points, feature_map.measured_in(kf))
    at = expected(feature_map, new[feature_map.alive[new]], feature_map.T_kf_world[kf])
    feature = find(feature_map, at, features_of(feature_map, kf), radius=radius, limit=limit)
    rows = np.flatnonzero(feature >= 0)
    shown = feature_map.point_of(kf)[feature[rows]]
    free = shown < 0
    feature_map.see(kf, feature[rows[free]], at.point[rows[free]])
    ours, theirs = at.point[rows[~free]], shown[~free]
    count = feature_map.times_seen()
    keep_theirs = count[theirs] >= count[ours]
    old, kept = np.where(keep_theirs, ours, theirs), np.where(keep_theirs, theirs, ours)
    feature_map.replace(old, kept)
    return int(free.sum()), len(old)


def features_of(feature_map: FeatureMap, kf: int) -> OrbFeatures:
    """Features of a keyframe, as they were extracted; their responses are not kept."""
    rows, seen = feature_map.features(kf), feature_map.sightings
    return OrbFeatures(
        seen["uv"][rows],
        seen["level"][rows],
        seen["angle"][rows],
        np.zeros(rows.stop - rows.start),
        seen["descriptor"][rows],
    )
