"""Numba twins of levels and corners: images are flat arrays of bytes in rows, with their width.

FAST has no branches, so that it becomes vector code: the image is copied in strips whose rows lie a fixed
number of bytes apart, each pixel walks around its circle counting, and 32 of them do so at once.
"""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import kernel, njit

CIRCLE_X = np.array([0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1])
CIRCLE_Y = np.array([3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3])
BORDER, HALF = 3, 3
TILE, PITCH = 128, 144  # columns that are asked together; bytes from row to row of a strip
LANES = 64  # corners that are scored together
C = BORDER * PITCH + BORDER
P = tuple(int(C + y * PITCH + x) for x, y in zip(CIRCLE_X, CIRCLE_Y, strict=True))

BYTES = types.Array(types.uint8, 1, "C", readonly=True)
PIXELS = types.Array(types.int32, 2, "C", readonly=True)
NEW_BYTES = types.Array(types.uint8, 1, "C")
NEW_PIXELS = types.Array(types.int32, 2, "C")
NEW_INTEGERS = types.Array(types.int64, 1, "C")
NUMBERS = types.Array(types.float64, 1, "C")


@kernel(BYTES, types.int64, returns=NEW_BYTES)
def halve(flat, width):
    """Twin of :func:`vslam_ref.features.levels._halve`."""
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
    """Twin of :func:`vslam_ref.features.fast._segment_test`."""
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


@njit(cache=True)
def _least_of_two(rows, step, count, out):
    """Row k of ``out`` is the smaller of rows k and k + step, number by number."""
    low, high, into = rows[: count * LANES], rows[step * LANES : (step + count) * LANES], out[: count * LANES]
    for x in range(count * LANES):
        into[x] = min(low[x], high[x])


@njit(cache=True)
def _brightest_arc(circle, arc, two, four, best):
    """Largest minimum of ``arc`` of 16 rows one after the other; the circle has them twice: arcs run on."""
    _least_of_two(circle, 1, 31, two)
    _least_of_two(two, 2, 29, four)
    _least_of_two(four, 4, 25, two)
    _least_of_two(two, arc - 8, 16, four)
    best[:] = 0
    for k in range(16):
        row = four[k * LANES : (k + 1) * LANES]
        for x in range(LANES):
            best[x] = max(best[x], row[x])


@kernel(BYTES, types.int64, PIXELS, types.int64, returns=NEW_INTEGERS)
def corner_score(flat, width, xy, arc):
    """Twin of :func:`vslam_ref.features.fast._corner_score`: many corners at a time, a row for each of 16."""
    offsets, size = CIRCLE_X + CIRCLE_Y * width, 32 * LANES
    score = np.empty(xy.shape[0], np.int64)
    bright, dark = np.zeros(size, np.uint8), np.empty(size, np.uint8)
    two, four = np.empty(size, np.uint8), np.empty(size, np.uint8)
    most, least = np.empty(LANES, np.uint8), np.empty(LANES, np.uint8)
    for first in range(0, xy.shape[0], LANES):
        count = min(LANES, xy.shape[0] - first)
        for x in range(count):
            at = np.int64(xy[first + x, 1]) * width + xy[first + x, 0]
            for k in range(16):
                bright[k * LANES + x] = flat[at + offsets[k]]
        bright[16 * LANES :] = bright[: 16 * LANES]
        for x in range(size):
            dark[x] = np.uint8(255 - bright[x])
        _brightest_arc(bright, arc, two, four, most)
        _brightest_arc(dark, arc, two, four, least)
        for x in range(count):
            centre = np.int64(flat[np.int64(xy[first + x, 1]) * width + xy[first + x, 0]])
            brighter, darker = np.int64(most[x]) - centre, np.int64(least[x]) + centre - 255
            score[first + x] = max(brighter, darker, np.int64(0)) - np.int64(1)
    return score


@kernel(
    PIXELS,
    types.Array(types.int64, 1, "A", readonly=True),
    types.int64,
    types.Array(types.int64, 1, "A", readonly=True),
    returns=types.Array(types.bool_, 1, "C"),
)
def is_peak(xy, row_start, width, score):
    """Twin of :func:`vslam_ref.features.corners._is_peak`: a map of the scores, with a border of -1."""
    pitch = width + 2
    scores = np.full((row_start.shape[0] + 1) * pitch, -1, np.int16)
    for c in range(xy.shape[0]):
        scores[(np.int64(xy[c, 1]) + 1) * pitch + xy[c, 0] + 1] = score[c]
    peak = np.empty(xy.shape[0], np.bool_)
    for c in range(xy.shape[0]):
        at = (np.int64(xy[c, 1]) + 1) * pitch + xy[c, 0] + 1
        most = max(scores[at - 1], scores[at + 1])
        for row in (at - pitch, at + pitch):
            most = max(most, max(scores[row], max(scores[row - 1], scores[row + 1])))
        peak[c] = scores[at] > most
    return peak


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
