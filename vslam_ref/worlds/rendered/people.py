"""Passers-by: people of three boxes, who walk along lanes on both sides of the hall's course.

A lane is a square about the middle; a walker turns on the spot at its corners, and has a speed of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import so3
from vslam_ref.worlds.rendered import painting
from vslam_ref.worlds.rendered.quads import Quads, box, joined
from vslam_ref.worlds.rendered.textures import Bytes

Rng = np.random.Generator
LANES = ((11.1, 11.7), (8.2, 8.8))
"""Metres from the middle: outside the course, and inside of it."""
SPEEDS = (0.6, 1.4)
TEXEL = 0.007
PARTS = (((0.26, 0.32, 0.84), 0.0), ((0.28, 0.5, 0.62), 0.84), ((0.2, 0.2, 0.26), 1.5))
"""Legs, body, head: length ahead, width and height, and height of the foot, metres."""


class Walker(NamedTuple):
    """One passer-by.

    Attributes
    ----------
    quads : Quads
        In the walker's own frame, metres: x ahead, z up, the floor at 0.
    lane : float
        Metres from the middle of the hall to each side of the lane.
    speed : float
        m/s, positive against the clock.
    start : float
        Metres along the lane at time 0.
    """

    quads: Quads
    lane: float
    speed: float
    start: float


def walkers(rng: Rng, count: int, textures: int) -> tuple[list[Walker], list[Bytes]]:
    """Draw ``count`` passers-by and their textures, which are numbered from ``textures`` on."""
    people, images = list[Walker](), list[Bytes]()
    for k in range(count):
        lane = float(rng.uniform(*LANES[k % 2]))
        speed = float(rng.uniform(*SPEEDS) * rng.choice([-1.0, 1.0]))
        parts = []
        for size, bottom in PARTS:
            grey = float(rng.uniform(40, 200))
            names = range(textures + len(images), textures + len(images) + 3)
            length, width, height = size
            for across, down in ((length, width), (length, height), (width, height)):
                images.append(_cloth(rng, painting.shape_for(across, down, TEXEL), grey))
            parts.append(box((0.0, 0.0), size, 0.0, tuple(names), bottom))
        people.append(Walker(joined(parts), lane, speed, float(rng.uniform(0, 8 * lane))))
    return people, images


def _cloth(rng: Rng, shape: tuple[int, int], grey: float) -> Bytes:
    count = shape[0] * shape[1] // 150
    return painting.finished(painting.shapes(rng, shape, count, (2.0, 12.0), (grey - 60, grey + 60), grey))


def place(walker: Walker, t: float) -> Array:
    """Pose (x, y, theta) of a walker at time ``t`` (seconds), world frame, metres and radians.

    Examples
    --------
    >>> someone = Walker(Quads(*(np.zeros(0),) * 4), 2.0, 1.0, 0.0)
    >>> place(someone, 1.0).tolist(), place(someone, 5.0).round(9).tolist()
    ([-1.0, -2.0, 0.0], [2.0, -1.0, 1.570796327])
    """
    side, along = divmod((walker.start + walker.speed * t) % (8 * walker.lane), 2 * walker.lane)
    R = np.round(so3.exp([0.0, 0.0, side * np.pi / 2]))
    x, y, _ = R @ [along - walker.lane, -walker.lane, 0.0]
    return np.array([x, y, side * np.pi / 2 + (np.pi if walker.speed < 0 else 0.0)])


def crowd(people: list[Walker]) -> Callable[[float], Quads]:
    """What stands where at time ``t``, seconds: a function that returns the quads in the world."""

    def at(t: float) -> Quads:
        return joined([_moved(w.quads, place(w, t)) for w in people])

    return at


def _moved(quads: Quads, pose: ArrayLike) -> Quads:
    x, y, theta = np.asarray(pose, np.float64)
    R = so3.exp([0.0, 0.0, theta])
    return quads._replace(corner=quads.corner @ R.T + [x, y, 0.0], side=quads.side @ R.T)
