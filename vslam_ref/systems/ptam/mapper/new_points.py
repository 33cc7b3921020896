"""New points from a keyframe: strong corners that nothing explains yet, found in a neighbour and back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.features import Templates, finest_from_level, level_from_finest, level_sigma
from vslam_ref.features.templates import cut
from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.multiview import Views
from vslam_ref.systems.ptam.look import peaks, spread, strong_corners
from vslam_ref.systems.ptam.mapper.curve_search import Corner, search_curve, with_bearings
from vslam_ref.systems.ptam.settings import FeatureSettings, MapperSettings
from vslam_ref.systems.visual_map import Looks, Picture, VisualMap, shared_points
from vslam_ref.systems.visual_map.measure import locate


class Side(NamedTuple):
    """A keyframe on one level: picture, corners with rays, pose."""

    picture: Picture
    corner: Corner
    T_cam_world: Array


class Pairs(NamedTuple):
    """Matches: row among the candidates (n,), pixel of level 0 in either picture (n, 2)."""

    row: IntArray
    uv_a: Array
    uv_b: Array


def new_points(
    visual_map: VisualMap, kf: int, picture: Picture, s: MapperSettings, f: FeatureSettings
) -> IntArray:
    """Add points that the newest keyframe is the first to explain; return their numbers."""
    added = [np.zeros(0, np.int64)]
    median = median_depth(visual_map, kf)
    for level in reversed(range(visual_map.levels)):
        xy = picture.corners[level].xy[strong_corners(picture, level, f)]
        xy = xy[free(visual_map, kf, xy, level, s.spacing)]
        xy = xy[cut(picture.levels[level], xy).inside]
        xy = xy[spread(xy, picture.levels[level].shape, s.new_points)]
        for partner in partners(visual_map, kf, s.partners):
            if len(xy) == 0:
                break
            numbers, used = _with_partner(visual_map, kf, picture, int(partner), xy, level, median, s, f)
            added.append(numbers)
            xy = xy[~used]
    return np.concatenate(added)


def partners(visual_map: VisualMap, kf: int, count: int) -> IntArray:
    """Keyframes with which to triangulate: of those that share most points, the nearest with a base line."""
    shared = shared_points(visual_map)[kf].copy()
    shared[kf] = 0
    enough = np.flatnonzero(shared >= 0.3 * max(shared.max(), 1))
    centres = camera_pose.centre_from_pose(visual_map.T_kf_world)
    away = np.linalg.norm(centres[enough] - centres[kf], axis=1)
    base = 0.02 * median_depth(visual_map, kf)
    order = np.lexsort((away, away < base))  # those without a base line last
    return enough[order][:count]


def median_depth(visual_map: VisualMap, kf: int) -> float:
    """Median depth of the points that a keyframe sees; 1 if it sees none."""
    X = visual_map.X_world[visual_map.measured_in(kf)]
    return float(np.median(se3.act(visual_map.T_kf_world[kf], X)[:, 2])) if len(X) else 1.0


def free(visual_map: VisualMap, kf: int, xy: IntArray, level: int, spacing: float) -> BoolArray:
    """Which corners (n,) of a level are farther than ``spacing`` from all that the keyframe sees."""
    from scipy.spatial import cKDTree

    seen = visual_map.sightings
    rows = (seen["kf"] == kf) & seen["on"]
    if not rows.any() or len(xy) == 0:
        return np.ones(len(xy), np.bool_)
    away, _ = cKDTree(level_from_finest(seen["uv"][rows], level)).query(xy, distance_upper_bound=spacing)
    return np.isinf(away)


def _with_partner(
    visual_map: VisualMap,
    kf: int,
    picture: Picture,
    partner: int,
    xy: IntArray,
    level: int,
    median: float,
    s: MapperSettings,
    f: FeatureSettings,
) -> tuple[IntArray, BoolArray]:
    """Points (numbers) from corners of a level and one other keyframe; which corners (n,) were used."""
    from vslam_ref.systems.ptam.tracker.recover import picture_of

    camera, used = visual_map.camera, np.zeros(len(xy), np.bool_)
    there = picture_of(visual_map, partner)
    T = visual_map.T_kf_world
    a = Side(picture, with_bearings(camera, xy, level), T[kf])
    b = Side(there, with_bearings(camera, peaks(there, level, f), level), T[partner])
    back = with_bearings(camera, peaks(picture, level, f), level)
    pairs = match(a, b, back, level, s.near * median, s, f)
    if len(pairs.row) == 0:
        return np.zeros(0, np.int64), used
    views = Views(camera, [a.T_cam_world, b.T_cam_world])
    found = triangulate(
        views,
        np.stack([pairs.uv_a, pairs.uv_b], 1),
        sigma_px=float(level_sigma(level)),
        min_parallax=float(np.radians(s.parallax)),
        max_iterations=10,
    )
    good = found.ok & (found.rmse_px <= 2.0 * level_sigma(level))
    numbers = visual_map.add_points(found.X_world[good], kf, level, pairs.uv_a[good])
    visual_map.observe(partner, numbers, level, pairs.uv_b[good])
    used[pairs.row[good]] = True
    return numbers, used


def match(
    a: Side, b: Side, back: Corner, level: int, near: float, s: MapperSettings, f: FeatureSettings
) -> Pairs:
    """Corners of a in b, each refined, and found back in a from where it was found in b."""
    T_b_a = se3.between(se3.inverse(b.T_cam_world), se3.inverse(a.T_cam_world))
    image_a, image_b = a.picture.levels[level], b.picture.levels[level]
    patch = cut(image_a, a.corner.xy).patch
    options = {"level": level, "distance": s.epipolar, "limit": f.limit}
    there = search_curve(patch, a.corner, image_b, b.corner, T_b_a, near=near, **options)  # type: ignore[arg-type]
    rows = np.flatnonzero(there.corner >= 0)
    start = b.corner.xy[there.corner[rows]].astype(np.float64)
    whole = Templates(patch[rows], np.ones(len(rows), np.bool_))
    looks = Looks(f.limit, f.measure, f.absolute, True)
    end = locate(image_b, b.picture.corners[level], whole, start, np.full(len(rows), 2.0), looks)
    rows, uv = rows[end.ok], end.uv[end.ok]
    keep = np.ones(len(rows), np.bool_)
    if s.search_back and len(rows):
        found = b.corner.only(there.corner[rows])
        here = cut(image_b, found.xy)
        home = search_curve(here.patch, found, image_a, back, se3.inverse(T_b_a), near=0.0, **options)  # type: ignore[arg-type]
        at = back.xy[np.maximum(home.corner, 0)]
        away = np.hypot(*(at - a.corner.xy[rows]).T)
        keep = here.inside & (home.corner >= 0) & (away <= s.back)
    rows, uv = rows[keep], uv[keep]
    return Pairs(rows, finest_from_level(a.corner.xy[rows], level), finest_from_level(uv, level))
