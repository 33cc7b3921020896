"""Numba twins of ORB: octaves, smoothing, moments, descriptors, and the quadtree."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

ONE = 11
RADIUS, REACH = 15, 240  # offsets of the disc: x^2 + y^2 <= 15.5^2 = 240.25
BYTES = types.Array(types.uint8, 1, "C", readonly=True)
IMAGE = types.Array(types.uint8, 2, "C", readonly=True)
NEW_IMAGE = types.Array(types.uint8, 2, "C")
PIXELS = types.Array(types.int32, 2, "C", readonly=True)
INTEGERS = given(1, types.int64)
NEW_INTEGERS = types.Array(types.int64, 1, "C")


@kernel(IMAGE, INTEGERS, INTEGERS, INTEGERS, INTEGERS, returns=NEW_IMAGE)
def resampled(image, y, wy, x, wx):
    """Twin of :func:`vslam_ref.features.orb.scales._resampled`."""
    height, width = y.shape[0], x.shape[0]
    mixed = np.empty((height, width), np.uint8)
    half = np.int32(2 ** (2 * ONE - 1))
    upper, lower = np.empty(width, np.int32), np.empty(width, np.int32)
    held = np.int64(-1)
    for i in range(height):
        if y[i] != held:
            held = y[i]
            _row(image[held], x, wx, upper)
            _row(image[min(held + 1, image.shape[0] - 1)], x, wx, lower)
        low = np.int32(wy[i])
        top = np.int32(2**ONE) - low
        for j in range(width):
            mixed[i, j] = np.uint8((upper[j] * top + lower[j] * low + half) >> (2 * ONE))
    return mixed


@njit(cache=True)
def _row(row, x, wx, out):
    """One row between its pixels."""
    last = row.shape[0] - 1
    for j in range(x.shape[0]):
        w = np.int32(wx[j])
        out[j] = np.int32(row[x[j]]) * (np.int32(2**ONE) - w) + np.int32(row[min(x[j] + 1, last)]) * w


@kernel(IMAGE, returns=NEW_IMAGE)
def smooth(image):
    """Twin of :func:`vslam_ref.features.orb.description._smooth`."""
    height, width = image.shape
    rows = np.empty((height, width), np.uint16)
    line = np.empty(width + 6, np.uint16)
    for y in range(height):
        line[3 : width + 3] = image[y]
        for k in range(3):
            line[2 - k], line[width + 3 + k] = image[y, k + 1], image[y, width - 2 - k]
        out = rows[y]
        for x in range(width):
            ends = np.uint16(line[x] + line[x + 6]) * np.uint16(18)
            next_to = np.uint16(line[x + 1] + line[x + 5]) * np.uint16(34)
            near = np.uint16(line[x + 2] + line[x + 4]) * np.uint16(49)
            out[x] = np.uint16(ends + next_to + near + line[x + 3] * np.uint16(54))
    smoothed = np.empty((height, width), np.uint8)
    for y in range(height):
        out = smoothed[y]
        a, b, c = rows[abs(y - 3)], rows[abs(y - 2)], rows[abs(y - 1)]
        last = height - 1
        e, f, g = (
            rows[last - abs(last - y - 1)],
            rows[last - abs(last - y - 2)],
            rows[last - abs(last - y - 3)],
        )
        d = rows[y]
        for x in range(width):
            total = np.uint32(32768) + (np.uint32(a[x]) + np.uint32(g[x])) * np.uint32(18)
            total += (np.uint32(b[x]) + np.uint32(f[x])) * np.uint32(34)
            total += (np.uint32(c[x]) + np.uint32(e[x])) * np.uint32(49) + np.uint32(d[x]) * np.uint32(54)
            out[x] = np.uint8(total >> 16)
    return smoothed


@kernel(BYTES, types.int64, PIXELS, returns=types.Array(types.int64, 2, "C"))
def moments(flat, width, xy):
    """Twin of :func:`vslam_ref.features.orb.direction._moments`."""
    found = np.zeros((xy.shape[0], 2), np.int64)
    for n in range(xy.shape[0]):
        m10 = m01 = np.int32(0)
        for dy in range(-RADIUS, RADIUS + 1):
            half = int(np.sqrt(REACH - dy * dy))
            half = min(half, RADIUS)
            start = (np.int64(xy[n, 1]) + dy) * width + xy[n, 0] - half
            row = flat[start : start + 2 * half + 1]
            total = across = np.int32(0)
            for k in range(row.shape[0]):
                total += np.int32(row[k])
                across += np.int32(row[k]) * np.int32(k)
            m10 += across - total * np.int32(half)
            m01 += total * np.int32(dy)
        found[n, 0], found[n, 1] = m10, m01
    return found


@kernel(BYTES, types.int64, PIXELS, given(2), given(2, types.int64), returns=NEW_IMAGE)
def describe(flat, width, xy, direction, pairs):
    """Twin of :func:`vslam_ref.features.orb.description._describe`."""
    bits = np.zeros((xy.shape[0], (pairs.shape[0] + 7) // 8), np.uint8)
    for n in range(xy.shape[0]):
        c, s = direction[n, 0], direction[n, 1]
        centre = np.int64(xy[n, 1]) * width + xy[n, 0]
        for m in range(pairs.shape[0]):
            ax, ay, bx, by = pairs[m, 0], pairs[m, 1], pairs[m, 2], pairs[m, 3]
            a = centre + np.int64(np.rint(s * ax + c * ay)) * width + np.int64(np.rint(c * ax - s * ay))
            b = centre + np.int64(np.rint(s * bx + c * by)) * width + np.int64(np.rint(c * bx - s * by))
            bits[n, m >> 3] |= np.uint8(flat[a] < flat[b]) << np.uint8(m & 7)
    return bits
