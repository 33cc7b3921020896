"""One picture to one pose in plain loops, as chapter 10 reads it: predict, look for few, look for many."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.robust import tuned
from vslam_ref.estimation.robust.scale import MAD_NORM_2D
from vslam_ref.features.book import best_corner, refine_step, warped_patch, zmssd
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.visual_map import PreparedPicture
from vslam_ref.systems.visual_map.visual_map import Bytes, slopes

C = tuned("tukey", 2).c


class Point(NamedTuple):
    """Point X (3,) of the map; T_kf_world (4, 4), pyramid, level and pixel u (2,) of its first picture."""

    X: Array
    T_kf_world: Array
    images: tuple[Bytes, ...]
    level: int
    u: Array


class SeenPoint(NamedTuple):
    """A point that should be visible: expected pixel u (2,) of level 0, warp A (2, 2), level to look on."""

    point: Point
    u: Array
    A: Array
    level: int


class Match(NamedTuple):
    """A point found: X (3,), place u (2,) in pixels of level 0, and the size s of its level's pixel."""

    X: Array
    u: Array
    s: float


# --- what should be seen ---


def on_level(u: Array, level: int) -> Array:
    """From pixels u (2,) of level 0 to those of a level."""
    there: Array = (u - (2**level - 1) / 2) / 2**level  # eq-level-position
    return there


def affine(camera: Camera, p: Point, T: Array) -> Array:
    """How a pixel's step in the keyframe moves the pixel here: (2, 2), both of level 0."""
    R = T[:3, :3] @ p.T_kf_world[:3, :3].T
    Z = se3.act(p.T_kf_world, p.X)[2]
    J = camera.project_with_jacobians(se3.act(T, p.X)).J_point
    A: Array = J @ R[:, :2] @ (Z * slopes(camera, p.u))  # eq-patch-affine
    return A


def level_for(A: Array, source: int) -> int:
    """Level where a pixel of the source, through A (2, 2), covers three pixels at most; -1 without one."""
    area = np.linalg.det(A * 2**source)
    if area < 0.25:
        return -1
    level = 0
    while area > 3:
        area, level = area / 4, level + 1  # eq-search-level
    return level if level < 4 else -1


def visible(camera: Camera, points: list[Point], T: Array, picture: PreparedPicture) -> list[SeenPoint]:
    """Points that a camera at T (4, 4) should see, at least 5 pixels of their level inside.

    Implements :eq:`eq-search-level` and :eq:`eq-patch-affine`.
    """
    seen = []
    for p in points:
        at = camera.project(se3.act(T, p.X))
        height, width = picture.levels[0].shape
        if not at.valid or not (0 <= at.uv[0] <= width - 1 and 0 <= at.uv[1] <= height - 1):
            continue
        A = affine(camera, p, T)
        level = level_for(A, p.level)
        x, y = on_level(at.uv, max(level, 0))
        w, h = width / 2 ** max(level, 0), height / 2 ** max(level, 0)
        if level >= 0 and 5 <= x <= w - 6 and 5 <= y <= h - 6:
            seen.append(SeenPoint(p, at.uv, A, level))
    return seen


def template(seen: SeenPoint) -> Bytes:
    """Patch of 8 x 8 pixels from the keyframe, as the level to look on should show it."""
    p = seen.point
    M = np.asarray(2.0 ** (seen.level - p.level) * np.linalg.inv(seen.A), np.float64)  # eq-sampling
    return warped_patch(p.images[p.level], on_level(p.u, p.level), M)


# --- where it is ---


def inside(image: Bytes, u: Array, before: int, after: int) -> bool:
    """Whether a window of pixels around u (2,) lies within the image."""
    end = np.array(image.shape[::-1]) - 1
    return bool((u >= before).all() and (u + after <= end).all())


def refined(image: Bytes, T: Bytes, u: Array) -> Array | None:
    """Place in pixels where a patch fits best, from u (2,) on; None if lost or unlike on the way."""
    place, b = u, 0.0
    for _ in range(10):
        if not inside(image, place, 3, 2):
            return None
        before = place
        place, b = refine_step(image, T, place, b)
        if np.hypot(*(place - u)) > 4:
            return None
        if np.hypot(*(place - before)) < 0.01:
            alike = inside(image, place, 4, 3) and unlike(T, warped_patch(image, place, np.eye(2))) <= 0.5
            return place if alike else None
    return None


def unlike(T: Bytes, patch: Bytes) -> float:
    """ZMSSD as a share of the template's own variation."""
    return zmssd(T, patch) / zmssd(T, np.zeros_like(T))


