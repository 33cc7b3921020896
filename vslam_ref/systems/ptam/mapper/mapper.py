"""What happens to a keyframe: sightings in, look again, new points, neighbours, adjustment, culling."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle import Options, Robust
from vslam_ref.estimation.robust import tuned
from vslam_ref.support.stopwatch import stage
from vslam_ref.systems.ptam.mapper.associate import look_again, look_in_neighbours, seldom_found
from vslam_ref.systems.ptam.mapper.new_points import new_points
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker.recover import Known
from vslam_ref.systems.visual_map import (
    Adjusted,
    PreparedPicture,
    VisualMap,
    adjust,
    local_active,
    neighbours,
)


class MappedKeyframe(NamedTuple):
    """What a keyframe brought.

    Attributes
    ----------
    kf : int
        Its number.
    again, new, elsewhere : int
        Points found by looking again; new points; sightings of these in neighbours.
    adjusted : tuple of Adjusted
        Local, and global where it was due.
    culled : int
        Points that were found too seldom.
    """

    kf: int
    again: int
    new: int
    elsewhere: int
    adjusted: tuple[Adjusted, ...]
    culled: int


def map_keyframe(
    visual_map: VisualMap,
    picture: PreparedPicture,
    T_cam_world: Array,
    seen: Known,
    settings: Settings,
) -> MappedKeyframe:
    """Take a picture with its pose ``T_cam_world (4, 4)`` into the map, and make the map better by it.

    Lengths have the map's own unit.  Implements A§2.2.2.1.
    """
    s, f = settings.mapper, settings.features
    kf = visual_map.add_keyframe(T_cam_world, picture)
    held = visual_map.alive[seen.point]
    visual_map.observe(kf, seen.point[held], seen.level[held], seen.uv[held])
    alive = np.flatnonzero(visual_map.alive)
    with stage("look again"):
        again = look_again(visual_map, kf, picture, alive, s.look_radius, f.looks)
    with stage("new points"):
        fresh = new_points(visual_map, kf, picture, s, f)
    with stage("neighbours"):
        around = neighbours(visual_map, kf, s.neighbours)
        elsewhere = look_in_neighbours(visual_map, around, fresh, s.look_radius, f.looks)
    with stage("local"):
        adjusted = [adjust_local(visual_map, kf, settings)]
    if kf % s.global_every == 0:
        with stage("global"):
            adjusted.append(adjust_all(visual_map, settings, s.global_steps))
    bad = seldom_found(visual_map, s.tries, s.found)
    visual_map.remove(bad)
    return MappedKeyframe(kf, len(again), len(fresh), elsewhere, tuple(adjusted), len(bad))


def adjust_local(visual_map: VisualMap, kf: int, settings: Settings) -> Adjusted:
    """Move the newest keyframe and its neighbours, with the points they see."""
    s = settings.mapper
    active = local_active(visual_map, kf, s.local)
    return adjust(visual_map, robust(settings), active=active, options=options(s.local_steps))


def adjust_all(visual_map: VisualMap, settings: Settings, steps: int) -> Adjusted:
    """Move everything but the first keyframe."""
    return adjust(visual_map, robust(settings), options=options(steps))


def robust(settings: Settings) -> Robust:
    """Tukey's loss, its scale from the errors."""
    t = settings.tracker
    return Robust(tuned(t.loss, 2), "adaptive", t.least_sigma)


def options(steps: int) -> Options:
    """End where another step would not be seen in a pixel."""
    return Options(cost=1e-4, scale=1e-2, max_iterations=steps)
