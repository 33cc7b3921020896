"""The spanning tree of the keyframes: how they join it, and how it stays a tree when they are culled.

A keyframe joins the older one with which it shares most points when it comes.  So the tree is not the
minimum (or maximum) spanning tree of the covisibility graph, whose weights change with every point.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import se3
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.visual_map import shared_points


def link(feature_map: FeatureMap, kf: int) -> None:
    """Join a new keyframe to the tree: its parent is the older one with which it shares most points."""
    shared = shared_points(feature_map, kf)[:kf]
    if len(shared) and shared.max() > 0:
        feature_map.keyframes["parent"][kf] = int(np.argmax(shared))
    elif kf > 0:
        feature_map.keyframes["parent"][kf] = np.flatnonzero(feature_map.keyframes["alive"][:kf])[-1]


def cull_keyframe(feature_map: FeatureMap, kf: int) -> None:
    """Cull a keyframe: its sightings end, its children find another parent, its place is remembered.

    The first keyframe, and those of a loop edge, stay.
    """
    if kf == 0 or any(kf in edge for edge in feature_map.loop_edges):
        return
    shared = {int(child): shared_points(feature_map, int(child)) for child in children(feature_map, kf)}
    table = feature_map.keyframes
    parent = int(table["parent"][kf])
    candidates = [parent]
    while shared:  # the child that shares most points with a candidate, again and again
        pairs = [(child, c) for child in shared for c in candidates]
        child, best = max(pairs, key=lambda pair: shared[pair[0]][pair[1]])
        table["parent"][child] = best if shared[child][best] > 0 else parent
        candidates.append(child)
        del shared[child]
    T_parent = table["T_kf_world"][parent]
    table["T_kf_parent"][kf] = se3.compose(table["T_kf_world"][kf], se3.inverse(T_parent))
    table["alive"][kf] = False
    feature_map.culled += 1
    feature_map.take_back(feature_map.rows_in(kf))
    feature_map.new_references()


def children(feature_map: FeatureMap, kf: int) -> IntArray:
    """Keyframes whose parent this one is."""
    return np.flatnonzero((feature_map.keyframes["parent"] == kf) & feature_map.keyframes["alive"])


def settled_poses(feature_map: FeatureMap, T_kf_world: Array | None = None) -> Array:
    """Poses ``T_kf_world`` (K, 4, 4), the map's or others; a culled keyframe goes with its parent."""
    table = feature_map.keyframes
    T = (feature_map.T_kf_world if T_kf_world is None else T_kf_world).copy()
    done = table["alive"].copy()

    def settle(kf: int) -> None:
        parent = int(table["parent"][kf])
        if not done[parent]:
            settle(parent)
        T[kf], done[kf] = se3.compose(table["T_kf_parent"][kf], T[parent]), True

    for kf in np.flatnonzero(~done):
        settle(int(kf))
    return T
