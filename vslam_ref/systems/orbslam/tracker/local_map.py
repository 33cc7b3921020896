"""Which points a picture may show: those of keyframes near to it in the covisibility graph, or all."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.systems.orbslam.feature_map import NONE, FeatureMap
from vslam_ref.systems.orbslam.settings import TrackerSettings
from vslam_ref.systems.orbslam.spanning_tree import children
from vslam_ref.systems.visual_map import neighbours

SECOND = 10
"""Neighbours of a keyframe among which one more is taken."""


def local_points(feature_map: FeatureMap, seen: IntArray, s: TrackerSettings) -> IntArray:
    """Points that may be seen together with points ``seen (n,)``; numbers without a unit."""
    if s.local_map == "whole":
        return np.flatnonzero(feature_map.alive)
    table = feature_map.sightings
    rows = np.flatnonzero(table["on"])
    local = local_keyframes(feature_map, seen, s.local_keyframes)
    return np.unique(table["point"][rows[np.isin(table["kf"][rows], local)]])


def local_keyframes(feature_map: FeatureMap, seen: IntArray, most: int) -> IntArray:
    """Keyframes that see some of these points (n,), and a neighbour, a child and the parent of each.

    Those that see most points come first, ``most`` in all; numbers without a unit.
    """
    table = feature_map.sightings
    wanted = np.zeros(len(feature_map.points), np.bool_)
    wanted[seen] = True
    rows = np.flatnonzero(table["on"])
    votes = np.bincount(table["kf"][rows[wanted[table["point"][rows]]]], minlength=len(feature_map.keyframes))
    order = np.argsort(-votes, kind="stable")
    chosen = order[votes[order] > 0][:most].tolist()
    for kf in list(chosen):
        if len(chosen) >= most:
            break
        near = neighbours(feature_map, kf, SECOND).tolist()
        parent = int(feature_map.keyframes["parent"][kf])
        for group in (near, children(feature_map, kf).tolist(), [parent] if parent != NONE else []):
            chosen.extend([other for other in group if other not in chosen][:1])
    return np.array(chosen[:most], np.int64)
