"""What stands in the lobby of ``hall``: walls, floor and ceiling, columns, posters, furniture, landmarks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import so3
from vslam_ref.worlds.rendered import painting, printing
from vslam_ref.worlds.rendered.desk import Builder, Paint
from vslam_ref.worlds.rendered.quads import Built, Quads, box, joined, quad
from vslam_ref.worlds.rendered.textures import Bytes

Rng = np.random.Generator
HALF, HEIGHT = 14.0, 3.8
"""Metres from the middle to a wall, and from the floor to the ceiling."""
PANEL = 4.0
POSTER_TEXEL, WALL_TEXEL, FLOOR_TEXEL, CEILING_TEXEL = 0.0075, 0.008, 0.01, 0.016
"""Metres: what a pixel sees at 4 m, so that the finest level serves where the camera passes."""
COLUMN = 0.5
OUTER_RING, INNER_RING = 12.4, 6.2
"""Metres from the middle to the columns outside and inside the course."""


class HallBuilder(Builder):
    """Collects things, their textures, and the corners printed on these."""

    def __init__(self, rng: Rng) -> None:
        super().__init__(rng)
        self.marks: dict[int, Array] = {}

    def printed(self, width: float, height: float, count: int, texel: float = POSTER_TEXEL,
                ground: Paint | None = None, outline: bool = False) -> int:  # fmt: skip
        """A texture with rectangles on it; ``outline``: its own four corners are marks, too."""
        shape = painting.shape_for(width, height, texel)
        on = None if ground is None else ground(self.rng, shape)
        made = printing.printed(self.rng, shape, count, on)
        self.images.append(made.image)
        h, w = shape
        corners = np.array([[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]])
        self.marks[len(self.images) - 1] = np.concatenate([made.marks, corners[: 4 * outline]])
        return len(self.images) - 1

    def block(self, middle: tuple[float, float], size: tuple[float, float, float], yaw: float,
              ground: Paint, count: int = 4, bottom: float = 0.0) -> None:  # fmt: skip
        """A box with something printed on its walls."""
        x, y, z = size
        textures = (
            self.texture(ground, x, y, 0.01),
            self.printed(x, z, count, ground=ground),
            self.printed(y, z, max(count // 2, 1), ground=ground),
        )
        self.parts.append(box(middle, size, yaw, textures, bottom))

    def landmarks(self) -> Array:
        """World points (N, 3) of all marks on all things, metres."""
        points = []
        for things in self.parts:
            for q, texture in enumerate(things.texture):
                if texture in self.marks:
                    share = self.marks[int(texture)] / self.images[texture].shape[::-1]
                    points.append(things.corner[q] + share @ things.side[q])
        return np.concatenate(points)


def build(rng: Rng) -> Built:
    """The lobby: quads in metres, textures, and landmarks (N, 3) in metres."""
    b = HallBuilder(rng)
    _levels(b)
    for k in range(4):
        first = len(b.parts)
        _wall(b, 0.95 if k % 2 else 0.88)
        _columns(b)
        _furniture(b)
        _turn(b.parts, first, k)
    b.block((0.0, 0.0), (4.2, 1.4, 1.1), 0.3, _wooden(135.0), 8)
    b.block((0.4, 0.1), (2.0, 0.3, 1.9), 0.3, _plastered(110.0), 6)
    for k in range(4):
        angle = 0.3 + k * np.pi / 2
        b.block((3.4 * np.cos(angle), 3.4 * np.sin(angle)), (0.6, 0.6, 0.75), angle, _plastered(90.0), 3)
    return Built(joined(b.parts), b.images, b.landmarks())


def _turn(parts: list[Quads], first: int, quarter: int) -> None:
    """Turn the parts from ``first`` on by quarters about the middle, in place."""
    R = np.round(so3.exp([0.0, 0.0, quarter * np.pi / 2]))
    for i in range(first, len(parts)):
        parts[i] = parts[i]._replace(corner=parts[i].corner @ R.T, side=parts[i].side @ R.T)


def _plastered(grey: float, spread: float = 45.0) -> Paint:
    def paint(rng: Rng, shape: tuple[int, int]) -> Bytes:
        return painting.speckled(rng, shape, grey, spread, 5e-4)

    return paint


def _wooden(grey: float) -> Paint:
    def paint(rng: Rng, shape: tuple[int, int]) -> Bytes:
        return painting.wood(rng, shape, grey)

    return paint


def _levels(b: HallBuilder) -> None:
    """Floor and ceiling in panels; some dozen textures lie in a random order."""
    floors = [
        b.texture(lambda r, s: painting.tiles(r, s, 64, 120.0), PANEL, PANEL, FLOOR_TEXEL) for _ in range(12)
    ]
    ceilings = [
        b.texture(lambda r, s: painting.tiles(r, s, 48, 185.0), PANEL, PANEL, CEILING_TEXEL) for _ in range(6)
    ]
    x, y = np.array([PANEL, 0, 0]), np.array([0, PANEL, 0])
    for i, j in np.ndindex(7, 7):
        start = np.array([-HALF + PANEL * i, -HALF + PANEL * j, 0.0])
        b.parts.append(quad(start + y, x, -y, int(b.rng.choice(floors)), 0.85))
        b.parts.append(quad(start + [0, 0, HEIGHT], x, y, int(b.rng.choice(ceilings)), 1.0))


def _wall(b: HallBuilder, light: float) -> None:
    """The wall at y = -HALF: seen from inside, it runs from x = HALF to the right, to -HALF."""
    right, foot = np.array([-1.0, 0.0, 0.0]), np.array([HALF, -HALF, 0.0])
    for k in range(round(2 * HALF / PANEL)):
        image = b.texture(_plastered(float(b.rng.uniform(140, 185)), 50.0), PANEL, HEIGHT, WALL_TEXEL)
        start = foot + k * PANEL * right + [0, 0, HEIGHT]
        b.parts.append(quad(start, PANEL * right, [0, 0, -HEIGHT], image, light))
    x = float(b.rng.uniform(0.3, 0.6))
    while x < 2 * HALF - 1.3:
        start = foot + x * right + [0, 0.012, 0]
        x += _door(b, start, light) if b.rng.random() < 0.1 else _pair(b, start, light)
        x += float(b.rng.uniform(0.1, 0.3))


def _door(b: HallBuilder, start: Array, light: float) -> float:
    """A door whose left edge is at ``start``; return its width, metres."""
    image = b.texture(painting.door, 0.95, 2.1, POSTER_TEXEL)
    b.parts.append(quad(start + [0, 0, 2.1], [-0.95, 0, 0], [0, 0, -2.1], image, light))
    return 0.95


def _pair(b: HallBuilder, start: Array, light: float) -> float:
    """Two posters, one above the other, with their left edges at ``start``; return the wider one's width."""
    wide = []
    for low, tall in ((b.rng.uniform(0.35, 0.55), b.rng.uniform(0.8, 1.1)),
                      (b.rng.uniform(1.75, 1.95), b.rng.uniform(0.7, 1.0))):  # fmt: skip
        across = float(b.rng.uniform(0.6, 1.0))
        image = b.printed(across, float(tall), 3, outline=True)
        b.parts.append(quad(start + [0, 0, low + tall], [-across, 0, 0], [0, 0, -tall], image, light))
        wide.append(across)
    return max(wide)


