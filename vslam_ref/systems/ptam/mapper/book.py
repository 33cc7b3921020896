"""Mapping in plain loops: one keyframe, one corner, its curve, one match, one point, as chapter 11 reads it.

Pixels ``u_a (2,)``, ``u_b (2,)`` are of level 0 unless a name says otherwise; ``a`` is the new keyframe and
``b`` the one beside it; ``T_b_a (4, 4)`` maps points of a's frame to b's.  Bearings ``bearing_a (3,)``,
``a (3,)``, ``b (3,)`` have length 1; lengths have the map's own unit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.features.book import zmssd
from vslam_ref.features.levels import Bytes
from vslam_ref.geometry.cameras import Camera
from vslam_ref.geometry.multiview.book import essential
from vslam_ref.systems.ptam.settings import KeyframeSettings

Corner = tuple[int, int]
Seen = dict[int, set[int]]
"""Which points each keyframe sees."""


class Now(NamedTuple):
    """A tracked picture.

    Pictures since the last keyframe, points that agree, the most of them since then, sigma in pixels, and
    the way to the nearest keyframe over the median depth.
    """

    since: int
    inliers: int
    best: int
    sigma: float
    away: float


def wants_keyframe(now: Now, s: KeyframeSettings) -> bool:
    """Whether the picture becomes a keyframe: time, quality, distance; and never starve the map."""
    wait = s.gap if now.inliers >= s.starving else s.gap_starving
    if now.since < wait or now.inliers < s.least_inliers or now.sigma > s.worst_sigma:
        return False
    fewer = now.inliers < s.fewer * now.best and now.away > s.distance
    return fewer or now.inliers < s.much_fewer * now.best or now.away > s.far


def is_free(corner: Corner, level: int, seen: list[tuple[Array, int]], spacing: float) -> bool:
    """Whether no point (2,) of a level or the next one lies near a corner; all in pixels of its level."""
    near = [uv for uv, at in seen if at in (level, level + 1)]
    return all(np.hypot(*(np.array(corner) - uv)) >= spacing for uv in near)


def curve_distance(camera: Camera, bearing_a: Array, u_b: Array, T_b_a: Array) -> float:
    """Distance of pixel u_b (2,) from the curve on which a ray of a appears in b, pixels, to first order."""
    E = essential(T_b_a[:3, :3], T_b_a[:3, 3])
    ray = camera.unproject_with_jacobians(u_b)
    e = ray.bearing @ E @ bearing_a
    slope = (E @ bearing_a) @ ray.J_pixel  # d e / d u_b
    return float(abs(e) / np.hypot(*slope))  # eq-curve-distance


def ray_depths(a: Array, b: Array, T_b_a: Array) -> Array:
    """Distances (2,) along both bearings of where they come closest, in a unit of t: q b - p R a = t."""
    M = np.stack([-T_b_a[:3, :3] @ a, b], 1)
    return np.asarray(np.linalg.solve(M.T @ M, M.T @ T_b_a[:3, 3]))  # eq-ray-depths


class Side(NamedTuple):
    """One level of a keyframe: its number, its image, and the corners that stand out."""

    level: int
    image: Bytes
    corners: list[Corner]


class Gates(NamedTuple):
    """Pixels (level) from the curve, least depth, share of the patch's variation, pixels of the way back."""

    curve: float
    near: float
    limit: float
    back: float


def patch_at(image: Bytes, corner: Corner) -> Bytes:
    """Patch of 8 x 8 pixels around a corner; empty where it does not fit."""
    x, y = corner
    return image[y - 4 : y + 4, x - 4 : x + 4] if min(x, y) >= 4 else image[:0]  # eq-warp: M = I


def level_zero(corner: Corner, level: int) -> Array:
    """Position (2,) in pixels of level 0 of a pixel of a level."""
    return 2.0**level * np.array(corner) + (2.0**level - 1) / 2  # eq-level-position


