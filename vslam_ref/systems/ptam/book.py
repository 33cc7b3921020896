"""PTAM from two pictures to a path, in plain loops, as chapter 12 reads it.

::

    corners of the first picture, followed to the last -> motion -> points -> adjust -> enough for a start?
    then, picture by picture:  track -> count -> keyframe? -> look, new points, look elsewhere, adjust, cull

:mod:`.tracker.book` tracks one picture, :mod:`.mapper.book` makes one corner a point, and
:mod:`vslam_ref.systems.visual_map.book` moves everything.  Poses ``T (4, 4)`` map the map's frame to a
camera's, in the map's own unit; pixels ``u (2,)`` are of level 0.  A picture that is lost stays lost here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.robust.scale import MAD_NORM_2D
from vslam_ref.features.book import best_corner, warped_patch
from vslam_ref.features.levels import Bytes
from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.geometry.multiview.two_views import book as two_views
from vslam_ref.systems.ptam import look
from vslam_ref.systems.ptam.mapper import book as mapper
from vslam_ref.systems.ptam.settings import Settings, StartSettings
from vslam_ref.systems.ptam.tracker import book as tracker
from vslam_ref.systems.visual_map import PreparedPicture
from vslam_ref.systems.visual_map.book import BookMap, BookSighting, adjust

S = Settings()
FOLLOWED, TRIED = 200, 60
"""Corners that are followed before the start, and corners of each level that may become points."""

# --- two pictures become a map ---


def corners_of(picture: PreparedPicture, level: int, numbers: IntArray) -> list[mapper.Corner]:
    """Corners (n,) of a level, as pairs of whole numbers of its pixels."""
    return [(int(x), int(y)) for x, y in picture.corners[level].xy[numbers]]


def alike_near(picture: PreparedPicture, T: Bytes, u: Array) -> mapper.Corner | None:
    """Corner of level 0 near u (2,), pixels, that looks most like a patch, if it is like it at all."""
    radius = 2.0 * S.start.search_radius  # no small images tell where to look
    close = np.flatnonzero((np.abs(picture.corners[0].xy - u) <= radius).all(1))
    corners = corners_of(picture, 0, close)
    k = best_corner(picture.levels[0], corners, T, u, radius)
    if k < 0 or tracker.unlike(T, mapper.patch_at(picture.levels[0], corners[k])) > S.features.limit:
        return None
    return corners[k]


def trail(pictures: list[PreparedPicture], corner: mapper.Corner) -> Array | None:
    """Where a corner of the first picture lies in the last, pixels; None if lost, or not found back."""
    T, u, speed = mapper.patch_at(pictures[0].levels[0], corner), np.array(corner, float), np.zeros(2)
    for picture in pictures[1:]:
        found = alike_near(picture, T, u + speed)
        place = tracker.from_corner(picture.levels[0], T, found) if found else None
        if place is None:
            return None
        u, speed = place, place - u
    home = alike_near(pictures[0], warped_patch(pictures[-1].levels[0], u, np.eye(2)), np.array(corner))
    return u if home and np.hypot(*np.subtract(home, corner)) <= 1.5 else None  # eq-home


def costs(T: Array, x_a: Array, x_b: Array, sigma: float) -> list[float]:
    """Squared distances of pairs ``x_a (N, 3)``, ``x_b (N, 3)`` from a motion (4, 4), sigma^2, to 3.84."""
    t = T[:3, 3] / np.linalg.norm(T[:3, 3])
    each = [two_views.cost(T[:3, :3], t, a, b) for a, b in zip(x_a, x_b, strict=True)]
    return [min(c / sigma**2, 3.84) for c in each]  # eq-msac


def motion(x_a: Array, x_b: Array, sigma: float, rng: np.random.Generator) -> Array:
    """Motion T_b_a (4, 4) of pairs ``x (N, 3)``, its base line 1; sigma of the normalised positions."""
    E = two_views.consensus(x_a, x_b, sigma, 100, rng)
    four = [se3.from_rt(R, t) for R, t in two_views.motions(E)]  # eq-essential-motions
    return min(four, key=lambda T: sum(costs(T, x_a, x_b, sigma)))


def missing(parallax: list[float], cost: float, s: StartSettings) -> str:
    """Why two pictures are no start, or nothing: angles in degrees, px^2 a point."""
    if np.median(parallax) < s.parallax:
        return "the rays of a point differ too little"
    if sum(angle >= s.wide_parallax for angle in parallax) < s.wide_points:
        return "too few points have parallax"
    return "the cost is too high" if cost > s.cost else ""  # eq-start-accepted


def begin(camera: Camera, pictures: list[PreparedPicture], rng: np.random.Generator) -> BookMap | str:
    """First map, its median depth 1, from the first and the last picture; or why not."""
    first = pictures[0]
    strong = corners_of(first, 0, look.strong_corners(first, 0, S.features)[:FOLLOWED])
    ends = [(np.array(c, float), trail(pictures, c)) for c in strong]
    kept = [(a, b) for a, b in ends if b is not None]
    x_a, x_b = (np.array([[*camera.unproject(pair[k]).xn, 1] for pair in kept]) for k in (0, 1))
    sigma = 1 / camera.params[0]
    made = BookMap(camera, [np.eye(4), motion(x_a, x_b, sigma, rng)], [first, pictures[-1]])
    fits = [p for p, c in zip(kept, costs(made.poses[1], x_a, x_b, sigma), strict=True) if c < 3.84]
    for places in fits:
        X = triangulated(made, 0, 1, 0, places)
        if X is not None:
            made.add(X, 0, 1, 0, places)
    if len(made.X) < S.start.wide_points:
        return "too few points have parallax"
    adjust(made, {1}, set(made.X))
    parallax = [angle(camera, made.poses[1], places) for places in fits]
    cost = float(np.mean(costs(made.poses[1], x_a, x_b, sigma)))
    reason = missing(parallax, cost, S.start)
    if reason:
        return reason
    new_points(made, 1)
    adjust(made, {1}, set(made.X))
    unit = made.depth(0)
    made.X = {p: X / unit for p, X in made.X.items()}
    made.poses[1] = se3.from_rt(made.poses[1][:3, :3], made.poses[1][:3, 3] / unit)  # eq-map-unit
    return made


# --- a keyframe makes the map better ---


def angle(camera: Camera, T_b_a: Array, places: tuple[Array, Array]) -> float:
    """Parallax, degrees, of two pixels ``places`` (2,) at a motion ``T_b_a (4, 4)``: angle of their rays."""
    a, b = (camera.unproject(u).bearing for u in places)
    a = T_b_a[:3, :3] @ a
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))  # eq-parallax


def triangulated(made: BookMap, a: int, b: int, level: int, places: tuple[Array, Array]) -> Array | None:
    """Point (3,), own unit, of a match in keyframes a and b, pixels; None without depth, or off both."""
    T_b_a = made.poses[b] @ se3.inverse(made.poses[a])
    if angle(made.camera, T_b_a, places) < S.mapper.parallax:
        return None
    X_a = mapper.triangulate(made.camera, *places, T_b_a, 1.0).X_a  # eq-triangulation-optimal
    at = made.camera.project(np.stack([X_a, se3.act(T_b_a, X_a)]))
    off = np.sqrt(np.mean(np.sum((at.uv - places) ** 2, 1)))
    X: Array = se3.act(se3.inverse(made.poses[a]), X_a)
    return X if at.valid.all() and off <= 2.0 * 2**level else None


def partner(made: BookMap, kf: int) -> int:
    """Keyframe to triangulate with: of those that share many points, the nearest with a base line."""
    seen, base = made.seen(), 0.02 * made.depth(kf)
    shared = {k: len(seen[k] & seen[kf]) for k in seen if k != kf}  # eq-covisibility
    c = camera_pose.centre_from_pose(np.stack(made.poses))
    away = {k: float(np.linalg.norm(c[k] - c[kf])) for k in shared if shared[k] >= 0.3 * max(shared.values())}
    return min(away, key=lambda k: (away[k] < base, away[k]))


def new_points(made: BookMap, kf: int) -> set[int]:
    """Points of strong corners that nothing explains yet: on the curve, found back, with depth."""
    f, other, new = S.features, partner(made, kf), set()
    T_other_kf = made.poses[other] @ se3.inverse(made.poses[kf])
    gates = mapper.Gates(S.mapper.epipolar, S.mapper.near * made.depth(kf), f.limit, S.mapper.back)
    for level in (3, 2, 1, 0):
        a, b = (
            mapper.Side(level, p.levels[level], [(int(x), int(y)) for x, y in look.peaks(p, level, f)])
            for p in (made.pictures[kf], made.pictures[other])
        )
        taken = [
            (tracker.on_level(at.u, level), at.level) for (k, _), at in made.sightings.items() if k == kf
        ]
        strong = look.strong_corners(made.pictures[kf], level, f)[:TRIED]
        for corner in corners_of(made.pictures[kf], level, strong):
            if mapper.is_free(corner, level, taken, S.mapper.spacing):
                places = matched(made.camera, corner, a, b, T_other_kf, gates)
                X = triangulated(made, kf, other, level, places) if places else None
                if X is not None and places is not None:
                    new.add(made.add(X, kf, other, level, places))
    return new


def matched(
    camera: Camera, corner: mapper.Corner, a: mapper.Side, b: mapper.Side, T_b_a: Array, gates: mapper.Gates
) -> tuple[Array, Array] | None:
    """Places (2,), pixels, of a corner of a, and of its match in b that leads back to it; None without."""
    k = mapper.best_on_curve(camera, corner, a, b, T_b_a, gates)
    if k < 0 or not mapper.comes_back(camera, corner, b.corners[k], a, b, T_b_a, gates):
        return None
    u_b = tracker.from_corner(b.image, mapper.patch_at(a.image, corner), b.corners[k])
    if u_b is None:
        return None
    return mapper.level_zero(corner, a.level), 2**b.level * u_b + (2**b.level - 1) / 2  # eq-level-position


def as_tracked(made: BookMap, wanted: set[int]) -> list[tracker.Point]:
    """Points as the tracker wants them, in the order of their numbers: each with its first picture."""
    first = {p: (kf, at) for (kf, p), at in made.sightings.items() if at.first}
    return [
        tracker.Point(made.X[p], made.poses[kf], made.pictures[kf].levels, at.level, at.u)
        for p in sorted(wanted)
        for kf, at in [first[p]]
    ]


def look_in(made: BookMap, kf: int, wanted: set[int]) -> None:
    """Look in a keyframe for points that it does not see yet, where they should be."""
    left = wanted - made.seen()[kf]
    points = as_tracked(made, left)
    number = {id(point): p for p, point in zip(sorted(left), points, strict=True)}
    for s in tracker.visible(made.camera, points, made.poses[kf], made.pictures[kf]):
        u = tracker.find(s, made.pictures[kf], S.mapper.look_radius)
        if u is not None:
            made.sightings[kf, number[id(s.point)]] = BookSighting(u, s.level)


def keyframe(made: BookMap, picture: PreparedPicture, T: Array, seen: dict[int, BookSighting]) -> None:
    """Take a picture with its pose (4, 4), own unit, and what it saw; make the map better by it."""
    s, kf = S.mapper, len(made.poses)
    made.poses.append(T)
    made.pictures.append(picture)
    made.sightings |= {(kf, p): at for p, at in seen.items()}
    look_in(made, kf, set(made.X))
    new = new_points(made, kf)
    for other in mapper.neighbours(made.seen(), kf, s.neighbours):
        look_in(made, other, new)
    part = mapper.local_part(made.seen(), kf, s.local)
    adjust(made, part.active, part.points)
    if kf % s.global_every == 0:
        adjust(made, set(range(1, kf + 1)), set(made.X))
    for p in list(made.X):
        if mapper.dies(made.tried[p], made.found[p], s.tries, s.found):
            made.drop(p)


# --- the whole run ---


class BookRun(NamedTuple):
    """The map; T_cam_world (4, 4), in the map's unit, of each picture that has one; what was said of each."""

    map: BookMap
    path: dict[int, Array]
    words: dict[int, str]


