"""A car that drives straight, round a bend, and straight on: what its camera sees of points beside the road.

::

              |  straight                       poses are exact; the camera looks ahead, y points down
              |
    __________/ bend of a radius and an angle   points stand 3.5 to 25 m beside the road, up to 5 m above
                                                the camera and 1.6 m below it

A point is seen while it is inside the picture, between 2 m and 35 m ahead.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole

CAMERA = Pinhole(707.0, 707.0, 600.0, 180.0)
SIZE = (1220, 370)
"""Pixels, width and height: much like a car's camera of the KITTI benchmark."""
STRAIGHT = 40.0
"""Metres before the bend, and after it."""
STEP = 1.0
"""Metres from picture to picture."""
NEAR, FAR = 2.0, 35.0
"""Metres ahead within which points are seen."""
LEAST_VIEWS = 3


class SeenDrive(NamedTuple):
    """What was driven and seen.

    Attributes
    ----------
    T_cam_world : ndarray, shape (V, 4, 4)
    way : ndarray, shape (V,)
        Metres along the road.
    bend : tuple of float
        Where on the way the bend begins and ends.
    X_world : ndarray, shape (N, 3)
    uv : ndarray, shape (V, N, 2)
        Pixels, exact.
    seen : ndarray of bool, shape (V, N)
    """

    T_cam_world: Array
    way: Array
    bend: tuple[float, float]
    X_world: Array
    uv: Array
    seen: BoolArray


def drive(rng: np.random.Generator, angle: float, radius: float = 12.0, points: int = 1500) -> SeenDrive:
    """Drive round a bend.

    Parameters
    ----------
    rng : numpy.random.Generator
        Places the points.
    angle : float
        Of the bend, radians; positive to the right.
    radius : float
        Metres.
    points : int
        Points, before those on the road are taken away, and those that are seen fewer than three times.

    Returns
    -------
    SeenDrive

    Examples
    --------
    >>> round_the_corner = drive(np.random.default_rng(0), np.pi / 2)
    >>> len(round_the_corner.T_cam_world), round_the_corner.bend[1] - round_the_corner.bend[0]
    (99, 18.84955592153876)
    """
    length = radius * abs(angle)
    way = np.arange(0.0, 2 * STRAIGHT + length, STEP)
    heading = np.sign(angle) * np.clip((way - STRAIGHT) / radius, 0.0, abs(angle))
    place = _places(way, heading)
    T = np.stack([_pose(h, p) for h, p in zip(heading, place, strict=True)])
    X = _beside(rng, place, points)
    at = CAMERA.pixel_from_world(T[:, None], X[None])  # eq-a1-3
    Z = se3.act(T[:, None], X[None])[..., 2]
    seen = at.valid & (at.uv >= 0).all(-1) & (at.uv <= np.array(SIZE) - 1).all(-1) & (Z > NEAR) & (Z < FAR)
    often = seen.sum(0) >= LEAST_VIEWS
    return SeenDrive(T, way, (STRAIGHT, STRAIGHT + length), X[often], at.uv[:, often], seen[:, often])


def _places(way: Array, heading: Array) -> Array:
    """Places (V, 2), x to the right and z ahead: each step along the chord, whose direction is the mean."""
    middle = (heading[1:] + heading[:-1]) / 2
    half = (heading[1:] - heading[:-1]) / 2
    chord = np.diff(way) * np.sinc(half / np.pi)
    steps = chord[:, None] * np.stack([np.sin(middle), np.cos(middle)], 1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def _pose(heading: float, place: Array) -> Array:
    c, s = np.cos(heading), np.sin(heading)
    R = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    return se3.from_rt(R, -R @ [place[0], 0.0, place[1]])


def _beside(rng: np.random.Generator, place: Array, points: int) -> Array:
    """Points around the road, and none on it."""
    near = place[rng.integers(0, len(place), points)] + rng.uniform(-25.0, 25.0, (points, 2))
    X = np.stack([near[:, 0], rng.uniform(-5.0, 1.6, points), near[:, 1]], 1)
    away = np.linalg.norm(near[:, None] - place[None], axis=2).min(axis=1)
    beside: Array = X[away > 3.5]
    return beside
