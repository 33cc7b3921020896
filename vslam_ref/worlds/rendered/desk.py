"""``desk``: a camera in a hand over a desk with books, papers, a keyboard, a monitor and boxes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.worlds.rendered import motion, painting
from vslam_ref.worlds.rendered.quads import Built, Quads, box, joined, quad
from vslam_ref.worlds.rendered.textures import Bytes

Rng = np.random.Generator
Paint = Callable[[Rng, tuple[int, int]], Bytes]
WIDTH, DEPTH = 1.8, 0.9
"""Metres of the desk's top, which lies at z = 0: x from left to right, y away from who sits there."""
FLOOR = -0.75
SECONDS = 20.0
TEXEL = 0.0011


class Builder:
    """Collects things and their textures."""

    def __init__(self, rng: Rng) -> None:
        self.rng = rng
        self.parts: list[Quads] = []
        self.images: list[Bytes] = []

    def texture(self, paint: Paint, width: float, height: float, texel: float = TEXEL) -> int:
        """Paint a texture for a surface of some size, metres; return its number."""
        self.images.append(paint(self.rng, painting.shape_for(width, height, texel)))
        return len(self.images) - 1

    def box(self, middle: tuple[float, float], size: tuple[float, float, float], yaw: float, *paints: Paint,
            bottom: float = 0.0, texel: float = TEXEL) -> None:  # fmt: skip
        """A box whose top, front and sides are painted; one paint may stand for all."""
        x, y, z = size
        top, front, side = (paints * 3)[:3] if len(paints) == 1 else paints
        textures = (
            self.texture(top, x, y, texel),
            self.texture(front, x, z, texel),
            self.texture(side, y, z, texel),
        )
        self.parts.append(box(middle, size, yaw, textures, bottom))

    def sheet(
        self, middle: tuple[float, float], size: tuple[float, float], yaw: float, paint: Paint, height: float
    ) -> None:
        """A flat thing that lies at some height."""
        c, s = np.cos(yaw), np.sin(yaw)
        x, y = size[0] * np.array([c, s, 0.0]), size[1] * np.array([-s, c, 0.0])
        corner = np.array([*middle, height]) - x / 2 + y / 2
        self.parts.append(quad(corner, x, -y, self.texture(paint, *size)))


def build(rng: Rng) -> Built:
    """The desk and the room around it: quads in metres, and textures."""
    b = Builder(rng)
    grey = float(rng.uniform(130, 165))
    b.box(
        (0.0, DEPTH / 2),
        (WIDTH, DEPTH, 0.03),
        0.0,
        lambda r, s: painting.wood(r, s, grey),
        bottom=-0.03,
        texel=0.0018,
    )
    _room(b)
    _things(b)
    return Built(joined(b.parts), b.images)


def _room(b: Builder) -> None:
    """A wall with posters behind the desk, and the floor."""
    wall = b.texture(lambda r, s: painting.speckled(r, s, 175.0, 22.0, 2e-4), 4.0, 3.0, 0.005)
    b.parts.append(quad([-2.0, DEPTH + 0.05, 1.9], [4.0, 0, 0], [0, 0, -3.0], wall, 0.9))
    floor = b.texture(lambda r, s: painting.tiles(r, s, 64), 4.0, 4.0, 0.006)
    b.parts.append(quad([-2.0, DEPTH + 0.05, FLOOR], [4.0, 0, 0], [0, -4.0, 0], floor, 0.6))
    for x in np.linspace(-1.05, 0.95, 4) + b.rng.uniform(-0.08, 0.08, 4):
        wide, tall = b.rng.uniform(0.3, 0.45), b.rng.uniform(0.35, 0.55)
        z = b.rng.uniform(0.75, 0.95)
        poster = b.texture(painting.poster, wide, tall, 0.002)
        b.parts.append(quad([x, DEPTH + 0.045, z], [wide, 0, 0], [0, 0, -tall], poster, 0.95))


