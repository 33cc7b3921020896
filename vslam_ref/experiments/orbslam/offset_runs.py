"""One run of ORB-SLAM over a recorded sequence, in numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.experiments.ptam.offset_runs import run_twice, told
from vslam_ref.experiments.ptam.recorded import RecordedSequence
from vslam_ref.systems.orbslam import OrbSlam, Settings
from vslam_ref.systems.orbslam.feature_map import FeatureMap

COMMON = 15
"""Points that two keyframes must share to be called of one place: ORB-SLAM's least covisibility."""


class OrbOffsetRun(NamedTuple):
    """What became of one run: the numbers of :class:`~vslam_ref.experiments.ptam.offset_runs.OffsetRun`.

    And beside them:

    Attributes
    ----------
    loops, rejected, culled : ndarray
        Loops closed, candidates refused, keyframes culled.
    revisits, recognised : ndarray
        Pairs of the table from the map's start on, and those whose keyframes know that they are of one place.
    """

    offset: IntArray
    started: BoolArray
    first: IntArray
    second: IntArray
    frames: IntArray
    tracked: IntArray
    lost: IntArray
    share_all: Array
    share_after: Array
    error: Array
    live: Array
    second_error: Array
    drift: Array
    refined_error: Array
    refined_drift: Array
    keyframes: IntArray
    points: IntArray
    reason: NDArray[np.str_]
    loops: IntArray
    rejected: IntArray
    culled: IntArray
    revisits: IntArray
    recognised: IntArray


def run_offset(
    each: RecordedSequence, offset: int, pictures: int | None = None, settings: Settings | None = None
) -> OrbOffsetRun:
    """Run ORB-SLAM from one picture to the end; where the table asks for it, with a refined camera, too.

    Parameters
    ----------
    each : RecordedSequence
    offset : int
        The first picture.
    pictures : int, optional
        At most; by default all.
    settings : Settings, optional
    """
    done, second = run_twice(each, offset, pictures, settings or Settings())
    assert isinstance(done.system, OrbSlam)
    counts, pairs = done.system.counts(), revisits(each, done.system)
    return OrbOffsetRun(
        *told(each, offset, done, second)._replace(keyframes=np.array(_used(done.system.map))),
        np.array(counts["loops"]),
        np.array(counts["loops_rejected"]),
        np.array(counts["culled_keyframes"]),
        np.array(len(pairs)),
        np.array(0 if done.system.map is None else sum(one_place(done.system.map, *pair) for pair in pairs)),
    )


def _used(feature_map: FeatureMap | None) -> int:
    return 0 if feature_map is None else len(feature_map.used_keyframes())


def revisits(each: RecordedSequence, system: OrbSlam) -> list[tuple[int, int]]:
    """Pairs of the table of which the map can know both pictures."""
    if system.started_at is None:
        return []
    begin = system.started_at[0]
    return [pair for pair in each.revisits if min(pair) >= begin and max(pair) <= max(system.poses)]


def one_place(feature_map: FeatureMap, a: int, b: int) -> bool:
    """Whether the keyframes nearest in time to two pictures share points, or a loop has joined them."""
    used = feature_map.used_keyframes()
    frame = feature_map.keyframes["frame"][used]
    near = [int(used[np.argmin(np.abs(frame - number))]) for number in (a, b)]
    joined = {frozenset(pair) for pair in feature_map.loop_edges}
    return bool(feature_map.covisible(near[0])[near[1]] >= COMMON) or frozenset(near) in joined
