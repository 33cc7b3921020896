"""Numba twins of FREAK: the table of sums, means of fields, and comparisons."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

PARTS, SHIFT = 64, 6
IMAGE = types.Array(types.uint8, 2, "C", readonly=True)
TABLE = given(2, types.int64)


@kernel(IMAGE, returns=types.Array(types.int64, 2, "C"))
def sums(image):
    """Twin of :func:`vslam_ref.features.freak.sampling._sums`."""
    height, width = image.shape
    table = np.zeros((height + 1, width + 1), np.int64)
    for y in range(height):
        row = np.int64(0)
        for x in range(width):
            row += np.int64(image[y, x])
            table[y + 1, x + 1] = table[y, x + 1] + row
    return table


@njit(cache=True)
def _along(table, j, i, a):
    """Between two corners of a row, times 64."""
    right = min(i + 1, table.shape[1] - 1)
    return (PARTS - a) * table[j, i] + a * table[j, right]


@njit(cache=True)
def _row(table, x0, x1, y):
    """Sum above a place between rows and between two edges, times 4096."""
    j, b = y >> SHIFT, y & (PARTS - 1)
    low = min(j + 1, table.shape[0] - 1)
    i0, a0, i1, a1 = x0 >> SHIFT, x0 & (PARTS - 1), x1 >> SHIFT, x1 & (PARTS - 1)
    upper = _along(table, j, i1, a1) - _along(table, j, i0, a0)
    lower = _along(table, low, i1, a1) - _along(table, low, i0, a0)
    return (PARTS - b) * upper + b * lower


@kernel(TABLE, given(2), given(1), given(2), given(2), given(1), returns=types.Array(types.float64, 2, "C"))
def field_means(table, uv, scale, direction, centre, half):
    """Twin of :func:`vslam_ref.features.freak.sampling._field_means`."""
    mean = np.empty((uv.shape[0], centre.shape[0]))
    for n in range(uv.shape[0]):
        c, s, wide = direction[n, 0], direction[n, 1], scale[n]
        for m in range(centre.shape[0]):
            side = np.int64(max(np.rint(2.0 * PARTS * (wide * half[m])), 1.0 * PARTS))
            x = uv[n, 0] + wide * (c * centre[m, 0] - s * centre[m, 1]) + 0.5
            y = uv[n, 1] + wide * (s * centre[m, 0] + c * centre[m, 1]) + 0.5
            x0 = np.int64(np.rint(PARTS * x - 0.5 * side))
            y0 = np.int64(np.rint(PARTS * y - 0.5 * side))
            total = _row(table, x0, x0 + side, y0 + side) - _row(table, x0, x0 + side, y0)
            mean[n, m] = total / (side * side)
    return mean


@kernel(given(2), given(2, types.int64), returns=types.Array(types.uint8, 2, "C"))
def bits(mean, pairs):
    """Twin of :func:`vslam_ref.features.freak.description._bits`."""
    found = np.zeros((mean.shape[0], (pairs.shape[0] + 7) // 8), np.uint8)
    for n in range(mean.shape[0]):
        for m in range(pairs.shape[0]):
            found[n, m >> 3] |= np.uint8(mean[n, pairs[m, 0]] > mean[n, pairs[m, 1]]) << np.uint8(m & 7)
    return found
