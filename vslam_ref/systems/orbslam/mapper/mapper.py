"""Local mapping: what happens to a keyframe, one step after the other.

::

    features and sightings in, joined to the tree
      -> young points that do not prove themselves end      cull
      -> new points with the ten best neighbours            new_points
      -> looked for in the neighbours, and theirs in it     fuse
      -> the newest twelve keyframes are adjusted           adjusting
      -> neighbours that add nothing are culled             cull
      -> loops?                                             what the system was given for it
"""

from __future__ import annotations

from typing import NamedTuple

from vslam_ref.arrays import Array, IntArray
from vslam_ref.support.stopwatch import stage
from vslam_ref.systems.orbslam.feature_map import DescribedPicture, FeatureMap
from vslam_ref.systems.orbslam.mapper.adjusting import adjust_local
from vslam_ref.systems.orbslam.mapper.cull import cull_redundant, unproven
from vslam_ref.systems.orbslam.mapper.fuse import fuse_with_neighbours
from vslam_ref.systems.orbslam.mapper.new_points import new_points
from vslam_ref.systems.orbslam.settings import Settings
from vslam_ref.systems.orbslam.spanning_tree import link
from vslam_ref.systems.visual_map import Adjusted


class LocalMapping(NamedTuple):
    """What a keyframe brought.

    Attributes
    ----------
    kf : int
        Its number.
    new, seen, fused : int
        New points; sightings added by looking in neighbours; points that were fused.
    unproven, culled : int
        Young points that ended; keyframes that were culled.
    adjusted : Adjusted or None
    """

    kf: int
    new: int
    seen: int
    fused: int
    unproven: int
    culled: int
    adjusted: Adjusted | None


def map_keyframe(
    feature_map: FeatureMap,
    picture: DescribedPicture,
    T_cam_world: Array,
    feature: IntArray,
    point: IntArray,
    settings: Settings,
) -> LocalMapping:
    """Take a picture with its pose (4, 4) into the map, its features (n,) that show points (n,), and go on.

    Lengths have the map's own unit.  Implements A§3.1, local mapping.
    """
    s, f = settings.mapper, settings.features
    with stage("keyframe in"):
        kf = feature_map.add_keyframe(T_cam_world, picture)
        held = feature_map.alive[point]
        feature_map.see(kf, feature[held], point[held])
        link(feature_map, kf)
        ended = unproven(feature_map, kf, s)
        feature_map.remove(ended)
        feature_map.refresh(feature_map.measured_in(kf))
    with stage("new points"):
        fresh = new_points(feature_map, kf, s, f)
        feature_map.refresh(fresh)
    seen, fused, adjusted = 0, 0, None
    with stage("fuse"):
        if s.fuse:
            seen, fused = fuse_with_neighbours(feature_map, kf, s, f)
    with stage("local"):
        if s.local_steps:
            adjusted = adjust_local(feature_map, kf, settings)
            feature_map.refresh(feature_map.measured_in(kf))
    with stage("cull"):
        culled = cull_redundant(feature_map, kf, s)
    return LocalMapping(kf, len(fresh), seen, fused, len(ended), culled, adjusted)