def run(
    camera: Camera, pictures: list[PreparedPicture], last: int, rng: np.random.Generator
) -> BookRun | str:
    """Start from pictures 0 and ``last`` of a list; then track one after the other, and map in between."""
    made = begin(camera, pictures[: last + 1], rng)
    if isinstance(made, str):
        return made
    kept = {pictures[0].number: (0, np.eye(4)), pictures[last].number: (1, np.eye(4))}
    T, v, since, best, words = made.poses[1], np.zeros(6), 0, 0, {}
    for picture in pictures[last + 1 :]:
        done = tracker.two_passes(camera, as_tracked(made, set(made.X)), picture, se3.exp(v) @ T, rng)
        words[picture.number] = tracker.quality(done.weights, [s.level for s in done.tried])
        if words[picture.number] == "lost":
            v = np.zeros(6)
            continue
        v, T = se3.log(done.T @ se3.inverse(T)), done.T  # eq-a2-5
        seen = counted(made, done)
        c = camera_pose.centre_from_pose(np.stack([*made.poses, T]))
        away = np.linalg.norm(c[:-1] - c[-1], axis=1)
        near = int(np.argmin(away))
        kept[picture.number] = near, T @ se3.inverse(made.poses[near])  # eq-kept-pose
        since, best = since + 1, max(best, len(seen))
        if mapper.wants_keyframe(now(made, T, seen, since, best, float(away[near])), S.keyframe):
            keyframe(made, picture, T, seen)
            kept[picture.number], T = (len(made.poses) - 1, np.eye(4)), made.poses[-1]
            since = best = 0
    adjust(made, set(range(1, len(made.poses))), set(made.X))
    return BookRun(made, {n: T @ made.poses[kf] for n, (kf, T) in kept.items()}, words)


def counted(made: BookMap, done: tracker.TwoPasses) -> dict[int, BookSighting]:
    """What a tracked picture saw, by the points' numbers; each look is counted, and each find."""
    number = {id(X): p for p, X in made.X.items()}
    seen = {}
    for s, u, w in zip(done.tried, done.places, done.weights, strict=True):
        p = number[id(s.point.X)]
        made.tried[p] += 1
        if u is not None and w > 0:
            made.found[p] += 1
            seen[p] = BookSighting(u, s.level)
    return seen


def now(
    made: BookMap, T: Array, seen: dict[int, BookSighting], since: int, best: int, away: float
) -> mapper.Now:
    """What the choice of keyframes asks of a tracked picture at T (4, 4); the way in the map's own unit."""
    at = {p: made.camera.pixel_from_world(T, made.X[p]).uv for p in seen}
    size = [np.hypot(*(at[p] - s.u)) / 2**s.level for p, s in seen.items()]  # eq-a2-7
    depth = float(np.median([se3.act(T, made.X[p])[2] for p in seen]))
    return mapper.Now(since, len(seen), best, MAD_NORM_2D * float(np.median(size)), away / depth)
