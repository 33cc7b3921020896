"""What happens to a keyframe, in plain loops, as chapter 14 reads it.

A map is told as ``sees[k] = {feature: point}``: which feature of keyframe k shows which point.  Descriptors
are whole numbers of 256 bits, pixels ``u (2,)`` are of octave 0, poses ``T (4, 4)`` in the map's own unit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry.cameras import Camera

SCALE = 1.2
Sees = dict[int, dict[int, int]]
"""Keyframe -> feature -> point."""


class FreeCorner(NamedTuple):
    """A feature that shows no point: place u (2,) in pixels of octave 0, octave, descriptor."""

    u: Array
    octave: int
    bits: int


# --- the graph ---


def shared(sees: Sees, i: int, j: int) -> int:
    """Weight of an edge of the covisibility graph: points that two keyframes share."""
    return len(set(sees[i].values()) & set(sees[j].values()))  # eq-covisibility


def parent_of_new(sees: Sees, kf: int) -> int:
    """Older keyframe with which a new one shares most points, the oldest of equals; -1 for the first."""
    return max(range(kf), key=lambda j: (shared(sees, kf, j), -j), default=-1)


def parents_after_culling(parent: dict[int, int], sees: Sees, kf: int) -> dict[int, int]:
    """The tree without a keyframe: its children join who shares most with them and hangs on its parent."""
    new = {k: p for k, p in parent.items() if k != kf}
    left, joined = [k for k, p in sorted(parent.items()) if p == kf], [parent[kf]]
    while left:
        pairs = [(child, other) for child in left for other in joined]
        child, other = max(pairs, key=lambda pair: shared(sees, *pair))
        new[child] = other if shared(sees, child, other) else parent[kf]
        left.remove(child)
        joined.append(child)
    return new


# --- new points ---


def curve_distance(camera: Camera, u_a: Array, u_b: Array, T_b_a: Array) -> float:
    """Distance in pixels of u_b (2,) from the curve of u_a (2,), to first order; T_b_a (4, 4), own unit."""
    a, b = camera.unproject(u_a).bearing, camera.unproject_with_jacobians(u_b)
    R, t = T_b_a[:3, :3], T_b_a[:3, 3]
    normal = np.cross(t, R @ a)  # of the plane through both centres and the point
    slope = b.J_pixel.T @ normal
    return float(abs(b.bearing @ normal) / np.linalg.norm(slope))  # eq-curve-distance


def best_on_curve(
    camera: Camera, corner: FreeCorner, others: list[FreeCorner], T_b_a: Array, limit: float
) -> int:
    """Number of the corner near the curve that differs least; -1 without one.

    Implements :eq:`eq-curve-distance`; the limit is in pixels of the octave of the other corner, the motion
    T_b_a (4, 4) in the map's own unit.
    """
    near = [
        ((corner.bits ^ other.bits).bit_count(), k)
        for k, other in enumerate(others)
        if curve_distance(camera, corner.u, other.u, T_b_a) <= limit * SCALE**other.octave
    ]
    return min(near)[1] if near else -1


def matches(
    camera: Camera, a: list[FreeCorner], b: list[FreeCorner], T_b_a: Array, limit: float, bits: int
) -> list[tuple[int, int]]:
    """Pairs that are each other's best on the curve; limits in pixels and bits; T_b_a (4, 4), own unit."""
    T_a_b = np.asarray(np.linalg.inv(T_b_a))
    pairs = []
    for i, corner in enumerate(a):
        j = best_on_curve(camera, corner, b, T_b_a, limit)
        if j < 0 or (corner.bits ^ b[j].bits).bit_count() > bits:
            continue
        if best_on_curve(camera, b[j], a, T_a_b, limit) == i:
            pairs.append((i, j))
    return pairs


# --- one point or two ---


def fuse(sees: Sees, kf: int, feature: int, point: int) -> Sees:
    """A point was found in a keyframe at a feature: a sighting more, or two points that are one."""
    shown = sees[kf].get(feature)
    if shown is None:
        return {k: {**of, feature: point} if k == kf else of for k, of in sees.items()}
    times = {p: sum(p in of.values() for of in sees.values()) for p in (shown, point)}
    old, kept = (point, shown) if times[shown] >= times[point] else (shown, point)
    fused = {}
    for k, of in sees.items():
        own = kept in of.values()  # then it keeps its own place
        fused[k] = {f: kept if p == old else p for f, p in of.items() if not (p == old and own)}
    return fused


# --- what is taken out again ---


def unproven(age: int, tried: int, found: int, seen: int) -> bool:
    """Whether a young point ends: age in keyframes, looks, finds, keyframes that see it."""
    return age <= 3 and (found < 0.25 * tried or (age >= 2 and seen < 3))  # eq-seldom-found


def redundant_share(sees: Sees, octaves: dict[int, dict[int, int]], kf: int) -> float:
    """Share of a keyframe's points that three others see as well, one octave coarser at most.

    ``octaves[k]`` tells the octave of each feature of keyframe k; no unit.
    """
    well = 0
    for feature, point in sees[kf].items():
        limit = octaves[kf][feature] + 1
        others = 0
        for k, of in sees.items():
            others += k != kf and any(p == point and octaves[k][f] <= limit for f, p in of.items())
        well += others >= 3
    return well / len(sees[kf]) if sees[kf] else 1.0
