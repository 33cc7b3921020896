r"""Means of boxes of any place and size, from a table of sums.

A pixel is a square of one grey level; (0, 0) is the centre of the first one, whose corner lies at
(-1/2, -1/2).  Between the corners of pixels the sum of all that lies above and to the left is bilinear, so
that the table gives the mean over *any* box exactly, not only over whole pixels.  Edges are rounded to 64ths
of a pixel: then all sums are whole numbers, and a constant patch has exactly its grey level as every mean.
A box is at least one pixel wide: that mean is bilinear interpolation between four pixels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.levels import Bytes, grey

PARTS = 64
"""Edges of boxes lie at such parts of a pixel."""
SHIFT = 6


def sums(image: ArrayLike) -> IntArray:
    """Sum the grey levels above and to the left of every corner of a pixel.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)

    Returns
    -------
    ndarray of int64, shape (H + 1, W + 1)
        Grey levels; row 0 and column 0 are zero.

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits.

    Examples
    --------
    >>> sums(np.array([[1, 2], [3, 4]], np.uint8)).tolist()
    [[0, 0, 0], [0, 1, 3], [0, 4, 10]]
    """
    return _sums(grey("image", image))


@accelerated("freak:sums")
def _sums(image: Bytes) -> IntArray:
    """Table (H + 1, W + 1)."""
    table = np.zeros((image.shape[0] + 1, image.shape[1] + 1), np.int64)
    np.cumsum(np.cumsum(image, 0, dtype=np.int64), 1, out=table[1:, 1:])
    return table


def field_means(
    table: IntArray, uv: Array, scale: Array, direction: Array, centre: Array, half: Array
) -> Array:
    """Means (n, m) of the boxes of fields around each key point; the pattern turns, the boxes stay upright.

    Parameters
    ----------
    table : ndarray of int64, shape (H + 1, W + 1)
        As :func:`sums` gives it.
    uv : ndarray, shape (n, 2)
        Pixels; every box must lie within the picture.
    scale : ndarray, shape (n,)
        Pixels of the picture in one of the pattern.
    direction : ndarray, shape (n, 2)
        (cos, sin) of the angle by which the pattern turns, from x towards y.
    centre, half : ndarray, shape (m, 2) and (m,)
        Centres and half sides of the fields, pixels of the pattern.

    Returns
    -------
    ndarray, shape (n, m)
        Grey levels.

    Examples
    --------
    Half of the box is a bright pixel.

    >>> table = sums(np.array([[0, 100]], np.uint8))
    >>> one = np.ones(1)
    >>> field_means(table, np.array([[0.5, 0.0]]), one, np.array([[1.0, 0.0]]), np.zeros((1, 2)), one / 2)
    array([[50.]])
    """
    return _field_means(table, uv, scale, direction, centre, half)


@accelerated("freak:field_means")
def _field_means(
    table: IntArray, uv: Array, scale: Array, direction: Array, centre: Array, half: Array
) -> Array:
    """Edges in 64ths of a pixel, sums in 4096ths of a grey level."""
    c, s = direction[:, 0, None], direction[:, 1, None]
    side = np.maximum(np.rint(2.0 * PARTS * (scale[:, None] * half)).astype(np.int64), PARTS)
    dx = scale[:, None] * (c * centre[:, 0] - s * centre[:, 1])  # (n, m)
    dy = scale[:, None] * (s * centre[:, 0] + c * centre[:, 1])
    x0 = np.rint(PARTS * (uv[:, 0, None] + dx + 0.5) - 0.5 * side).astype(np.int64)
    y0 = np.rint(PARTS * (uv[:, 1, None] + dy + 0.5) - 0.5 * side).astype(np.int64)
    x1, y1 = x0 + side, y0 + side
    total = _until(table, x1, y1) - _until(table, x0, y1) - _until(table, x1, y0) + _until(table, x0, y0)
    mean: Array = total / (side * side)
    return mean


def _until(table: IntArray, x: IntArray, y: IntArray) -> IntArray:
    """Sum of all above and left of a place in 64ths of a pixel, times 4096."""
    i, j, a, b = x >> SHIFT, y >> SHIFT, x & (PARTS - 1), y & (PARTS - 1)
    right, low = np.minimum(i + 1, table.shape[1] - 1), np.minimum(j + 1, table.shape[0] - 1)
    upper = (PARTS - a) * table[j, i] + a * table[j, right]
    lower = (PARTS - a) * table[low, i] + a * table[low, right]
    found: IntArray = (PARTS - b) * upper + b * lower
    return found
