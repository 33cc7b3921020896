"""``rotation``: a camera that turns in the middle of a room, about a point just behind its lens."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.worlds.rendered import motion
from vslam_ref.worlds.rendered.corridor import add_level, add_wall
from vslam_ref.worlds.rendered.desk import Builder
from vslam_ref.worlds.rendered.quads import Built, joined

Rng = np.random.Generator
SIDE = 5.0
SECONDS = 10.0
ARM = 0.04
"""Metres from the point that stays to the lens: the arm of a wrist."""


def build(rng: Rng) -> Built:
    """Four walls with posters, floor and ceiling: quads in metres, and textures."""
    b = Builder(rng)
    half = SIDE / 2
    add_wall(b, [-half, half, 0.0], [1.0, 0, 0], SIDE, [0, -1.0, 0])
    add_wall(b, [half, -half, 0.0], [-1.0, 0, 0], SIDE, [0, 1.0, 0])
    add_wall(b, [half, half, 0.0], [0, -1.0, 0], SIDE, [-1.0, 0, 0])
    add_wall(b, [-half, -half, 0.0], [0, 1.0, 0], SIDE, [1.0, 0, 0])
    add_level(b, [-half, -half], [SIDE, SIDE])
    return Built(joined(b.parts), b.images)


def path(rng: Rng) -> motion.Path:
    """To the right, up, to the left and back, as a head looks around; 80 degrees to each side."""
    start = motion.looking([0.0, 0.0, 1.5], [0.0, 1.0, 1.5])
    times = [0.0, 2.5, 5.0, 7.5, 10.0]
    turns: list[list[float]] = [
        [0, 0, 0],
        [-0.1, -1.4, 0.05],
        [0.15, -0.2, 0.0],
        [0.0, 1.4, -0.05],
        [0, 0, 0],
    ]
    swing, shake = motion.through(times, turns), motion.tremor(rng, [0.01, 0.01, 0.01])

    def both(t: Array) -> Array:
        return swing(t) + shake(t)

    return motion.turning(start, both, ARM)
