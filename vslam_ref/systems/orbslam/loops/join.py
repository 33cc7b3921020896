"""A loop that is believed is closed: both visits become one map.

1. the group of the current keyframe is put where the loop says, with the points it sees;
2. points of both visits that are one become one; the group's pictures are searched for the place's points;
3. pairs of keyframes that now share points are joined, and the loop's error is spread (``correction``);
4. every point goes with its reference keyframe; culled keyframes and what was kept beside the map, too;
5. everything is adjusted.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.posegraph import Options
from vslam_ref.geometry import se3, sim3
from vslam_ref.systems.orbslam.essential_graph import EssentialEdges, essential_edges
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.loop_settings import LoopSettings
from vslam_ref.systems.orbslam.loops.correction import Correction, Loop, close_loop, move_points
from vslam_ref.systems.orbslam.loops.verify import LoopVerdict, points_around
from vslam_ref.systems.orbslam.mapper.fuse import fuse
from vslam_ref.systems.visual_map.telling import Pose


class Joined(NamedTuple):
    """What a closing did.

    Attributes
    ----------
    correction : Correction
        Of the keyframes in use, in their order.
    scale : ndarray, shape (K,)
        By which lengths near each keyframe have changed, a ratio; 1 for none.
    edges, fused : int
        Edges of the essential graph; points that were fused into others.
    """

    correction: Correction
    scale: Array
    edges: int
    fused: int


def join(feature_map: FeatureMap, verdict: LoopVerdict, s: LoopSettings) -> Joined:
    """Close a loop in the map, all but the adjustment of everything.

    Parameters
    ----------
    feature_map : FeatureMap
        Changed in place.
    verdict : LoopVerdict
        A loop.
    s : LoopSettings

    Returns
    -------
    Joined
    """
    used, table = feature_map.used_keyframes(), feature_map.keyframes
    T_before, X_before = feature_map.T_kf_world.copy(), feature_map.X_world.copy()
    shared = feature_map.covisibility()
    edges = _edges(feature_map, used, shared, s)
    group = np.flatnonzero(shared[verdict.current] >= s.group)
    group = np.union1d(group[table["alive"][group]], [verdict.current]).astype(np.int64)
    alive_before = int(feature_map.alive.sum())
    _place(feature_map, group, verdict)
    _fuse(feature_map, group, verdict, s)
    pairs = _new_pairs(shared, feature_map.covisibility(), group, used, s)
    number = np.full(len(table), -1)
    number[used] = np.arange(len(used))
    loop = Loop(
        int(number[verdict.candidate]),
        int(number[verdict.current]),
        verdict.S_candidate_current,
        number[group],
        number[pairs],
    )
    found = close_loop(T_before[used], edges, loop, options=Options(max_iterations=s.steps))
    S_world_kf = se3.inverse(T_before)
    S_world_kf[used] = found.S_world_kf
    feature_map.new_references()
    points = np.flatnonzero(feature_map.alive)
    home = feature_map.points["reference_kf"][points]
    feature_map.X_world[points] = move_points(X_before[points], home, T_before, S_world_kf)
    table["T_kf_world"][used] = found.T_kf_world
    scale = _scales(feature_map, S_world_kf)
    table["T_kf_parent"][:, :3, 3] *= scale[:, None]
    feature_map.loop_edges.append((verdict.candidate, verdict.current))
    feature_map.refresh(points)
    feature_map.version += 1
    return Joined(found, scale, len(edges.tail) + 1 + len(pairs), alive_before - len(points))


def rescaled(poses: Mapping[int, Pose], scale: Array) -> dict[int, Pose]:
    """Poses relative to keyframes, with lengths changed as near these: ``scale (K,)``, a ratio."""
    return {
        number: pose._replace(
            T_cam_kf=se3.from_rt(pose.T_cam_kf[:3, :3], scale[pose.kf] * pose.T_cam_kf[:3, 3])
        )
        for number, pose in poses.items()
    }


def _edges(feature_map: FeatureMap, used: IntArray, shared: IntArray, s: LoopSettings) -> EssentialEdges:
    """Return the essential graph of the keyframes in use, by their places among these."""
    number = np.full(len(feature_map.keyframes) + 1, -1)  # the last stands for no parent
    number[used] = np.arange(len(used))
    parent = number[feature_map.keyframes["parent"][used]]
    loops = number[np.array(feature_map.loop_edges, dtype=np.int64).reshape(-1, 2)]
    return essential_edges(shared[np.ix_(used, used)], parent, loops, theta_min=s.theta_min)


def _place(feature_map: FeatureMap, group: IntArray, verdict: LoopVerdict) -> None:
    """Put a group of keyframes where the loop says, and the points they see with them."""
    T, c = feature_map.T_kf_world, verdict.candidate
    # from the world as the group has it to the world as the candidate has it
    move = se3.inverse(T[c]) @ verdict.S_candidate_current @ T[verdict.current]
    points = np.unique(np.concatenate([feature_map.measured_in(int(kf)) for kf in group]))
    placed = sim3.compose(move, se3.inverse(T[group]))
    T[group] = se3.inverse(se3.from_rt(sim3.rotation(placed), sim3.translation(placed)))
    feature_map.X_world[points] = sim3.act(move, feature_map.X_world[points])


def _fuse(feature_map: FeatureMap, group: IntArray, verdict: LoopVerdict, s: LoopSettings) -> None:
    """Make one point of two: those of the loop's own pairs, then those that the group's pictures show."""
    shown = feature_map.point_of(verdict.current)[verdict.feature]
    has = shown >= 0
    feature_map.see(verdict.current, verdict.feature[~has], verdict.point[~has])
    feature_map.replace(shown[has], verdict.point[has])
    feature_map.refresh(feature_map.measured_in(verdict.current))
    place = points_around(feature_map, verdict.candidate)
    for kf in group.tolist():
        points = np.unique(feature_map.current(place))
        fuse(feature_map, kf, points[points >= 0], s.fuse_radius, s.bits)


def _new_pairs(
    before: IntArray, after: IntArray, group: IntArray, used: IntArray, s: LoopSettings
) -> IntArray:
    """Pairs of the group and another keyframe that share many points only now, (L, 2)."""
    others = np.setdiff1d(used, group)
    new = (after[np.ix_(group, others)] >= s.theta_min) & (before[np.ix_(group, others)] < s.group)
    row, column = np.nonzero(new)
    return np.column_stack([group[row], others[column]]).astype(np.int64)


def _scales(feature_map: FeatureMap, S_world_kf: Array) -> Array:
    """Change of scale of each keyframe (K,); a culled one goes with its parent."""
    table, scale = feature_map.keyframes, sim3.scale(S_world_kf)
    for kf in range(len(table)):
        at = kf
        while not table["alive"][at] and table["parent"][at] >= 0:
            at = int(table["parent"][at])
        scale[kf] = scale[at]
    return scale
