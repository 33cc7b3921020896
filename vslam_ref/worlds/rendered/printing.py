"""Printed surfaces whose corners are known: pictures with plain rectangles, as signs and notices have them.

A rectangle's sides lie between texels, at multiples of ``STEP`` texels, so that every level up to that step
shows them where the finest one does; a plain rim of ``RIM`` texels keeps everything else away.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.worlds.rendered import painting
from vslam_ref.worlds.rendered.textures import Bytes

Rng = np.random.Generator
STEP, RIM = 4, 8


class Printed(NamedTuple):
    """A texture and its corners.

    Attributes
    ----------
    image : ndarray of uint8, shape (H, W)
        Grey values, no unit.
    marks : ndarray, shape (n, 2)
        Where corners of rectangles are: columns and rows, texels; (0, 0) is the texture's own corner.
    """

    image: Bytes
    marks: Array


def printed(rng: Rng, shape: tuple[int, int], count: int, ground: Bytes | None = None) -> Printed:
    """Print up to ``count`` rectangles in rows and columns on a texture (H, W).

    Parameters
    ----------
    rng : Generator
    shape : (int, int)
        Height and width, texels.
    count : int
        How many are tried: at most one in each cell of a grid, whose cells are as square as can be.
    ground : ndarray of uint8, optional
        What is printed on; by default a poster.
    """
    height, width = shape
    image = (painting.poster(rng, shape) if ground is None else ground).astype(np.float64)
    columns = max(1, round(float(np.sqrt(count * width / height))))
    rows = -(-count // columns)
    cell = np.array([height // rows, width // columns])
    marks = []
    for place in rng.permutation(rows * columns)[:count]:
        corner = cell * np.divmod(place, columns)
        rectangle = _rectangle(rng, corner, cell)
        if rectangle is not None:
            top, left, bottom, right = rectangle
            _print(rng, image, rectangle)
            marks += [(left, top), (right, top), (right, bottom), (left, bottom)]
    return Printed(painting.finished(image), np.array(marks, np.float64).reshape(-1, 2))


def _rectangle(rng: Rng, corner: Array, cell: Array) -> tuple[int, int, int, int] | None:
    """Top, left, bottom, right of a rectangle in a cell (2,), rows and columns; None if it is too small."""
    room = (cell - 2 * (RIM + STEP)) // STEP  # sides in steps
    if (room < 3).any():
        return None
    size = [int(rng.integers(max(3, n // 3), n + 1)) for n in np.minimum(room, 16)]
    shift = [int(rng.integers(0, n - s + 1)) for n, s in zip(room, size, strict=True)]
    first = [-(-(int(c) + RIM + STEP) // STEP) + s for c, s in zip(corner, shift, strict=True)]
    top, left = (STEP * n for n in first)
    return top, left, top + STEP * size[0], left + STEP * size[1]


def _print(rng: Rng, image: Array, rectangle: tuple[int, int, int, int]) -> None:
    """A plain rim, the rectangle in it, and a smaller one in that; in place."""
    top, left, bottom, right = rectangle
    dark, light = float(rng.uniform(15, 70)), float(rng.uniform(185, 245))
    inner, outer = (dark, light) if rng.random() < 0.5 else (light, dark)
    image[top - RIM : bottom + RIM, left - RIM : right + RIM] = outer
    part = image[top - RIM + 1 : bottom + RIM - 1, left - RIM + 1 : right + RIM - 1]
    part[RIM - 1 : 1 - RIM, RIM - 1 : 1 - RIM] = inner
    # edges change over two texels, a quarter and three quarters, on both sides of the line alike
    for axis in (0, 1):
        lines = np.moveaxis(part, axis, 0)
        lines[1:-1] = (lines[:-2] + 2 * lines[1:-1] + lines[2:]) / 4
