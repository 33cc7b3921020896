"""Numba twins of the image features: images are flat arrays of bytes in rows, with their width.

FAST has no branches, so that it becomes vector code: the image is copied in strips whose rows lie a fixed
number of bytes apart, each pixel walks around its circle counting, and 32 of them do so at once.
"""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

CIRCLE_X = np.array([0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1])
CIRCLE_Y = np.array([3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3])
BORDER, HALF = 3, 3
TILE, PITCH = 128, 144  # columns that are asked together; bytes from row to row of a strip
C = BORDER * PITCH + BORDER
P = tuple(int(C + y * PITCH + x) for x, y in zip(CIRCLE_X, CIRCLE_Y, strict=True))
BEFORE, AFTER, SIDE, AREA = 4, 3, 8, 64
INNER, LEAST_SLOPE, FARTHEST, STEPS, NEAR = 6, 1.0 / 24.0, 4.0, 10, 0.01
OK, FLAT, OUTSIDE, ASTRAY, SLOW = 0, 1, 2, 3, 4

BYTES = types.Array(types.uint8, 1, "C", readonly=True)
PIXELS = types.Array(types.int32, 2, "C", readonly=True)
PATCHES = types.Array(types.uint8, 2, "C", readonly=True)
NEW_BYTES = types.Array(types.uint8, 1, "C")
NEW_PIXELS = types.Array(types.int32, 2, "C")
NEW_INTEGERS = types.Array(types.int64, 1, "C")
NUMBERS = types.Array(types.float64, 1, "C")
NEW_PATCHES = types.Array(types.uint8, 2, "C")


@kernel(BYTES, types.int64, returns=NEW_BYTES)
def halve(flat, width):
    """Twin of :func:`vslam_ref.features.pyramid._halve`."""
    rows, columns = flat.shape[0] // width // 2, width // 2
    mean = np.empty(rows * columns, np.uint8)
    for y in range(rows):
        top = flat[2 * y * width : (2 * y + 1) * width]
        low = flat[(2 * y + 1) * width : (2 * y + 2) * width]
        out = mean[y * columns : (y + 1) * columns]
        for x in range(columns):
            total = np.uint16(top[2 * x]) + top[2 * x + 1] + low[2 * x] + low[2 * x + 1]
            out[x] = np.uint8((total + 2) >> 2)
    return mean


@njit(cache=True)
def _four(a, b, c, d, above, below, run, best):
    """Go on by four pixels: run = how many in a row are bright, and dark, so far; best = the longest run."""
    bright, dark = run
    for p in (a, b, c, d):
        bright = np.uint8(bright + 1) if p > above else np.uint8(0)
        dark = np.uint8(dark + 1) if p < below else np.uint8(0)
        best = max(best, max(bright, dark))
    return (bright, dark), best


@njit(cache=True)
def _tile(rows, threshold, arc, corner):
    """Ask ``TILE`` pixels of the fourth of seven rows; once around the circle and three quarters more."""
    most, least = np.uint8(255 - threshold), np.uint8(threshold)
    for x in range(TILE):
        centre = rows[x + C]
        above, below = np.uint8(min(centre, most) + least), np.uint8(max(centre, least) - least)
        p0, p1, p2, p3 = rows[x + P[0]], rows[x + P[1]], rows[x + P[2]], rows[x + P[3]]
        p4, p5, p6, p7 = rows[x + P[4]], rows[x + P[5]], rows[x + P[6]], rows[x + P[7]]
        p8, p9, p10, p11 = rows[x + P[8]], rows[x + P[9]], rows[x + P[10]], rows[x + P[11]]
        p12, p13, p14, p15 = rows[x + P[12]], rows[x + P[13]], rows[x + P[14]], rows[x + P[15]]
        run, best = (np.uint8(0), np.uint8(0)), np.uint8(0)
        run, best = _four(p0, p1, p2, p3, above, below, run, best)
        run, best = _four(p4, p5, p6, p7, above, below, run, best)
        run, best = _four(p8, p9, p10, p11, above, below, run, best)
        run, best = _four(p12, p13, p14, p15, above, below, run, best)
        run, best = _four(p0, p1, p2, p3, above, below, run, best)
        run, best = _four(p4, p5, p6, p7, above, below, run, best)
        run, best = _four(p8, p9, p10, p11, above, below, run, best)
        corner[x] = best >= arc


@kernel(BYTES, types.int64, types.int64, types.int64, returns=NEW_PIXELS)
def segment_test(flat, width, threshold, arc):
    """Twin of :func:`vslam_ref.features.segment_test._segment_test`."""
    height, columns = flat.shape[0] // width, width - 2 * BORDER
    tiles = (columns + TILE - 1) // TILE
    corner = np.zeros((height, tiles * TILE), np.bool_)
    strip = np.zeros(height * PITCH, np.uint8)
    for left in range(0, columns, TILE):
        n = min(TILE + 2 * BORDER, width - left)
        for y in range(height):
            strip[y * PITCH : y * PITCH + n] = flat[y * width + left : y * width + left + n]
        for y in range(BORDER, height - BORDER):
            rows = strip[(y - BORDER) * PITCH : (y + BORDER + 1) * PITCH]
            _tile(rows, threshold, arc, corner[y, left : left + TILE])
    return _where(corner, columns)


