"""A building that makes place recognition err: one door everywhere, few posters hung again and again.

The corridors are those of ``building``, but each of its four sides has an order of its own.  What differs
from place to place is this order, the flecks of plaster, floor and ceiling, and posters that are nowhere
else; what is the same is every door, the joints of floor and ceiling, and every poster that is hung twice.
The walk goes round twice, on the second round beside the first one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.worlds.rendered import building, motion, painting
from vslam_ref.worlds.rendered.corridor import HEIGHT, WIDTH, add_level
from vslam_ref.worlds.rendered.desk import Builder
from vslam_ref.worlds.rendered.quads import joined, quad
from vslam_ref.worlds.rendered.record import EXACT, Effects, RenderedScene
from vslam_ref.worlds.rendered.scenes import pinhole
from vslam_ref.worlds.rendered.textures import Bytes, pack

Rng = np.random.Generator
LAP = 4 * (building.SIDE - 2 * building.RADIUS + building.RADIUS * np.pi / 2) / building.SPEED
"""Seconds of one round."""
DOOR = (0.9, 2.05)
"""Metres, width and height."""


class Repeats(NamedTuple):
    """How much of the building repeats itself.

    Attributes
    ----------
    doors : float
        Share of the things on the walls that are the one door.
    numbered : bool
        Whether each door has a sign of its own; else all have one.
    again : float
        Share of the posters that hang in several places.
    posters : int
        How many different ones these are.
    """

    doors: float = 0.5
    numbered: bool = True
    again: float = 0.1
    posters: int = 6


def lookalikes(
    seed: int,
    *,
    size: tuple[int, int] = (512, 384),
    pictures: int = 90,
    repeats: Repeats = Repeats(),  # noqa: B008
    effects: Effects = EXACT,
) -> RenderedScene:
    """Make the building and two rounds through it.

    Parameters
    ----------
    seed : int
    size : (int, int)
        Width and height of the pictures, pixels.
    pictures : int
        Of both rounds together, at equal times.
    repeats : Repeats
    effects : Effects

    Returns
    -------
    RenderedScene

    Raises
    ------
    ValueError
        If a number is out of range.

    Examples
    --------
    >>> made = lookalikes(1, size=(64, 48), pictures=4)
    >>> len(made), made.frame(0).shape
    (4, (48, 64))
    """
    if not (0 <= repeats.doors <= 1 and 0 <= repeats.again <= 1 and repeats.posters >= 1):
        raise ValueError(f"{repeats}: need shares from 0 to 1, and a poster or more")
    if pictures < 2 or seed < 0:
        raise ValueError(f"{pictures} pictures, seed {seed}: need two or more, and a seed of at least 0")
    things, way = (np.random.default_rng(s) for s in np.random.SeedSequence([seed, 77]).spawn(2))
    b = Builder(things)
    _build(b, repeats)
    sway = motion.tremor(way, [0.2, 0.04, 0.2, 0.02, 0.06, 0.02], slowest=0.02, octaves=2)
    path = motion.held(building.path(way), sway)
    times = 2 * LAP * np.arange(pictures) / pictures
    lens = pinhole("building", size)
    return RenderedScene(
        "lookalikes", joined(b.parts), pack(b.images), lens, size, path, times, effects, seed
    )


class _Stock(NamedTuple):
    """Textures that are used again: the door, and posters with their sizes, metres."""

    door: int
    posters: list[tuple[int, float, float]]


def _build(b: Builder, repeats: Repeats) -> None:
    stock = _Stock(b.texture(painting.door, *DOOR, 0.004), [_poster(b) for _ in range(repeats.posters)])
    middle = building.OUTER / 2
    for k in range(4):
        c, s = round(np.cos(k * np.pi / 2)), round(np.sin(k * np.pi / 2))
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0, 0, 1.0]])
        first = len(b.parts)
        _wall(b, np.zeros(3), building.OUTER, 1.0, stock, repeats)
        _wall(b, np.array([WIDTH, WIDTH, 0.0]), building.OUTER - 2 * WIDTH, -1.0, stock, repeats)
        add_level(b, [0.0, 0.0], [building.SIDE, WIDTH])
        for i in range(first, len(b.parts)):
            part = b.parts[i]
            centre = np.array([middle, middle, 0.0])
            b.parts[i] = part._replace(corner=(part.corner - centre) @ R.T + centre, side=part.side @ R.T)


def _poster(b: Builder) -> tuple[int, float, float]:
    wide, tall = float(b.rng.uniform(0.4, 0.85)), float(b.rng.uniform(0.4, 1.0))
    return b.texture(painting.poster, wide, tall, 0.004), wide, tall


def _wall(b: Builder, start: Array, length: float, inwards: float, stock: _Stock, repeats: Repeats) -> None:
    """A wall along x, seen from +y or -y, with doors and posters in an order of its own."""
    right = np.array([-inwards, 0.0, 0.0])  # seen from +y, x runs to the left
    foot = start if inwards < 0 else start + [length, 0, 0]
    plaster = b.texture(lambda r, s: painting.speckled(r, s, 170.0, 14.0, 2e-4), length, HEIGHT, 0.01)
    b.parts.append(quad(foot + [0, 0, HEIGHT], length * right, [0, 0, -HEIGHT], plaster, 0.95))
    before = np.array([0.0, 0.012 * inwards, 0.0])
    x = float(b.rng.uniform(0.2, 0.8))
    while True:
        low, (image, wide, tall) = _thing(b, stock, repeats)
        if x + wide > length - 0.1:
            break
        b.parts.append(
            quad(foot + before + x * right + [0, 0, low + tall], wide * right, [0, 0, -tall], image)
        )
        x += wide + float(b.rng.uniform(0.3, 1.2))


def _thing(b: Builder, stock: _Stock, repeats: Repeats) -> tuple[float, tuple[int, float, float]]:
    """What hangs next, and how high, metres."""
    if b.rng.random() < repeats.doors:
        if not repeats.numbered:
            return 0.0, (stock.door, *DOOR)
        b.images.append(numbered(b.images[stock.door], b.rng))
        return 0.0, (len(b.images) - 1, *DOOR)
    low = float(b.rng.uniform(1.0, 1.35))
    if b.rng.random() < repeats.again:
        return low, stock.posters[int(b.rng.integers(len(stock.posters)))]
    return low, _poster(b)


def numbered(door: Bytes, rng: Rng) -> Bytes:
    """The same door (H, W) with another sign, where ``painting.door`` has it; grey values, no unit."""
    height, width = door.shape
    rows, columns = slice(height // 5, height // 5 + height // 12), slice(int(0.3 * width), int(0.7 * width))
    other = painting.door(rng, door.shape)
    made = door.copy()
    made[rows, columns] = other[rows, columns]
    return made


def overlap(scene: RenderedScene, grid: tuple[int, int] = (8, 6)) -> Array:
    """Share (K, K) of a grid (W, H) of points of picture k that picture j shows, too; a ratio."""
    u, v = ((np.arange(n) + 0.5) / n * size - 0.5 for n, size in zip(grid, scene.size, strict=True))
    uv = np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)
    X = np.concatenate([scene.surface(k, uv) for k in range(len(scene))])
    there = np.isfinite(X).all(1)
    seen = scene.tracks(np.where(there[:, None], X, 0.0)).visible & there
    return np.asarray(seen.reshape(len(scene), len(scene), len(uv)).mean(-1).T)