def _columns(b: HallBuilder) -> None:
    """Columns outside the course along the wall at y = -HALF, and three inside of it."""
    outside: Sequence[tuple[float, float]] = [(x, -OUTER_RING) for x in (-8.6, -3.1, 3.1, 8.6)]
    inside = [(-INNER_RING, -INNER_RING), (0.0, -INNER_RING)]
    for x, y in (*outside, *inside):
        shift = float(b.rng.uniform(-0.3, 0.3))
        size = (COLUMN, COLUMN, HEIGHT)
        b.block((x + shift, y), size, 0.0, _plastered(float(b.rng.uniform(95, 200))), 6)


def _furniture(b: HallBuilder) -> None:
    """Benches, plants in tubs, and boards on feet, on both sides of the course along y = -10."""
    for x, y in ((-5.9, -12.9), (5.9, -12.6), (0.2, -13.0), (-3.4, -7.3), (3.2, -7.4)):
        x += float(b.rng.uniform(-0.5, 0.5))
        yaw = float(b.rng.uniform(-0.3, 0.3))
        match int(b.rng.integers(3)):
            case 0:
                b.block((x, y), (1.6, 0.5, 0.45), yaw, _wooden(140.0), 4)
            case 1:
                b.block((x, y), (0.6, 0.6, 0.7), yaw, _plastered(85.0, 35.0), 2)
                b.block((x, y), (0.45, 0.45, 0.6), yaw + 0.4, _leaves, 1, bottom=0.7)
            case _:
                b.block((x, y), (1.2, 0.12, 1.35), yaw, painting.poster, 3, bottom=0.25)
    for x in (-11.6, 11.9):
        b.block((x, -12.9), (0.9, 0.7, 1.8), float(b.rng.uniform(-0.2, 0.2)), painting.cover, 3)


def _leaves(rng: Rng, shape: tuple[int, int]) -> Bytes:
    count = shape[0] * shape[1] // 60
    return painting.finished(painting.shapes(rng, shape, count, (2.0, 7.0), (20.0, 170.0), 60.0))
