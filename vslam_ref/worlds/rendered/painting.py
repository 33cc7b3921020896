"""What the surfaces of a scene look like: wood, paper, covers, posters, keys, plaster, tiles.

All are grey values of a texture (H, W) whose sides are multiples of ``MULTIPLE`` texels, drawn from a
generator.  Edges change over two texels, so that the finest level is no sharper than it can show; shapes have
all sizes, so that there are corners at every level of an image pyramid.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.worlds.rendered.textures import MULTIPLE, Bytes

Rng = np.random.Generator


def shape_for(width: float, height: float, texel: float) -> tuple[int, int]:
    """Height and width in texels of ``texel`` metres for a surface of ``width`` x ``height`` metres.

    Examples
    --------
    >>> shape_for(0.3, 0.2, 0.001)
    (256, 320)
    """
    rows, columns = (MULTIPLE * max(1, int(np.ceil(n / texel / MULTIPLE - 1e-9))) for n in (height, width))
    return rows, columns


def clouds(
    rng: Rng, shape: tuple[int, int], coarsest: float, octaves: int = 4, stretch: float = 1.0
) -> Array:
    """Smooth noise (H, W) of several octaves, standard deviation 1 and no unit.

    Parameters
    ----------
    rng : Generator
    shape : (int, int)
    coarsest : float
        Size of the largest blots along the rows, texels; each octave is half as large, and half as strong.
    octaves : int
    stretch : float
        How much longer blots are along the columns' direction.
    """
    total = np.zeros(shape)
    for k in range(octaves):
        size = max(coarsest / 2**k, 2.0)
        counts = [int(np.ceil(n / s)) + 2 for n, s in zip(shape, (size, size * stretch), strict=True)]
        total += 0.5**k * _enlarged(rng.standard_normal(counts), shape, (size, size * stretch))
    return np.asarray(total / total.std())


def _enlarged(grid: Array, shape: tuple[int, int], size: tuple[float, float]) -> Array:
    """A grid (h, w) at ``shape``, smoothly between its values, which are ``size`` texels apart."""
    parts = []
    for n, s, most in zip(shape, size, grid.shape, strict=True):
        at = np.arange(n) / s
        low = np.minimum(at.astype(int), most - 2)
        share = at - low
        parts.append((low, share * share * (3 - 2 * share)))
    (i, v), (j, u) = parts
    rows = grid[i] + v[:, None] * (grid[i + 1] - grid[i])
    return np.asarray(rows[:, j] + u * (rows[:, j + 1] - rows[:, j]))


def finished(grey: ArrayLike) -> Bytes:
    """Grey values (H, W), no unit, as bytes: rounded and kept within 0 to 255."""
    return np.floor(np.clip(grey, 0, 255) + 0.5).astype(np.uint8)


def shapes(
    rng: Rng,
    shape: tuple[int, int],
    count: int,
    sizes: tuple[float, float],
    greys: tuple[float, float],
    ground: float,
    turned: bool = True,
) -> Array:
    """Rectangles one over the other, (H, W), few large and many small ones: corners of every size.

    Parameters
    ----------
    rng : Generator
    shape : (int, int)
    count : int
    sizes : (float, float)
        Smallest and largest half side, texels; equally many in each octave.
    greys : (float, float)
    ground : float
        Grey value between them.
    turned : bool
        Whether they are turned.
    """
    low, high = np.log(sizes)
    middle = rng.uniform((0, 0), shape[::-1], (count, 2))
    half = np.exp(rng.uniform(float(low), float(high), count))[:, None] * rng.uniform(0.6, 1.6, (count, 2))
    angle = rng.uniform(0, np.pi, count) if turned else np.zeros(count)
    grey = rng.uniform(*greys, count)
    canvas = np.full(shape, ground)
    for k in np.argsort(-half.max(1), kind="stable"):  # the large ones first
        _rectangle(canvas, middle[k], half[k], float(angle[k]), float(grey[k]))
    return canvas


def _rectangle(canvas: Array, middle: Array, half: Array, angle: float, grey: float) -> None:
    """Paint a turned rectangle on a canvas, in place; its edges change over two texels."""
    c, s = np.cos(angle), np.sin(angle)
    reach = np.abs([[c, s], [s, c]]) @ half + 1.0
    left, top = np.maximum(np.ceil(middle - reach), 0).astype(int)
    right, bottom = np.floor(middle + reach).astype(int) + 1
    part = canvas[top:bottom, left:right]
    x, y = np.arange(left, left + part.shape[1]) - middle[0], np.arange(top, top + part.shape[0]) - middle[1]
    along, across = np.add.outer(s * y, c * x), np.add.outer(c * y, -s * x)
    inside = np.minimum(half[0] - np.abs(along), half[1] - np.abs(across))
    part += np.minimum(np.maximum(0.5 * inside + 0.5, 0.0), 1.0) * (grey - part)


def wood(rng: Rng, shape: tuple[int, int], grey: float = 150.0) -> Bytes:
    """Grain along the columns' direction, with marks; (H, W), mean ``grey``, no unit."""
    grain = clouds(rng, shape, 24.0, 4, stretch=14.0)
    rings = np.sin(2.2 * clouds(rng, shape, 90.0, 3, stretch=9.0))
    marks = shapes(rng, shape, shape[0] * shape[1] // 5000, (1.2, 6.0), (-60.0, 60.0), 0.0)
    return finished(grey + 10 * grain + 12 * rings + marks)


def speckled(rng: Rng, shape: tuple[int, int], grey: float, spread: float, per_texel: float = 4e-4) -> Bytes:
    """A rough surface with flakes of all sizes, as plaster: (H, W), ``grey`` +- ``spread``, no unit."""
    count = int(per_texel * shape[0] * shape[1])
    flakes = shapes(rng, shape, count, (1.3, 9.0), (grey - spread, grey + spread), grey)
    return finished(flakes + 0.15 * spread * clouds(rng, shape, 40.0, 4))


def page(rng: Rng, shape: tuple[int, int], line: int = 14, paper: float = 225.0) -> Bytes:
    """Printed paper (H, W): a heading, lines of words, and a figure; ``paper`` is its grey value, no unit."""
    height, width = shape
    grey = paper + 3 * clouds(rng, shape, 120.0, 3)
    edge, body, letter = max(width // 12, 6), max(line // 2, 3), max(line // 4, 2)
    inner = width - 2 * edge
    top, tall = int(rng.integers(height // 3, height // 2)), height // 4  # of the figure
    _put(grey, edge, edge, _letters(rng, line + 4, int(0.6 * inner), 2 * letter, paper))
    for y in range(edge + 2 * line, height - edge - body, line):
        beside = top - line < y < top + tall
        length = int(inner * (0.47 if beside else rng.choice([1.0, 1.0, 1.0, 0.6])))
        _put(grey, y, edge, _letters(rng, body, length, letter, paper))
    plate = shapes(rng, (tall, inner // 2), 40, (2.0, 25.0), (30.0, 230.0), 140.0)
    _put(grey, top, edge + inner - inner // 2, plate)
    return finished(_softened(grey))


def _put(canvas: Array, y: int, x: int, patch: Array) -> None:
    """Lay a patch on a canvas, in place; what goes beyond its border is cut off."""
    room = canvas[y : y + patch.shape[0], x : x + patch.shape[1]]
    room[...] = patch[: room.shape[0], : room.shape[1]]


def _letters(rng: Rng, height: int, width: int, letter: int, paper: float) -> Array:
    """One line of words: letters of few strokes (height, width)."""
    count = width // letter + 1
    ink = rng.random(count) < 0.72
    ink &= rng.random(count).cumsum() % 5 > 0.6  # gaps between words
    strokes = np.where(rng.random((3, count)) < 0.62, rng.uniform(25, 90, (3, count)), paper)
    columns = np.minimum(np.arange(width) // letter, count - 1)
    rows = np.minimum(np.arange(height) * 3 // height, 2)
    return np.where(ink[columns], strokes[rows[:, None], columns], paper)


def _softened(grey: Array) -> Array:
    """Mean of a texel and its neighbours along both directions, 1 : 2 : 1."""
    padded = np.pad(grey, 1, mode="edge")
    rows = (padded[:-2] + 2 * padded[1:-1] + padded[2:]) / 4
    return np.asarray((rows[:, :-2] + 2 * rows[:, 1:-1] + rows[:, 2:]) / 4)


def cover(rng: Rng, shape: tuple[int, int]) -> Bytes:
    """The cover of a book or a box: a ground, bands, a picture, words in large letters."""
    height, width = shape
    ground = float(rng.uniform(40, 200))
    around, turned = (ground - 45, ground + 45), bool(rng.random() < 0.5)
    grey = shapes(rng, shape, 25, (width / 30, width / 5), around, ground, turned)
    for _ in range(3):
        tall = int(rng.integers(max(height // 20, 4), max(height // 7, 8)))
        y, wide = int(rng.integers(0, height - tall)), int(rng.uniform(0.5, 0.9) * width)
        x = int(rng.integers(0, width - wide))
        words = _letters(rng, tall, wide, max(tall // 3, 2), ground)
        below = grey[y : y + tall, x : x + wide]
        _put(grey, y, x, np.where(words == ground, below, 255.0 - words))
    return finished(_softened(grey) + 2 * clouds(rng, shape, 60.0, 3))


def poster(rng: Rng, shape: tuple[int, int]) -> Bytes:
    """A picture in a pale border: shapes of all sizes, and a line of letters below."""
    height, width = shape
    grey = np.full(shape, 235.0)
    edge = max(min(shape) // 16, 3)
    inner = (height - 2 * edge, width - 2 * edge)
    count = int(np.clip(inner[0] * inner[1] / 350, 60, 700))
    ground, tall = float(rng.uniform(60, 190)), max(height // 9, 6)
    _put(grey, edge, edge, shapes(rng, inner, count, (2.0, min(inner) / 6), (10.0, 250.0), ground))
    _put(grey, height - edge - tall, edge, _letters(rng, tall, inner[1], max(tall // 3, 2), 235.0))
    return finished(_softened(grey))


def door(rng: Rng, shape: tuple[int, int]) -> Bytes:
    """A door: a frame, sunken panels, a handle, a sign with a number."""
    height, width = shape
    grey = float(rng.uniform(70, 120)) + 3 * clouds(rng, shape, 30.0, 3, stretch=4.0)
    grey[:, : width // 16] = grey[:, -(width // 16) :] = grey[: height // 40] = 190.0
    for top, bottom in ((0.08, 0.46), (0.54, 0.93)):
        panel = grey[int(top * height) : int(bottom * height), width // 6 : -(width // 6)]
        panel -= 25.0
        panel[:3] -= 30.0
        panel[-3:] += 40.0
    _put(grey, height // 2, int(0.8 * width), np.full((max(height // 60, 3), width // 9), 225.0))
    sign = (height // 12, int(0.4 * width))
    _put(grey, height // 5, int(0.3 * width), _letters(rng, *sign, max(sign[0] // 3, 2), 235.0))
    return finished(_softened(grey))


def keys(rng: Rng, shape: tuple[int, int], rows: int = 6, columns: int = 18) -> Bytes:
    """A keyboard: rows of like keys, each with its letter."""
    height, width = shape
    v, u = np.indices(shape)
    row, column = v * rows // height, (u + (v * rows // height) * width // columns // 3) * columns // width
    y, x = v * rows / height % 1, (u + row * width // columns // 3) * columns / width % 1
    key = (np.abs(y - 0.5) < 0.41) & (np.abs(x - 0.5) < 0.41)
    strokes = rng.random((rows, columns + 4, 3, 3)) < 0.5
    inner_y, inner_x = ((np.clip(c, 0.3, 0.659) - 0.3) / 0.12 for c in (y, x))
    letter = (np.abs(y - 0.48) < 0.18) & (np.abs(x - 0.48) < 0.18)
    letter &= strokes[row, np.minimum(column, columns + 3), inner_y.astype(int), inner_x.astype(int)]
    return finished(_softened(np.where(letter, 215.0, np.where(key, 58.0, 22.0))))


def screen(rng: Rng, shape: tuple[int, int]) -> Bytes:
    """A monitor that shows windows with text."""
    grey = 50 + 25 * clouds(rng, shape, shape[1] / 2, 2)
    for _ in range(4):
        tall, wide = (int(rng.uniform(0.3, 0.6) * n) for n in shape)
        y, x = int(rng.integers(0, shape[0] - tall)), int(rng.integers(0, shape[1] - wide))
        dark = bool(rng.random() < 0.5)
        grey[y : y + tall, x : x + wide] = 30.0 if dark else 235.0
        grey[y : y + 8, x : x + wide] = 130.0
        for top in range(y + 14, y + tall - 10, 11):
            words = _letters(rng, 6, int(rng.uniform(0.3, 0.95) * (wide - 10)), 4, 235.0)
            _put(grey, top, x + 5, 265.0 - words if dark else words)
    bezel = max(min(shape) // 40, 3)
    framed = np.full(shape, 18.0)
    framed[bezel:-bezel, bezel:-bezel] = grey[bezel:-bezel, bezel:-bezel]
    return finished(_softened(framed))


def card(rng: Rng, shape: tuple[int, int]) -> Bytes:
    """Cardboard with tape, a label and print."""
    grey = 150 + 5 * clouds(rng, shape, 40.0, 4) + 4 * clouds(rng, shape, 6.0, 2, stretch=8.0)
    height, width = shape
    grey[:, int(0.44 * width) : int(0.56 * width)] += 22
    y, x = (int(rng.uniform(0.08, 0.5) * n) for n in shape)
    _put(grey, y, x, page(rng, (int(0.38 * height), int(0.34 * width)), line=10).astype(np.float64))
    return finished(_softened(grey))


def spines(rng: Rng, shape: tuple[int, int]) -> Bytes:
    """Backs of books side by side, with titles."""
    grey = np.zeros(shape)
    x = 0
    while x < shape[1]:
        wide, ground = int(rng.integers(18, 46)), float(rng.uniform(25, 215))
        back = np.full((shape[0], wide), ground)
        back[:, :2] *= 0.5
        title = _letters(rng, wide - 8, int(0.6 * shape[0]), 5, ground).T
        _put(
            back, int(rng.uniform(0.05, 0.3) * shape[0]), 4, np.where(title == ground, ground, 250.0 - title)
        )
        band = int(rng.uniform(0.75, 0.95) * shape[0])
        back[band : band + 6] = 240.0 - 0.8 * ground
        _put(grey, 0, x, back)
        x += wide
    return finished(_softened(grey))


def tiles(rng: Rng, shape: tuple[int, int], side: int, grey: float = 130.0) -> Bytes:
    """Square tiles of ``side`` texels with dark joints, flecked: (H, W), mean ``grey``, no unit."""
    v, u = np.indices(shape)
    own = rng.normal(0, 14, (shape[0] // side + 1, shape[1] // side + 1))[v // side, u // side]
    joint = np.minimum(v % side, u % side) < 2
    flecks = speckled(rng, shape, grey, 45.0, 6e-4).astype(np.float64)
    return finished(_softened(np.where(joint, 60.0, flecks + own)))
