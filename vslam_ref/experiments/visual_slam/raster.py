"""Dots, lines and areas painted into a picture.

Positions are pixels (x, y); (0, 0) is the centre of the top left one.  What lies outside is left out.  Edges
are not softened: a film is drawn large and then shrunk.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray

Bytes = NDArray[np.uint8]
Colour = tuple[int, int, int]


def dots(image: Bytes, uv: Array, colour: Colour, radius: float, cover: float = 1.0) -> None:
    """Paint discs.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W, 3)
        Changed in place.
    uv : ndarray, shape (n, 2)
        Their centres; those that are not finite are left out.
    colour : (int, int, int)
        Red, green, blue.
    radius : float
        Pixels.
    cover : float
        1 hides what is below, 0.5 lets half of it through.
    """
    height, width = image.shape[:2]
    reach = int(radius)
    offset = np.stack(np.meshgrid(*(np.arange(-reach, reach + 1),) * 2), -1).reshape(-1, 2)
    offset = offset[(offset**2).sum(1) <= radius**2 + 0.5]
    near = np.isfinite(uv).all(1) & (np.abs(uv) < 2**20).all(1)
    at = (np.rint(uv[near]).astype(np.int64)[:, None] + offset).reshape(-1, 2)
    at = at[((at >= 0) & (at < (width, height))).all(1)]
    rows, columns = at[:, 1], at[:, 0]
    image[rows, columns] = _mixed(image[rows, columns], colour, cover)


def lines(image: Bytes, ends: Array, colour: Colour, radius: float, cover: float = 1.0) -> None:
    """Paint line segments from ``ends[:, 0]`` to ``ends[:, 1]``, (n, 2, 2); ``radius`` is half their width.

    Segments with an end farther outside than the picture is large are left out.
    """
    height, width = image.shape[:2]
    size = np.array([width, height])
    ends = ends[((ends > -size) & (ends < 2 * size)).all((1, 2))]
    length = np.abs(ends[:, 1] - ends[:, 0]).max(1, initial=0.0)
    count = np.ceil(length).astype(np.int64) + 1
    segment = np.repeat(np.arange(len(ends)), count)
    place = np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count)
    share = (place / np.maximum(count - 1, 1)[segment])[:, None]
    dots(image, (1 - share) * ends[segment, 0] + share * ends[segment, 1], colour, radius, cover)


def area(image: Bytes, corners: Array, colour: Colour, cover: float = 1.0) -> None:
    """Paint a convex area with ``corners`` (n, 2), one after the other in either sense."""
    height, width = image.shape[:2]
    low = np.maximum(np.floor(corners.min(0)), 0).astype(int)
    high = np.minimum(np.ceil(corners.max(0)) + 1, (width, height)).astype(int)
    if (high <= low).any():
        return
    x, y = np.arange(low[0], high[0]), np.arange(low[1], high[1])[:, None]
    window = image[low[1] : high[1], low[0] : high[0]]
    inside = _inside(x, y, corners)
    window[inside] = _mixed(window[inside], colour, cover)


def _inside(x: NDArray[np.int64], y: NDArray[np.int64], corners: Array) -> BoolArray:
    """Pixels on one side of all edges."""
    step = np.roll(corners, -1, axis=0) - corners
    side = [d[0] * (y - c[1]) - d[1] * (x - c[0]) for c, d in zip(corners, step, strict=True)]
    stack = np.stack(side)
    return np.asarray((stack >= 0).all(0) | (stack <= 0).all(0))


def _mixed(below: Bytes, colour: Colour, cover: float) -> Bytes:
    return np.rint((1 - cover) * below + cover * np.array(colour, dtype=np.float64)).astype(np.uint8)
