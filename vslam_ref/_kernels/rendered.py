"""Numba twins of the renderer: one pass over the pixels that may see a quad, one over all to paint them."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

NEAR, BACKGROUND, PROBES = 0.01, 96.0, 4


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
    candidate = np.empty(homography.shape[0], np.int64)
    count, u, v = 0, np.int64(-1), np.int64(-1)
    for n in range(xn.shape[0]):
        if n == 0 or column[n] != u or row[n] != v:  # rays of one pixel come one after the other
            count, u, v = 0, column[n], row[n]
            for q in range(homography.shape[0]):
                if box[q, 0] <= u and u < box[q, 1] and box[q, 2] <= v and v < box[q, 3]:
                    candidate[count] = q
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
def _footprint(p_u, p_v, q_u, q_v, most):
    """Level, probes and the longer side (2,) of a patch."""
    p, r, q = p_u * p_u + p_v * p_v, q_u * q_u + q_v * q_v, p_u * q_u + p_v * q_v
    long2 = 0.5 * (p + r + np.sqrt((p - r) * (p - r) + 4.0 * q * q))
    if long2 <= 1.0:
        return 0.0, 1, 0.0, 0.0
    long = np.sqrt(long2)
    determinant = abs(p_u * q_v - p_v * q_u)
    short = determinant / long
    probes = np.int64(min(max(np.floor(long / max(short, 1e-12) + 0.5), 1.0), np.float64(PROBES)))
    side = max(long / probes, short)
    level = min(np.log2(side), most - 1.0) if side > 1.0 else 0.0
    if probes == 1:
        return level, 1, 0.0, 0.0
    x, y = (long2 - r, q) if p >= r else (q, long2 - p)
    scale = long / np.sqrt(x * x + y * y)
    return level, probes, x * scale, y * scale


@njit(cache=True, error_model="numpy")
def _sample(texels, table, level, probes, a, b, long_a, long_b):
    """Grey value of a texture between two levels, summed over probes along the patch's longer side."""
    low, total = np.int64(level), 0.0
    share, scale = level - low, 1.0 / np.float64(1 << low)
    begin, height, width = table[low, 0], table[low, 1], table[low, 2]
    up = min(low + 1, table.shape[0] - 1)
    begin_up, height_up, width_up, scale_up = table[up, 0], table[up, 1], table[up, 2], 0.5 * scale
    for k in range(probes):
        shift = (k + 0.5) / probes - 0.5
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
    most = table.shape[1]
    for n in range(xn.shape[0]):
        q = quad[n]
        if q < 0:
            continue
        x, y, t = xn[n, 0], xn[n, 1], texture[q]
        h20, h21 = homography[q, 2, 0], homography[q, 2, 1]
        w = h20 * x + h21 * y + homography[q, 2, 2]
        z = 1.0 / w
        a = (homography[q, 0, 0] * x + homography[q, 0, 1] * y + homography[q, 0, 2]) * z
        b = (homography[q, 1, 0] * x + homography[q, 1, 1] * y + homography[q, 1, 2]) * z
        a_x, a_y = (homography[q, 0, 0] - a * h20) * z, (homography[q, 0, 1] - a * h21) * z
        b_x, b_y = (homography[q, 1, 0] - b * h20) * z, (homography[q, 1, 1] - b * h21) * z
        x_u, x_v, y_u, y_v = spread[n, 0, 0], spread[n, 0, 1], spread[n, 1, 0], spread[n, 1, 1]
        p_u, p_v = a_x * x_u + a_y * y_u, a_x * x_v + a_y * y_v
        q_u, q_v = b_x * x_u + b_y * y_u, b_x * x_v + b_y * y_v
        level, probes, long_a, long_b = _footprint(p_u, p_v, q_u, q_v, most)
        total = _sample(texels, table[t], level, probes, a, b, long_a, long_b)
        grey[n] = light[q] * total / probes
    return grey
