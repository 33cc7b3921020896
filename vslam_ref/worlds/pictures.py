"""Pictures with a known second view: a flat wall of painted quadrilaterals, seen through a homography.

Every edge is a straight line whose grey level changes over two pixels, so that the picture has no jagged
corners.  A second picture of the same wall is drawn from the wall, not warped from the first picture: where a
point of the first one lies in the second is known exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, as_array

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class Wall:
    """Quadrilaterals, painted in their order on a grey ground.

    Attributes
    ----------
    vertex : ndarray, shape (K, 4, 2)
        Corners in pixels of the first picture, the inside to their right as they follow one another.
    grey : ndarray, shape (K,)
        Grey levels, 0 to 255.
    ground : float
        Grey level of the rest.
    """

    vertex: Array
    grey: Array
    ground: float = 110.0


def painted_wall(rng: np.random.Generator, pieces: int = 700, size: tuple[int, int] = (640, 480)) -> Wall:
    """Rectangles of all sizes and turns, some of them beyond the borders of a picture of ``size`` (w, h)."""
    middle = rng.uniform((-40, -40), np.array(size) + 40, (pieces, 2))
    half = rng.uniform(2, 30, (pieces, 2))
    c, s = (f(rng.uniform(0, np.pi / 2, pieces)) for f in (np.cos, np.sin))
    turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    corner = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    vertex = middle[:, None] + np.einsum("kij,knj->kni", turn, corner * half[:, None])
    return Wall(vertex, rng.uniform(0, 255, pieces))


def house_front(rng: np.random.Generator, closed: float = 0.2) -> tuple[Wall, Wall]:
    """Rows of windows that differ in brightness only, and the same front with some of them walled up.

    24 x 18 windows, 12 pixels apart, the first one around pixel (20, 20); ``closed`` is the share of those
    that the second front lacks.
    """
    j, i = np.indices((18, 24)).reshape(2, -1)
    pane = np.array([[-2.0, -3.0], [2.0, -3.0], [2.0, 3.0], [-2.0, 3.0]])
    vertex = 20.0 + 12.0 * np.stack([i, j], 1)[:, None] + pane
    grey = rng.uniform(0, 255, len(vertex))
    kept = rng.random(len(vertex)) >= closed
    return Wall(vertex, grey), Wall(vertex[kept], grey[kept])


def moved(H_b_a: ArrayLike, uv: ArrayLike) -> Array:
    """Pixels (..., 2) of the second picture from those of the first, through the homography (3, 3)."""
    H, at = as_array("H_b_a", H_b_a, 3, 3), as_array("uv", uv, 2)
    far = at @ H[:, :2].T + H[:, 2]
    return far[..., :2] / far[..., 2:]


def picture(
    wall: Wall,
    H_b_a: ArrayLike | None = None,
    *,
    size: tuple[int, int] = (640, 480),
    blur: float = 2.0,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
) -> Bytes:
    """Draw the wall as seen through a homography.

    Parameters
    ----------
    wall : Wall
    H_b_a : array_like, shape (3, 3), optional
        Pixels of this picture from those of the first; the first itself by default.
    size : tuple of int
        Width and height.
    blur : float
        Pixels over which an edge changes.  A whole number keeps areas: pixels sample the edge evenly.
    noise : float
        Standard deviation of independent noise, grey levels.
    rng : numpy.random.Generator, optional
        Needed for noise.

    Returns
    -------
    ndarray of uint8, shape (height, width)

    Examples
    --------
    >>> square = Wall(np.array([[[2.0, 2.0], [6.0, 2.0], [6.0, 6.0], [2.0, 6.0]]]), np.array([200.0]))
    >>> picture(square, size=(8, 8))[4].tolist()
    [110, 110, 155, 200, 200, 200, 155, 110]
    """
    width, height = size
    canvas = np.full((height, width), float(wall.ground))
    place = wall.vertex if H_b_a is None else moved(H_b_a, wall.vertex)
    for corner, grey in zip(place, wall.grey, strict=True):
        low = np.maximum(np.floor(corner.min(0) - blur), 0).astype(int)
        high = np.minimum(np.ceil(corner.max(0) + blur) + 1, size).astype(int)
        if (low >= high).any():
            continue
        part = canvas[low[1] : high[1], low[0] : high[0]]
        x, y = np.arange(low[0], high[0]), np.arange(low[1], high[1])[:, None]
        part += _cover(corner, x, y, blur) * (grey - part)
    if noise:
        if rng is None:
            raise ValueError(f"noise is {noise}: need a generator rng to draw it")
        canvas += noise * rng.standard_normal(canvas.shape)
    drawn: Bytes = np.floor(np.clip(canvas, 0, 255) + 0.5).astype(np.uint8)
    return drawn


def _cover(corner: Array, x: NDArray[np.int64], y: NDArray[np.int64], blur: float) -> Array:
    """Share of each pixel inside a convex quadrilateral: its distance from the four edges, over the blur."""
    cover = np.ones(np.broadcast_shapes(x.shape, y.shape))
    for a, b in zip(corner, np.roll(corner, -1, 0), strict=True):
        along = (b - a) / np.hypot(*(b - a))
        inwards = along[0] * (y - a[1]) - along[1] * (x - a[0])
        cover *= np.clip(inwards / blur + 0.5, 0.0, 1.0)
    return cover