@njit(cache=True)
def _where(corner, columns):
    """Pixels (n, 2) that are marked, eight at a time where none is."""
    found = np.empty((corner.size, 2), np.int32)
    n = 0
    for y in range(corner.shape[0]):
        row = corner[y]
        words = row.view(np.uint64)
        for w in range(words.shape[0]):
            if words[w] == 0:
                continue
            for x in range(8 * w, min(8 * w + 8, columns)):
                if row[x]:
                    found[n, 0], found[n, 1] = x + BORDER, y
                    n += 1
    return found[:n].copy()


@kernel(BYTES, types.int64, PIXELS, types.int64, returns=NEW_INTEGERS)
def corner_score(flat, width, xy, arc):
    """Twin of :func:`vslam_ref.features.segment_test._corner_score`."""
    offsets = CIRCLE_X + CIRCLE_Y * width
    score = np.empty(xy.shape[0], np.int64)
    brighter = np.empty(32, np.int64)
    for n in range(xy.shape[0]):
        at = np.int64(xy[n, 1]) * width + xy[n, 0]
        for k in range(16):
            brighter[k] = np.int64(flat[at + offsets[k]]) - np.int64(flat[at])
            brighter[k + 16] = brighter[k]
        best = 0
        for k in range(16):
            least, most = brighter[k], brighter[k]
            for j in range(1, arc):
                least, most = min(least, brighter[k + j]), max(most, brighter[k + j])
            best = max(best, least, -most)
        score[n] = best - 1
    return score


@kernel(BYTES, types.int64, PIXELS, returns=NUMBERS)
def shi_tomasi(flat, width, xy):
    """Twin of :func:`vslam_ref.features.corners._shi_tomasi`."""
    smaller = np.empty(xy.shape[0])
    for n in range(xy.shape[0]):
        a = b = c = np.int64(0)
        for j in range(xy[n, 1] - HALF, xy[n, 1] + HALF + 1):
            for i in range(xy[n, 0] - HALF, xy[n, 0] + HALF + 1):
                at = j * width + i
                gx = np.int64(flat[at + 1]) - np.int64(flat[at - 1])
                gy = np.int64(flat[at + width]) - np.int64(flat[at - width])
                a, b, c = a + gx * gx, b + gx * gy, c + gy * gy
        root = np.sqrt(np.float64((a - c) * (a - c) + 4 * b * b))
        smaller[n] = max((a + c - root) / (8 * (2 * HALF + 1) ** 2), 0.0)
    return smaller


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
    """Twin of :func:`vslam_ref.features.search._search`."""
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
    mx, my = gx.mean(), gy.mean()
    a = b = c = 0.0
    for k in range(INNER * INNER):
        gx[k], gy[k] = gx[k] - mx, gy[k] - my
        a, b, c = a + gx[k] * gx[k], b + gx[k] * gy[k], c + gy[k] * gy[k]
    return a, b, c


@njit(cache=True)
def _one_step(flat, width, height, u, v, T, gx, gy):
    """(inside, offset, sum of gx r, sum of gy r) at a place."""
    low, high = 1 - BEFORE, INNER - BEFORE
    if not (u + low >= 0 and u + high <= width - 1 and v + low >= 0 and v + high <= height - 1):
        return False, 0.0, 0.0, 0.0
    total = p = q = 0.0
    for k in range(INNER * INNER):
        r = T[k] - _bilinear(flat, width, height, u + (k % INNER + low), v + (k // INNER + low))
        total, p, q = total + r, p + gx[k] * r, q + gy[k] * r
    return True, -total / (INNER * INNER), p, q


@kernel(
    BYTES,
    types.int64,
    PATCHES,
    given(2),
    returns=types.Tuple((types.Array(types.float64, 2, "C"), NUMBERS, types.Array(types.int8, 1, "C"))),
)
def refine(flat, width, patch, uv):
    """Twin of :func:`vslam_ref.features.refine._refine`."""
    height = flat.shape[0] // width
    place, offset, state = uv.copy(), np.zeros(uv.shape[0]), np.full(uv.shape[0], SLOW, np.int8)
    T, gx, gy = np.empty(INNER * INNER), np.empty(INNER * INNER), np.empty(INNER * INNER)
    for n in range(uv.shape[0]):
        a, b, c = _slopes(patch[n], T, gx, gy)
        if (a + c - np.sqrt((a - c) ** 2 + 4 * b * b)) / 2 <= LEAST_SLOPE * INNER * INNER:
            state[n] = FLAT
            continue
        det = a * c - b * b
        for _ in range(STEPS):
            inside, shift, p, q = _one_step(flat, width, height, place[n, 0], place[n, 1], T, gx, gy)
            if not inside:
                state[n] = OUTSIDE
                break
            offset[n] = shift
            du, dv = (c * p - b * q) / det, (a * q - b * p) / det
            place[n, 0] += du
            place[n, 1] += dv
            if np.hypot(place[n, 0] - uv[n, 0], place[n, 1] - uv[n, 1]) > FARTHEST:
                state[n] = ASTRAY
                break
            if np.hypot(du, dv) < NEAR:
                state[n] = OK
                break
    return place, offset, state
