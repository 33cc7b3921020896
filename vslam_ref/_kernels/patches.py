"""Numba twins of patches: read through a map, compared with corners, and moved between the pixels."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit
from vslam_ref._kernels.features import BYTES, NEW_INTEGERS, NUMBERS, PIXELS

BEFORE, AFTER, SIDE, AREA = 4, 3, 8, 64
INNER, LEAST_SLOPE, FARTHEST, STEPS, NEAR = 6, 1.0 / 24.0, 4.0, 10, 0.01
OK, FLAT, OUTSIDE, ASTRAY, SLOW = 0, 1, 2, 3, 4
ROOM = AREA + 2 * SIDE  # grey levels of a patch, and how far its columns and rows lie between pixels

PATCHES = types.Array(types.uint8, 2, "C", readonly=True)
NEW_PATCHES = types.Array(types.uint8, 2, "C")


@njit(cache=True)
def _bilinear(flat, width, height, x, y):
    i, j = min(int(y), height - 2), min(int(x), width - 2)
    fx, fy = x - j, y - i
    at = i * width + j
    a, b = np.float64(flat[at]), np.float64(flat[at + 1])
    c, d = np.float64(flat[at + width]), np.float64(flat[at + width + 1])
    top, bottom = a + fx * (b - a), c + fx * (d - c)
    return top + fy * (bottom - top)


@kernel(
    BYTES,
    types.int64,
    given(2),
    given(3),
    returns=types.Tuple((NEW_PATCHES, types.Array(types.bool_, 1, "C"))),
)
def warp(flat, width, uv, M):
    """Twin of :func:`vslam_ref.features.templates._warp`."""
    height = flat.shape[0] // width
    patch = np.zeros((uv.shape[0], AREA), np.uint8)
    inside = np.empty(uv.shape[0], np.bool_)
    for n in range(uv.shape[0]):
        inside[n] = _inside(uv[n], M[n], width, height)
        if not inside[n]:
            continue
        for k in range(AREA):
            dx, dy = k % SIDE - BEFORE, k // SIDE - BEFORE
            x = uv[n, 0] + (M[n, 0, 0] * dx + M[n, 0, 1] * dy)
            y = uv[n, 1] + (M[n, 1, 0] * dx + M[n, 1, 1] * dy)
            patch[n, k] = np.uint8(np.floor(_bilinear(flat, width, height, x, y) + 0.5))
    return patch, inside


@njit(cache=True)
def _inside(uv, M, width, height):
    """Whether the four outermost pixels of a patch lie in the image, so all between them do."""
    for dx in (-BEFORE, AFTER):
        for dy in (-BEFORE, AFTER):
            x, y = uv[0] + (M[0, 0] * dx + M[0, 1] * dy), uv[1] + (M[1, 0] * dx + M[1, 1] * dy)
            if not (x >= 0 and x <= width - 1 and y >= 0 and y <= height - 1):
                return False
    return True


@njit(cache=True)
def _first(xy, low, high, x):
    """First corner of a row, from ``low`` to ``high``, that is not left of x."""
    while low < high:
        middle = (low + high) // 2
        if xy[middle, 0] < x:
            low = middle + 1
        else:
            high = middle
    return low


@njit(cache=True)
def _sums(flat, width, at):
    """Sum and sum of squares of the patch around a pixel."""
    total = square = np.int32(0)
    for j in range(SIDE):
        row = flat[at + (j - BEFORE) * width - BEFORE : at + (j - BEFORE) * width + AFTER + 1]
        for i in range(SIDE):
            v = np.int32(row[i])
            total, square = np.int32(total + v), np.int32(square + v * v)
    return np.int64(total), np.int64(square)


@njit(cache=True)
def _cross(template, flat, width, at):
    """Sum of the products of a template and the patch around a pixel."""
    total = np.int32(0)
    for j in range(SIDE):
        first = np.uint64(at + (j - BEFORE) * width - BEFORE)  # unsigned: never counted from the end
        for i in range(SIDE):
            level = np.int32(flat[first + np.uint64(i)])
            total = np.int32(total + level * np.int32(template[np.uint64(j * SIDE + i)]))
    return np.int64(total)


@njit(cache=True)
def _cost(cross, a, aa, b, bb, correlate):
    """ZMSSD or 1 - ZNCC from the five sums."""
    if not correlate:
        return (AREA * (aa + bb - 2 * cross) - (a - b) * (a - b)) / AREA
    size = np.sqrt(np.float64(AREA * aa - a * a) * np.float64(AREA * bb - b * b))
    if size == 0.0:
        return 1.0
    return 1.0 - np.float64(AREA * cross - a * b) / size


@njit(cache=True)
def _corner_sums(flat, width, xy):
    """Sums of the patches of all corners, and whether they are whole."""
    height = flat.shape[0] // width
    sums = np.empty((xy.shape[0], 2), np.int64)
    for c in range(xy.shape[0]):
        x, y = np.int64(xy[c, 0]), np.int64(xy[c, 1])
        whole = x >= BEFORE and y >= BEFORE and x < width - AFTER and y < height - AFTER
        sums[c, 0], sums[c, 1] = _sums(flat, width, y * width + x) if whole else (np.int64(-1), np.int64(0))
    return sums


@kernel(
    BYTES,
    types.int64,
    PIXELS,
    given(1, types.int64),
    PATCHES,
    given(2),
    given(1),
    types.boolean,
    returns=types.Tuple((NEW_INTEGERS, NUMBERS)),
)
def search(flat, width, xy, row_start, patch, uv, radius, correlate):
    """Twin of :func:`vslam_ref.features.patch_search._search`."""
    height, sums = row_start.shape[0] - 1, _corner_sums(flat, width, xy)
    index, cost = np.full(uv.shape[0], -1), np.full(uv.shape[0], np.inf)
    for n in range(uv.shape[0]):
        u, v, r = uv[n, 0], uv[n, 1], radius[n]
        template = patch[n]
        a, aa = _sums(template, SIDE, BEFORE * SIDE + BEFORE)
        middle, most = int(np.rint(v)), int(np.ceil(r))
        for y in range(max(middle - most, 0), min(middle + most + 1, height)):
            square = r * r - (y - v) * (y - v)
            if square < 0.0:
                continue
            half = np.sqrt(square)
            first = _first(xy, row_start[y], row_start[y + 1], np.ceil(u - half))
            for c in range(first, row_start[y + 1]):
                if xy[c, 0] > u + half:
                    break
                if sums[c, 0] < 0:
                    continue
                cross = _cross(template, flat, width, y * width + xy[c, 0])
                this = _cost(cross, a, aa, sums[c, 0], sums[c, 1], correlate)
                if this < cost[n]:
                    index[n], cost[n] = c, this
    return index, cost


@njit(cache=True)
def _slopes(template, T, gx, gy):
    """Inner pixels of a template and their slopes without mean; (a, b, c) of S = [[a, b], [b, c]]."""
    for k in range(INNER * INNER):
        at = (k // INNER + 1) * SIDE + k % INNER + 1
        T[k] = template[at]
        gx[k] = (np.float64(template[at + 1]) - np.float64(template[at - 1])) / 2
        gy[k] = (np.float64(template[at + SIDE]) - np.float64(template[at - SIDE])) / 2
    mx, my = gx[: INNER * INNER].mean(), gy[: INNER * INNER].mean()
    a = b = c = 0.0
    for k in range(INNER * INNER):
        gx[k], gy[k] = gx[k] - mx, gy[k] - my
        a, b, c = a + gx[k] * gx[k], b + gx[k] * gy[k], c + gy[k] * gy[k]
    return a, b, c


@njit(cache=True)
def _read(flat, width, height, u, v, low, n, out):
    """Grey levels at n x n places from (u + low, v + low) on, one pixel apart, all inside.

    What is interpolated along a row serves the places above and below it.
    """
    i0, j0, in_steps = int(v + low), int(u + low), True
    for k in range(n):
        x, y = u + (k + low), v + (k + low)
        i, j = min(int(y), height - 2), min(int(x), width - 2)
        in_steps = in_steps and i == i0 + k and j == j0 + k
        out[AREA + k], out[AREA + n + k] = x - j, y - i
    if not in_steps:  # at the far border, or where rounding reaches the next pixel
        for k in range(n * n):
            out[k] = _bilinear(flat, width, height, u + (k % n + low), v + (k // n + low))
        return
    for r in range(n + 1):
        first = np.uint64((i0 + r) * width + j0)  # unsigned: never counted from the end
        for k in range(n):
            a, b = np.float64(flat[first + np.uint64(k)]), np.float64(flat[first + np.uint64(k + 1)])
            below = a + out[AREA + k] * (b - a)
            if r > 0:
                at = (r - 1) * n + k
                out[at] += out[AREA + n + r - 1] * (below - out[at])
            if r < n:
                out[r * n + k] = below


@njit(cache=True)
def _refined(flat, width, height, u, v, T, gx, gy, S, here):
    """Place, offset and state of a template with slopes ``gx``, ``gy`` and S = (a, b, c), from (u, v) on."""
    (a, b, c), x, y, offset = S, u, v, 0.0
    if (a + c - np.sqrt((a - c) ** 2 + 4 * b * b)) / 2 <= LEAST_SLOPE * INNER * INNER:
        return x, y, offset, FLAT
    det = a * c - b * b
    low, high = 1 - BEFORE, INNER - BEFORE
    for _ in range(STEPS):
        if not (x + low >= 0 and x + high <= width - 1 and y + low >= 0 and y + high <= height - 1):
            return x, y, offset, OUTSIDE
        _read(flat, width, height, x, y, low, INNER, here)
        total = p = q = 0.0
        for k in range(INNER * INNER):
            r = T[k] - here[k]
            total, p, q = total + r, p + gx[k] * r, q + gy[k] * r
        offset = -total / (INNER * INNER)
        du, dv = (c * p - b * q) / det, (a * q - b * p) / det
        x, y = x + du, y + dv
        if np.hypot(x - u, y - v) > FARTHEST:
            return x, y, offset, ASTRAY
        if np.hypot(du, dv) < NEAR:
            return x, y, offset, OK
    return x, y, offset, SLOW


@kernel(
    BYTES,
    types.int64,
    PATCHES,
    given(2),
    returns=types.Tuple((types.Array(types.float64, 2, "C"), NUMBERS, types.Array(types.int8, 1, "C"))),
)
def refine(flat, width, patch, uv):
    """Twin of :func:`vslam_ref.features.refinement._refine`."""
    height = flat.shape[0] // width
    place, offset, state = uv.copy(), np.zeros(uv.shape[0]), np.empty(uv.shape[0], np.int8)
    T, gx, gy, here = np.empty(AREA), np.empty(AREA), np.empty(AREA), np.empty(ROOM)
    for n in range(uv.shape[0]):
        S = _slopes(patch[n], T, gx, gy)
        place[n, 0], place[n, 1], offset[n], state[n] = _refined(
            flat, width, height, uv[n, 0], uv[n, 1], T, gx, gy, S, here
        )
    return place, offset, state