def _things(b: Builder) -> None:
    """What stands and lies on the desk."""

    def somewhere(x: float, y: float, by: float = 0.03) -> tuple[float, float]:
        return float(x + b.rng.uniform(-by, by)), float(y + b.rng.uniform(-by, by))

    def turn(by: float = 0.4) -> float:
        return float(b.rng.uniform(-by, by))

    b.box(
        (0.08, 0.74),
        (0.52, 0.05, 0.33),
        turn(0.05),
        painting.card,
        painting.screen,
        painting.card,
        bottom=0.06,
    )
    b.box((0.08, 0.74), (0.2, 0.14, 0.06), 0.0, painting.card)
    b.box((0.05, 0.35), (0.44, 0.14, 0.022), turn(0.08), painting.keys, painting.card, painting.card)
    b.box(somewhere(0.36, 0.34, 0.01), (0.065, 0.11, 0.03), turn(), painting.cover, texel=0.0006)
    height = 0.0
    for k in range(4):  # a pile of books
        thick = float(b.rng.uniform(0.018, 0.045))
        size = (0.25 - 0.02 * k, 0.18 - 0.012 * k, thick)
        b.box(
            somewhere(-0.45, 0.3, 0.012),
            size,
            turn(0.3),
            painting.cover,
            painting.spines,
            painting.page,
            bottom=height,
        )
        height += thick
    b.box(
        (-0.52, 0.72), (0.4, 0.17, 0.24), turn(0.1), painting.page, painting.spines, painting.cover
    )  # a row of books
    for x, y in ((-0.16, 0.2), (0.5, 0.22), (-0.72, 0.24), (0.62, 0.47), (-0.2, 0.45)):
        b.sheet(somewhere(x, y), (0.21, 0.297), turn(0.7), painting.page, 0.0008 + 0.0006 * len(b.parts))
    b.box(somewhere(0.66, 0.72), (0.3, 0.22, 0.2), turn(), painting.card)
    b.box(somewhere(0.68, 0.7, 0.01), (0.18, 0.14, 0.11), turn(), painting.cover, bottom=0.2)
    b.box(somewhere(0.3, 0.58), (0.08, 0.08, 0.1), turn(1.5), painting.poster, texel=0.0007)
    b.box(somewhere(-0.22, 0.62), (0.07, 0.07, 0.12), turn(1.5), painting.cover, texel=0.0007)
    b.box(somewhere(0.78, 0.3), (0.16, 0.1, 0.05), turn(1.5), painting.poster, texel=0.0008)
    b.box(somewhere(-0.78, 0.5), (0.14, 0.2, 0.08), turn(0.5), painting.cover)
    for x, y in ((-0.02, 0.52), (0.22, 0.16), (-0.62, 0.12), (0.45, 0.45)):
        b.box(somewhere(x, y, 0.05), (0.09, 0.06, 0.012), turn(1.5), painting.poster, texel=0.0006)


def path(rng: Rng) -> motion.Path:
    """Twenty seconds over the desk: along it, closer, to both ends, and back to the start."""
    stops = np.array([
        # seconds, eye, what it looks at
        [0.0, -0.10, -0.25, 0.42, -0.02, 0.42, 0.04],
        [2.0, 0.14, -0.24, 0.44, 0.10, 0.42, 0.04],
        [4.0, 0.32, -0.14, 0.40, 0.30, 0.46, 0.06],
        [6.0, 0.52, -0.05, 0.46, 0.52, 0.50, 0.08],
        [8.5, 0.30, -0.22, 0.52, 0.24, 0.46, 0.06],
        [10.5, -0.02, -0.12, 0.40, 0.02, 0.46, 0.06],
        [12.5, -0.30, -0.16, 0.44, -0.30, 0.42, 0.06],
        [14.5, -0.56, -0.04, 0.42, -0.54, 0.44, 0.06],
        [16.5, -0.34, -0.24, 0.50, -0.26, 0.44, 0.04],
        [18.5, -0.16, -0.26, 0.44, -0.04, 0.42, 0.04],
        [20.0, -0.08, -0.25, 0.42, 0.00, 0.42, 0.04],
    ])  # fmt: skip
    times, eye, target = stops[:, 0], stops[:, 1:4], stops[:, 4:]
    eye[1:-1] += rng.uniform(-0.03, 0.03, eye[1:-1].shape)
    target[1:-1] += rng.uniform(-0.03, 0.03, target[1:-1].shape)
    at, towards = motion.through(times, eye), motion.through(times, target)
    shake = motion.tremor(rng, [0.006, 0.006, 0.006, 0.012, 0.012, 0.015])

    def smooth(t: Array) -> Array:
        return motion.looking(at(t), towards(t))

    return motion.held(smooth, shake)
