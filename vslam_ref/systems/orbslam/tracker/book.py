"""A picture tracked by ORB features, in plain loops, as chapter 14 reads it.

::

    points seen last -- predicted, 12 px --> features alike --> pose
                     points of the map, 5 px --> features alike --> pose --> enough?

Poses ``T (4, 4)`` map the map's frame to the camera's, in the map's own unit; pixels ``u (2,)`` are of octave
0.  A descriptor is a whole number of 256 bits.  :mod:`.tracker` and
:mod:`vslam_ref.systems.orbslam.projection` compute the same fast.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.robust import tuned
from vslam_ref.estimation.robust.scale import MAD_NORM_2D
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera

SCALE, OCTAVES = 1.2, 8
FAR = 100
"""Bits in which a point and a feature may differ where the place is known."""
CLEARLY = 0.8
"""The best must differ in so many times the bits of the second at most."""
C = tuned("tukey", 2).c


class Feature(NamedTuple):
    """Place u (2,) in pixels of octave 0, octave, and descriptor."""

    u: Array
    octave: int
    bits: int


class MapPoint(NamedTuple):
    """A point X (3,): descriptor, mean direction n (3,) of sight, distance at which octave 0 shows it."""

    X: Array
    bits: int
    n: Array
    farthest: float


class Expectation(NamedTuple):
    """Pixel u (2,) and octave where a point should appear."""

    u: Array
    octave: int


def expectation(camera: Camera, size: tuple[int, int], p: MapPoint, T: Array) -> Expectation | None:
    """Where a camera at T (4, 4), own unit, should see a point; None if it should not.

    Implements :eq:`eq-expected-octave`.
    """
    X_c = se3.act(T, p.X)
    sight = p.X - se3.inverse(T)[:3, 3]
    d = float(np.linalg.norm(sight))
    nearest = p.farthest / SCALE ** (OCTAVES - 1)
    if X_c[2] <= 0 or not 0.8 * nearest <= d <= 1.2 * p.farthest or sight @ p.n < 0.5 * d:
        return None
    at = camera.project(X_c)
    if not at.valid or not (0 <= at.uv[0] <= size[0] - 1 and 0 <= at.uv[1] <= size[1] - 1):
        return None
    octave = round(math.log(p.farthest / d) / math.log(SCALE))
    return Expectation(at.uv, min(max(octave, 0), OCTAVES - 1))


def differ(a: int, b: int) -> int:
    """Bits in which two descriptors differ."""
    return (a ^ b).bit_count()


def answer(at: Expectation, bits: int, features: list[Feature], radius: float) -> tuple[int, int] | None:
    """Feature most alike in a window (pixels of the octave), and its distance in bits; None if unclear.

    Implements :eq:`eq-window-answer`.
    """
    r = radius * SCALE**at.octave
    near = [
        (differ(bits, f.bits), k)
        for k, f in enumerate(features)
        if max(abs(f.u - at.u)) <= r and abs(f.octave - at.octave) <= 1
    ]
    if not near:
        return None
    best, k = min(near)
    second = min((d for d, j in near if j != k and features[j].octave == features[k].octave), default=257)
    return (k, best) if best <= FAR and best <= CLEARLY * second else None


def look_for(
    camera: Camera,
    size: tuple[int, int],
    points: list[MapPoint],
    features: list[Feature],
    T: Array,
    radius: float,
) -> dict[int, int]:
    """Point -> feature, each at most once, around T (4, 4), own unit; the window in pixels of the octave."""
    owner: dict[int, tuple[int, int]] = {}
    for number, p in enumerate(points):
        at = expectation(camera, size, p, T)
        found = answer(at, p.bits, features, radius) if at else None
        if found is not None and (found[1], number) < owner.get(found[0], (257, 0)):
            owner[found[0]] = found[1], number
    return {number: k for k, (_, number) in owner.items()}


class Posed(NamedTuple):
    """Pose T (4, 4), own unit, the weights by point, and the scale of the errors in pixels of the octave."""

    T: Array
    weights: dict[int, float]
    sigma: float


def pose(
    camera: Camera, points: list[MapPoint], features: list[Feature], found: dict[int, int], T: Array
) -> Posed:
    """Pose with Tukey's loss, its scale from the errors, from T (4, 4) on, own unit: ten steps."""
    for step in range(11):
        e, J = {}, {}
        for number, k in found.items():
            at = camera.pixel_from_world_with_jacobians(T, points[number].X)
            s = SCALE ** features[k].octave
            e[number], J[number] = (at.uv - features[k].u) / s, at.J_pose / s  # eq-a2-7
        x = {number: float(np.hypot(*e_j)) for number, e_j in e.items()}
        sigma = max(MAD_NORM_2D * float(np.median(list(x.values()))), 0.5)  # eq-mad-norm
        w = {j: (1 - (x_j / (C * sigma)) ** 2) ** 2 if x_j < C * sigma else 0.0 for j, x_j in x.items()}
        if step == 10:
            break
        H = sum(w[j] * J[j].T @ J[j] for j in found)  # eq-track-normal
        g = sum(w[j] * J[j].T @ e[j] for j in found)
        T = se3.exp(-np.linalg.solve(H, g)) @ T  # eq-a2-5
    return Posed(T, w, sigma)


def track(
    camera: Camera,
    size: tuple[int, int],
    points: list[MapPoint],
    last: set[int],
    features: list[Feature],
    T_last: Array,
    v: Array,
) -> Posed | None:
    """Pose of the next picture from T_last (4, 4), own unit, the motion v (6,) and the points seen last.

    None if it is lost: fewer than 20 points agree with the first pose, or fewer than 30 with the last.
    """
    T = se3.exp(v) @ T_last  # eq-a2-5
    some = sorted(last)
    first = look_for(camera, size, [points[j] for j in some], features, T, 12.0)
    guess = pose(camera, points, features, {some[j]: k for j, k in first.items()}, T)
    if sum(w > 0 for w in guess.weights.values()) < 20:
        return None
    found = look_for(camera, size, points, features, guess.T, 5.0)
    end = pose(camera, points, features, found, guess.T)
    return end if sum(w > 0 for w in end.weights.values()) >= 30 else None
