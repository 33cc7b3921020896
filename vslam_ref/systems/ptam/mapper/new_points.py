"""New points from a keyframe: strong corners that nothing explains yet, found in a neighbour and back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.features import Corners, Templates, finest_from_level, level_from_finest, level_sigma
from vslam_ref.features.fast import Pixels
from vslam_ref.features.templates import cut
from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.geometry.multiview import Views
from vslam_ref.systems.ptam.look import spread, stand_out, strong_corners
from vslam_ref.systems.ptam.mapper.curve_search import CornerRays, Gates, search_curve, with_bearings
from vslam_ref.systems.ptam.settings import FeatureSettings, MapperSettings
from vslam_ref.systems.ptam.tracker.recover import picture_of
from vslam_ref.systems.visual_map import PreparedPicture, VisualMap, shared_points
from vslam_ref.systems.visual_map.measure import locate
from vslam_ref.systems.visual_map.visual_map import Bytes

WORST_PIXELS = 2.0
"""Pixels of the level: root mean square distance of a new point from its two sightings."""


class Side(NamedTuple):
    """One level of a keyframe.

    Attributes
    ----------
    kf : int
        Number of the keyframe.
    level : int
    image : ndarray of uint8, shape (H, W)
    corners : Corners
        All of the level.
    peaks : CornerRays
        Those that stand out among their neighbours, with rays.
    T_cam_world : ndarray, shape (4, 4)
        Lengths in the map's own unit.
    """

    kf: int
    level: int
    image: Bytes
    corners: Corners
    peaks: CornerRays
    T_cam_world: Array


class CurveMatches(NamedTuple):
    """Matches: ``row (n,)`` among the candidates, pixels of level 0 ``uv_a (n, 2)``, ``uv_b (n, 2)``."""

    row: IntArray
    uv_a: Array
    uv_b: Array


def new_points(
    visual_map: VisualMap, kf: int, picture: PreparedPicture, s: MapperSettings, f: FeatureSettings
) -> IntArray:
    """Add points that the newest keyframe is the first to explain; return their numbers (n,).

    Implements A§2.2.2.1, the new points.

    Parameters
    ----------
    visual_map : VisualMap
        Changed in place; lengths have its own unit.
    kf : int
        The keyframe.
    picture : PreparedPicture
        Its picture.
    s, f : MapperSettings, FeatureSettings
    """
    added = [np.zeros(0, np.int64)]
    near = s.near * median_depth(visual_map, kf)
    others = [(int(k), picture_of(visual_map, int(k))) for k in partners(visual_map, kf, s.partners)]
    for level in reversed(range(visual_map.levels)):
        peak = stand_out(picture, level, f)
        here = _side(visual_map, kf, picture, level, peak)
        xy = picture.corners[level].xy[strong_corners(picture, level, f, peak)]
        xy = xy[free(visual_map, kf, xy, level, s.spacing)]
        xy = xy[cut(here.image, xy).inside]
        xy = xy[spread(xy, here.image.shape, s.new_points)]
        for partner, shown in others:
            if len(xy) == 0:
                break
            there = _side(visual_map, partner, shown, level, stand_out(shown, level, f))
            pairs = match(visual_map.camera, xy, here, there, near, s, f)
            numbers, rows = _triangulated(visual_map, here, there, pairs, s)
            added.append(numbers)
            xy = np.delete(xy, rows, 0)
    return np.concatenate(added)


def _side(visual_map: VisualMap, kf: int, picture: PreparedPicture, level: int, peak: BoolArray) -> Side:
    found = with_bearings(visual_map.camera, picture.corners[level].xy[peak], level)
    T = visual_map.T_kf_world[kf]
    return Side(kf, level, picture.levels[level], picture.corners[level], found, T)


def partners(visual_map: VisualMap, kf: int, count: int) -> IntArray:
    """Keyframes with which to triangulate: of those that share most points, the nearest with a base line."""
    shared = shared_points(visual_map, kf)
    shared[kf] = 0
    enough = np.flatnonzero(shared >= 0.3 * max(shared.max(), 1))
    centres = camera_pose.centre_from_pose(visual_map.T_kf_world)
    away = np.linalg.norm(centres[enough] - centres[kf], axis=1)
    base = 0.02 * median_depth(visual_map, kf)
    order = np.lexsort((away, away < base))  # those without a base line last
    return enough[order][:count]


def median_depth(visual_map: VisualMap, kf: int) -> float:
    """Median depth of the points that a keyframe sees, in the map's own unit; 1 if it sees none."""
    X = visual_map.X_world[visual_map.measured_in(kf)]
    return float(np.median(se3.act(visual_map.T_kf_world[kf], X)[:, 2])) if len(X) else 1.0


