"""Numba twins of the renderer: one pass over the pixels that may see a quad, one over all to paint them.

Painting goes by chunks of rays: what is the same arithmetic for all of them runs in vectors, and only the
look-ups in the textures ray by ray.
"""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

NEAR, BACKGROUND, PROBES = 0.01, 96.0, 4
CHUNK = 128
"""Rays that are painted together: their numbers stay in the innermost cache."""
X, Y, X_U, X_V, Y_U, Y_V, H = range(7)
A, B, P_U, P_V, Q_U, Q_V, N, SIDE, LONG_A, LONG_B, LOW, SHARE = range(15, 27)
NUMBERS = 27
"""Of each ray: rows of the chunk's table.  H is the first of the homography's nine."""
SHIFTS = (np.arange(PROBES) + 0.5) / np.maximum(np.arange(PROBES + 1), 1)[:, None] - 0.5
"""Where probe k of so many lies along the longer side, -1/2 to 1/2."""


def _read(dtype, ndim):
    return types.Array(dtype, ndim, "C", readonly=True)


NUMBERS1, NUMBERS2, NUMBERS3 = (_read(types.float64, n) for n in (1, 2, 3))
INTEGERS1, INTEGERS2, INTEGERS3 = (_read(types.int64, n) for n in (1, 2, 3))
QUADS, BYTES = _read(types.int32, 1), _read(types.uint8, 1)


def _pair(ndim):
    return types.Tuple((types.Array(types.int32, ndim, "C"), types.Array(types.float64, ndim, "C")))


@kernel(given(3), NUMBERS3, NUMBERS2, INTEGERS2, returns=_pair(2))
def nearest(xn, homography, extent, box):
    """Twin of :func:`vslam_ref.worlds.rendered.raster.nearest`."""
    quad = np.full(xn.shape[:2], -1, np.int32)
    inverse_depth = np.zeros(xn.shape[:2])
    for q in range(homography.shape[0]):
        H, a_most, b_most = homography[q], extent[q, 0], extent[q, 1]
        for v in range(box[q, 2], box[q, 3]):
            for u in range(box[q, 0], box[q, 1]):
                x, y = xn[v, u, 0], xn[v, u, 1]
                w = H[2, 0] * x + H[2, 1] * y + H[2, 2]
                if w > inverse_depth[v, u] and w < 1 / NEAR:
                    a = H[0, 0] * x + H[0, 1] * y + H[0, 2]
                    b = H[1, 0] * x + H[1, 1] * y + H[1, 2]
                    if a >= 0 and a <= a_most * w and b >= 0 and b <= b_most * w:
                        inverse_depth[v, u] = w
                        quad[v, u] = q
    return quad, inverse_depth


@kernel(given(2), INTEGERS1, INTEGERS1, NUMBERS3, NUMBERS2, INTEGERS2, returns=_pair(1))
def nearest_of(xn, column, row, homography, extent, box):
    """Twin of :func:`vslam_ref.worlds.rendered.raster.nearest_of`."""
    quad = np.full(xn.shape[0], -1, np.int32)
    inverse_depth = np.zeros(xn.shape[0])
    on_row, candidate = np.empty((2, homography.shape[0]), np.int64)
    rows, count, u, v = 0, 0, np.int64(-1), np.int64(-1)
    for n in range(xn.shape[0]):
        if n == 0 or row[n] != v:  # rays of one row, and of one pixel, come one after the other
            rows, u, v = 0, np.int64(-1), row[n]
            for q in range(homography.shape[0]):
                if box[q, 2] <= v and v < box[q, 3]:
                    on_row[rows] = q
                    rows += 1
        if n == 0 or column[n] != u:
            count, u = 0, column[n]
            for k in range(rows):
                if box[on_row[k], 0] <= u and u < box[on_row[k], 1]:
                    candidate[count] = on_row[k]
                    count += 1
        x, y = xn[n, 0], xn[n, 1]
        for k in range(count):
            q = candidate[k]
            w = homography[q, 2, 0] * x + homography[q, 2, 1] * y + homography[q, 2, 2]
            a = homography[q, 0, 0] * x + homography[q, 0, 1] * y + homography[q, 0, 2]
            b = homography[q, 1, 0] * x + homography[q, 1, 1] * y + homography[q, 1, 2]
            inside = a >= 0 and a <= extent[q, 0] * w and b >= 0 and b <= extent[q, 1] * w
            if inside and w > inverse_depth[n] and w < 1 / NEAR:
                inverse_depth[n] = w
                quad[n] = q
    return quad, inverse_depth