def from_corner(image: Bytes, T: Bytes, corner: tuple[int, int]) -> Array | None:
    """Place (2,), in pixels, refined from a corner, if the patch around the corner is alike."""
    start = np.array(corner, float)
    return refined(image, T, start) if unlike(T, warped_patch(image, start, np.eye(2))) <= 0.5 else None


def find(seen: SeenPoint, picture: PreparedPicture, radius: float) -> Array | None:
    """Place (2,), pixels of level 0: refined from where it is expected, else from the corner most alike."""
    image, corners = picture.levels[seen.level], picture.corners[seen.level].xy
    T, u, reach = template(seen), on_level(seen.u, seen.level), max(radius / 2**seen.level, 1.5)
    place = refined(image, T, u)
    if place is None or np.hypot(*(place - u)) > reach:
        close = corners[(np.abs(corners - u) <= reach).all(1)]
        whole = [(int(x), int(y)) for x, y in close if inside(image, np.array([x, y]), 4, 3)]
        k = best_corner(image, whole, T, u, reach)
        place = from_corner(image, T, whole[k]) if k >= 0 else None
    return None if place is None else 2**seen.level * place + (2**seen.level - 1) / 2  # eq-level-position


# --- the pose ---


def tukey_step(camera: Camera, matches: list[Match], T: Array) -> tuple[Array, list[float]]:
    """Pose T (4, 4), metres and radians, after one reweighted step, and the weights that it used."""
    e, J = [], []
    for m in matches:
        at = camera.pixel_from_world_with_jacobians(T, m.X)
        e.append((at.uv - m.u) / m.s)  # eq-a2-7
        J.append(at.J_pose / m.s)
    x = [float(np.hypot(*e_j)) for e_j in e]
    sigma_T = C * max(MAD_NORM_2D * float(np.median(x)), 0.4)  # eq-mad-norm
    w = [(1 - (x_j / sigma_T) ** 2) ** 2 if x_j < sigma_T else 0.0 for x_j in x]  # eq-a2-8
    H, g = np.zeros((6, 6)), np.zeros(6)
    for e_j, J_j, w_j in zip(e, J, w, strict=True):
        H += w_j * J_j.T @ J_j  # eq-track-normal
        g += w_j * J_j.T @ e_j
    mu = -np.linalg.solve(H, g)
    return se3.exp(mu) @ T, w  # eq-a2-5


# --- the two passes ---


def choose(seen: list[SeenPoint], most: int, coarse: bool, rng: np.random.Generator) -> list[SeenPoint]:
    """At most so many, at random; the coarse pass takes levels 2 and 3 first, then 1, then 0."""
    order = [int(k) for k in rng.permutation(len(seen))]
    if coarse:
        order.sort(key=lambda k: max(2 - seen[k].level, 0))
    return [seen[k] for k in sorted(order[:most])]


def quality(weights: list[float], levels: list[int]) -> str:
    """Judge by shares: points tried and used, of all (weights 0 where not found) and of levels 2 and 3."""
    held = [w > 0 for w in weights]
    large = [h for h, level in zip(held, levels, strict=True) if level >= 2]
    share = sum(held) / max(len(held), 1)
    if sum(held) < 20 or (len(large) >= 10 and max(sum(large) / len(large), share) < 0.13):
        return "lost"  # eq-quality
    return "good" if share > 0.3 else "poor"


class TwoPasses(NamedTuple):
    """Pose T (4, 4), metres and radians, and the points tried: places (pixels, or None) and weights."""

    T: Array
    tried: list[SeenPoint]
    places: list[Array | None]
    weights: list[float]


def two_passes(
    camera: Camera, points: list[Point], picture: PreparedPicture, T: Array, rng: np.random.Generator
) -> TwoPasses:
    """Few points around a guess T (4, 4) of the pose, metres and radians; then all, around a better one."""
    for most, radius, coarse in ((60, 10.0, True), (1000, 5.0, False)):
        seen = choose(visible(camera, points, T, picture), most, coarse, rng)
        places = [find(s, picture, radius) for s in seen]
        pairs = list(zip(seen, places, strict=True))
        found = [Match(s.point.X, u, 2.0**s.level) for s, u in pairs if u is not None]
        for _ in range(10):
            T, _ = tukey_step(camera, found, T)
    weight = iter(tukey_step(camera, found, T)[1])
    return TwoPasses(T, seen, places, [next(weight) if u is not None else 0.0 for u in places])


def track(
    camera: Camera,
    points: list[Point],
    picture: PreparedPicture,
    T_last: Array,
    v: Array,
    rng: np.random.Generator,
) -> tuple[Array, str]:
    """Pose of the next picture and its worth, from T_last (4, 4) and v (6,), metres and radians."""
    done = two_passes(camera, points, picture, se3.exp(v) @ T_last, rng)  # eq-a2-5
    return done.T, quality(done.weights, [s.level for s in done.tried])