def free(visual_map: VisualMap, kf: int, xy: Pixels, level: int, spacing: float) -> BoolArray:
    """Which corners (n, 2) are ``spacing`` pixels of a level away from what the keyframe sees, (n,).

    Only points of this level and the next coarser one count.  Ten pixels of the coarsest level are eighty of
    the finest: if finer points counted, too, a picture full of them would leave no room for a coarse one, and
    the coarse pass of the tracker lives on those.
    """
    from scipy.spatial import cKDTree

    seen = visual_map.sightings
    alike = (seen["level"] == level) | (seen["level"] == level + 1)
    rows = (seen["kf"] == kf) & seen["on"] & alike
    if not rows.any() or len(xy) == 0:
        return np.ones(len(xy), np.bool_)
    away, _ = cKDTree(level_from_finest(seen["uv"][rows], level)).query(xy, distance_upper_bound=spacing)
    return np.asarray(np.isinf(away))


def match(
    camera: Camera, xy: Pixels, a: Side, b: Side, near: float, s: MapperSettings, f: FeatureSettings
) -> CurveMatches:
    """Corners (n, 2) of a in b: on their curve, refined, and found back in a.

    Implements :eq:`eq-search-back`.

    Parameters
    ----------
    camera : Camera
    xy : ndarray of int, shape (n, 2)
        Pixels of the level, with a whole patch.
    a, b : Side
    near : float
        Least depth in a, in the map's own unit.
    s, f : MapperSettings, FeatureSettings

    Returns
    -------
    CurveMatches
    """
    T_b_a = se3.compose(b.T_cam_world, se3.inverse(a.T_cam_world))
    asked = with_bearings(camera, xy, a.level)
    patch = cut(a.image, xy).patch
    gates = Gates(a.level, near, s.epipolar, f.limit)
    there = search_curve(patch, asked, b.image, b.peaks, T_b_a, gates)
    rows = np.flatnonzero(there.corner >= 0)
    start = b.peaks.xy[there.corner[rows]].astype(np.float64)
    whole = Templates(patch[rows], np.ones(len(rows), np.bool_))
    looks = f.looks._replace(first_refine=True)
    end = locate(b.image, b.corners, whole, start, np.full(len(rows), 2.0), looks)
    rows, uv = rows[end.ok], end.uv[end.ok]
    if s.search_back and len(rows):
        found = b.peaks.only(there.corner[rows])
        here = cut(b.image, found.xy)
        home = search_curve(here.patch, found, a.image, a.peaks, se3.inverse(T_b_a), gates._replace(near=0.0))
        away = np.hypot(*(a.peaks.xy[home.corner] - xy[rows]).T)
        keep = here.inside & (home.corner >= 0) & (away <= s.back)
        rows, uv = rows[keep], uv[keep]
    return CurveMatches(rows, finest_from_level(xy[rows], a.level), finest_from_level(uv, a.level))


def _triangulated(
    visual_map: VisualMap, a: Side, b: Side, pairs: CurveMatches, s: MapperSettings
) -> tuple[IntArray, IntArray]:
    """Add the points of matches that have depth; return their numbers and their rows among the candidates."""
    if len(pairs.row) == 0:
        return np.zeros(0, np.int64), pairs.row
    sigma = float(level_sigma(a.level))
    found = triangulate(
        Views(visual_map.camera, np.stack([a.T_cam_world, b.T_cam_world])),
        np.stack([pairs.uv_a, pairs.uv_b], 1),
        sigma_px=sigma,
        min_parallax=float(np.radians(s.parallax)),
        max_iterations=10,
    )
    good = found.ok & (found.rmse_px <= WORST_PIXELS * sigma)
    numbers = visual_map.add_points(found.X_world[good], a.kf, a.level, pairs.uv_a[good])
    visual_map.observe(b.kf, numbers, a.level, pairs.uv_b[good])
    return numbers, pairs.row[good]
