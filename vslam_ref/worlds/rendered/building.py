"""``building``: four like corridors around a court; the walk ends where it began, and a bit further.

The walls of all four are painted alike, but for one poster each: places look the same that are not.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import so3
from vslam_ref.worlds.rendered import motion, painting
from vslam_ref.worlds.rendered.corridor import EYE, WIDTH, add_level, add_wall
from vslam_ref.worlds.rendered.desk import Builder
from vslam_ref.worlds.rendered.quads import Built, Quads, joined, quad

Rng = np.random.Generator
OUTER = 14.0
"""Metres from outer wall to outer wall."""
RADIUS, SPEED = 1.0, 1.2
SIDE = OUTER - WIDTH
"""Metres of a side of the square in the middle of the corridors."""
SECONDS = 44.0


def build(rng: Rng) -> Built:
    """One corridor, four times, and one poster of its own for each: quads in metres, and textures."""
    b = Builder(rng)
    add_wall(b, [0.0, 0.0, 0.0], [1.0, 0, 0], OUTER, [0, 1.0, 0])
    add_wall(b, [WIDTH, WIDTH, 0.0], [1.0, 0, 0], OUTER - 2 * WIDTH, [0, -1.0, 0])
    add_level(b, [0.0, 0.0], [SIDE, WIDTH])
    one = joined(b.parts)
    middle = np.array([OUTER / 2, OUTER / 2, 0.0])
    sides = []
    for k in range(4):
        R = np.round(so3.exp([0.0, 0.0, k * np.pi / 2]))
        x, tall = float(rng.uniform(0.3, 0.6)) * OUTER, 0.5
        own = quad(
            [x + 0.6, 0.02, 2.35],
            [-0.6, 0, 0],
            [0, 0, -tall],
            b.texture(painting.poster, 0.6, tall, 0.004),
            0.95,
        )
        side = joined([one, own])
        turned = Quads((side.corner - middle) @ R.T + middle, side.side @ R.T, side.texture, side.light)
        sides.append(turned)
    return Built(joined(sides), b.images)


def path(rng: Rng) -> motion.Path:
    """Around the square against the clock, corners in arcs of one metre."""
    shake = motion.tremor(rng, [0.012, 0.02, 0.01, 0.012, 0.012, 0.01], slowest=0.5)
    straight, arc = SIDE - 2 * RADIUS, RADIUS * np.pi / 2
    first = np.array([WIDTH / 2 + RADIUS, WIDTH / 2])

    def place(s: Array) -> tuple[Array, Array]:
        """Where the walk is after s metres, (..., 2), and its heading, radians."""
        lap, rest = np.divmod(s, straight + arc)
        side = np.minimum(rest, straight)
        angle = np.maximum(rest - straight, 0.0) / RADIUS
        x = side + RADIUS * np.sin(angle)
        y = RADIUS * (1 - np.cos(angle))
        turn = lap % 4 * np.pi / 2
        middle = OUTER / 2
        c, q = np.round(np.cos(turn)), np.round(np.sin(turn))
        u, v = x + first[0] - middle, y + first[1] - middle
        return np.stack([c * u - q * v + middle, q * u + c * v + middle], -1), lap * np.pi / 2 + angle

    def smooth(t: Array) -> Array:
        xy, _ = place(SPEED * t)
        ahead = np.mean([place(SPEED * t + d)[1] for d in np.linspace(0.0, 1.6, 9)], 0)  # looks into the bend
        eye = np.concatenate([xy, np.full((*xy.shape[:-1], 1), EYE)], -1)
        view = np.stack([np.cos(ahead), np.sin(ahead), np.full_like(ahead, -0.03)], -1)
        return motion.looking(eye, eye + view)

    return motion.held(smooth, shake)