def best_on_curve(camera: Camera, corner: Corner, a: Side, b: Side, T_b_a: Array, gates: Gates) -> int:
    """Number of the corner of b near the curve, most like a corner (pixels) of a; -1 without one."""
    T = patch_at(a.image, corner)
    bearing_a = camera.unproject(level_zero(corner, a.level)).bearing
    best, least = -1, np.inf
    for number, other in enumerate(b.corners):
        u_b, there = level_zero(other, b.level), patch_at(b.image, other)
        if there.shape != T.shape or curve_distance(camera, bearing_a, u_b, T_b_a) > gates.curve * 2**b.level:
            continue
        p, q = ray_depths(bearing_a, camera.unproject(u_b).bearing, T_b_a)
        cost = zmssd(T, there)
        if p >= gates.near and q > 0 and cost < least:
            best, least = number, cost
    return best if least <= gates.limit * max(zmssd(T, np.zeros_like(T)), 1.0) else -1


def comes_back(
    camera: Camera, corner: Corner, found: Corner, a: Side, b: Side, T_b_a: Array, gates: Gates
) -> bool:
    """Whether the way back ends where the search began.

    The corner that was found in b is searched in a; all in pixels of the level.
    """
    T_a_b = np.asarray(np.linalg.inv(T_b_a))
    home = best_on_curve(camera, found, b, a, T_a_b, gates._replace(near=0.0))
    if home < 0:
        return False
    return float(np.hypot(*(np.array(a.corners[home]) - corner))) <= gates.back  # eq-search-back


class Point(NamedTuple):
    """A point in the frame of a (3,), its covariance (3, 3), the sigma of its depth; the map's own unit."""

    X_a: Array
    cov: Array
    depth_sigma: float


def triangulate(camera: Camera, u_a: Array, u_b: Array, T_b_a: Array, sigma: float) -> Point:
    """Point with the smallest reprojection error (pixels): Gauss-Newton from where the rays come closest."""
    a, b = camera.unproject(u_a).bearing, camera.unproject(u_b).bearing
    X = ray_depths(a, b, T_b_a)[0] * a
    R, t = T_b_a[:3, :3], T_b_a[:3, 3]
    for _ in range(10):
        at_a, at_b = camera.project_with_jacobians(X), camera.project_with_jacobians(R @ X + t)
        r = np.concatenate([at_a.uv - u_a, at_b.uv - u_b]) / sigma  # eq-triangulation-optimal
        J = np.concatenate([at_a.J_point, at_b.J_point @ R]) / sigma
        H = J.T @ J
        X = X - np.linalg.solve(H, J.T @ r)
    cov = np.asarray(np.linalg.inv(H))  # eq-triangulation-covariance
    return Point(X, cov, float(np.sqrt(a @ cov @ a)))


def depth_sigma(depths: Array, parallax: float, eps_a: float, eps_b: float) -> float:
    """Sigma of the first of ``depths (2,)``, from those of both bearings in their common plane, radians."""
    moved_by_b = depths[1] * eps_b / np.sin(parallax)
    moved_by_a = depths[0] * eps_a * np.cos(parallax) / np.sin(parallax)
    return float(np.hypot(moved_by_a, moved_by_b))  # eq-depth-sigma


def neighbours(seen: Seen, kf: int, count: int) -> list[int]:
    """Keyframes that share most points with one, most first, the older of equals."""
    shared = {k: len(seen[k] & seen[kf]) for k in seen if k != kf}  # eq-covisibility
    ranked = sorted(shared, key=lambda k: (-shared[k], k))
    return [k for k in ranked if shared[k] > 0][:count]


class Part(NamedTuple):
    """What a local adjustment holds: keyframes that move, those that hold, points that move."""

    active: set[int]
    ring: set[int]
    points: set[int]


def local_part(seen: Seen, newest: int, count: int) -> Part:
    """Newest keyframe and its neighbours move, with all their points; who else sees one of these holds."""
    active = {newest, *neighbours(seen, newest, count)} - {0}  # eq-a2-9
    points = set().union(*(seen[k] for k in active))
    ring = {k for k in seen if k not in active and seen[k] & points}
    return Part(active, ring, points)


def dies(tried: int, found: int, tries: int, share: float) -> bool:
    """Whether a point was looked for often enough and found in too small a share of the tries."""
    return tried >= tries and found < share * tried  # eq-seldom-found