@njit(cache=True, error_model="numpy")
def _bilinear(texels, begin, height, width, u, v):
    """Grey value at column u and row v, texels, of a level that begins there; the nearest one outside."""
    u = min(max(u, 0.0), width - 1.0)
    v = min(max(v, 0.0), height - 1.0)
    left, top = np.int64(u), np.int64(v)
    u, v = u - left, v - top
    row = np.uint64(begin + top * width + left)  # unsigned: never counted from the end
    right = np.uint64(left + 1 < width)
    down = np.uint64(width if top + 1 < height else 0)
    p, q = np.float64(texels[row]), np.float64(texels[row + right])
    r, s = np.float64(texels[row + down]), np.float64(texels[row + down + right])
    upper = p + u * (q - p)
    return upper + v * (r + u * (s - r) - upper)


@njit(cache=True, error_model="numpy")
def _gather(xn, spread, quad, homography, first, count, of):
    """Rays, their derivatives and homographies of a chunk, a row of ``of`` for each number."""
    for i in range(count):
        n = first + i
        of[X, i], of[Y, i] = xn[n, 0], xn[n, 1]
        of[X_U, i], of[X_V, i] = spread[n, 0, 0], spread[n, 0, 1]
        of[Y_U, i], of[Y_V, i] = spread[n, 1, 0], spread[n, 1, 1]
    begin = 0
    while begin < count:  # neighbours mostly see the same quad
        q, end = quad[first + begin], begin + 1
        while end < count and quad[first + end] == q:
            end += 1
        for j in range(9):
            h = homography[max(q, 0), j // 3, j % 3]
            for i in range(begin, end):
                of[H + j, i] = h
        begin = end


@njit(cache=True, error_model="numpy")
def _on_surface(of):
    """Texels that rays meet, and their derivatives in the pixel."""
    for i in range(CHUNK):  # no branch, so that it runs in vectors; what is not asked for is not used
        x, y, h20, h21 = of[X, i], of[Y, i], of[H + 6, i], of[H + 7, i]
        z = 1.0 / (h20 * x + h21 * y + of[H + 8, i])
        a = (of[H, i] * x + of[H + 1, i] * y + of[H + 2, i]) * z
        b = (of[H + 3, i] * x + of[H + 4, i] * y + of[H + 5, i]) * z
        a_x, a_y = (of[H, i] - a * h20) * z, (of[H + 1, i] - a * h21) * z
        b_x, b_y = (of[H + 3, i] - b * h20) * z, (of[H + 4, i] - b * h21) * z
        x_u, x_v, y_u, y_v = of[X_U, i], of[X_V, i], of[Y_U, i], of[Y_V, i]
        of[A, i], of[B, i] = a, b
        of[P_U, i], of[P_V, i] = a_x * x_u + a_y * y_u, a_x * x_v + a_y * y_v
        of[Q_U, i], of[Q_V, i] = b_x * x_u + b_y * y_u, b_x * x_v + b_y * y_v


@njit(cache=True, error_model="numpy")
def _footprints(of):
    """Probes, the longer side, and the side that chooses the level, of patches."""
    for i in range(CHUNK):
        p_u, p_v, q_u, q_v = of[P_U, i], of[P_V, i], of[Q_U, i], of[Q_V, i]
        p, r, q = p_u * p_u + p_v * p_v, q_u * q_u + q_v * q_v, p_u * q_u + p_v * q_v
        long2 = 0.5 * (p + r + np.sqrt((p - r) * (p - r) + 4.0 * q * q))
        large = long2 > 1.0
        long = np.sqrt(long2)
        short = abs(p_u * q_v - p_v * q_u) / long
        probes = min(max(np.floor(long / max(short, 1e-12) + 0.5), 1.0), np.float64(PROBES))
        probes = probes if large else 1.0
        side = max(long / probes, short)
        x, y = long2 - r if p >= r else q, q if p >= r else long2 - p
        scale = long / np.sqrt(x * x + y * y)
        several = probes > 1.0
        of[N, i], of[SIDE, i] = probes, max(side if large else 1.0, 1.0)
        of[LONG_A, i], of[LONG_B, i] = x * scale if several else 0.0, y * scale if several else 0.0


@njit(cache=True, error_model="numpy")
def _levels(of, bits):
    """Whole part and rest of log2 of the side: its exponent, and a series of its mantissa.

    log2 m = 2 / ln 2 (s + s^3 / 3 + ...) with s = (m - 1) / (m + 1); for m from 0.7 to 1.41, s is below
    0.172, and what follows s^21 / 21 below 2e-18.
    """
    for i in range(CHUNK):
        side = bits[SIDE, i]
        bits[LOW, i] = (side >> np.int64(52)) - np.int64(1023)
        bits[SIDE, i] = (side & np.int64(0xFFFFFFFFFFFFF)) | np.int64(0x3FF0000000000000)
    for i in range(CHUNK):
        upper = of[SIDE, i] > 1.4142135623730951
        m = 0.5 * of[SIDE, i] if upper else of[SIDE, i]
        s = (m - 1.0) / (m + 1.0)
        t = s * s
        series = ((((t / 21 + 1 / 19) * t + 1 / 17) * t + 1 / 15) * t + 1 / 13) * t + 1 / 11
        series = ((((series * t + 1 / 9) * t + 1 / 7) * t + 1 / 5) * t + 1 / 3) * t * s + s
        of[SHARE, i] = 2.8853900817779268 * series + (1.0 if upper else 0.0)


@njit(cache=True, error_model="numpy")
def _sample(texels, table, low, share, probes, a, b, long_a, long_b):
    """Grey value of a texture between two levels, summed over probes along the patch's longer side."""
    total, scale = 0.0, 1.0 / np.float64(1 << low)
    begin, height, width = table[low, 0], table[low, 1], table[low, 2]
    up = min(low + 1, table.shape[0] - 1)
    begin_up, height_up, width_up, scale_up = table[up, 0], table[up, 1], table[up, 2], 0.5 * scale
    for k in range(probes):
        shift = SHIFTS[probes, k]
        x, y = a + shift * long_a, b + shift * long_b
        fine = _bilinear(texels, begin, height, width, x * scale - 0.5, y * scale - 0.5)
        if share > 0.0:
            u, v = x * scale_up - 0.5, y * scale_up - 0.5
            fine += share * (_bilinear(texels, begin_up, height_up, width_up, u, v) - fine)
        total += fine
    return total


@kernel(given(2), NUMBERS3, QUADS, NUMBERS3, INTEGERS1, NUMBERS1, BYTES, INTEGERS3,
        returns=types.Array(types.float64, 1, "C"), error_model="numpy")  # fmt: skip
def shade(xn, spread, quad, homography, texture, light, texels, table):
    """Twin of :func:`vslam_ref.worlds.rendered.raster.shade`."""
    grey = np.full(xn.shape[0], BACKGROUND)
    of = np.ones((NUMBERS, CHUNK))
    bits, top = of.view(np.int64), table.shape[1] - 1
    for first in range(0, xn.shape[0], CHUNK):
        count = min(CHUNK, xn.shape[0] - first)
        if (quad[first : first + count] < 0).all():
            continue
        _gather(xn, spread, quad, homography, first, count, of)
        _on_surface(of)
        _footprints(of)
        _levels(of, bits)
        for i in range(count):
            q = quad[first + i]
            if q < 0:
                continue
            low, share = (bits[LOW, i], of[SHARE, i]) if bits[LOW, i] < top else (top, 0.0)
            levels, probes = table[texture[q]], np.int64(of[N, i])
            total = _sample(
                texels, levels, low, share, probes, of[A, i], of[B, i], of[LONG_A, i], of[LONG_B, i]
            )
            grey[first + i] = light[q] * total / probes
    return grey
