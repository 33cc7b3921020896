"""Numba twins of matching ORB features: in windows around places, and along epipolar curves."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit
from vslam_ref._kernels.hamming import ROWS, _ones, _words

FAR = 257
WHOLE = given(1, types.int64)
THREE = types.UniTuple(types.Array(types.int64, 1, "C"), 3)


@njit(cache=True)
def _bits(p, i, q, j):
    """Bits in which two descriptors of four words differ."""
    low = _ones(p[i, 0] ^ q[j, 0]) + _ones(p[i, 1] ^ q[j, 1])
    return np.int64(low + _ones(p[i, 2] ^ q[j, 2]) + _ones(p[i, 3] ^ q[j, 3]))


@kernel(given(2), given(1), WHOLE, WHOLE, ROWS, given(2), WHOLE, ROWS, returns=THREE)
def search(uv, radius, low, high, descriptor, feature_uv, octave, feature_descriptor):
    """Twin of :func:`vslam_ref.systems.orbslam.window_search._search`: features from above to below."""
    count = uv.shape[0]
    best, least = np.full(count, -1), np.full(count, FAR)
    second = np.full(count, FAR)
    p, q = _words(descriptor), _words(feature_descriptor)
    order = np.argsort(feature_uv[:, 1], kind="mergesort")
    v = feature_uv[:, 1][order]
    seen = np.empty(len(v), np.int64)
    distance = np.empty(len(v), np.int64)
    for i in range(count):
        r = radius[i]
        used = 0
        for k in range(np.searchsorted(v, uv[i, 1] - r - 1.0), len(v)):
            if v[k] - uv[i, 1] > r + 1.0:
                break
            j = order[k]
            if octave[j] < low[i] or octave[j] > high[i]:
                continue
            if abs(uv[i, 0] - feature_uv[j, 0]) <= r and abs(uv[i, 1] - v[k]) <= r:
                d = _bits(p, i, q, j)
                seen[used], distance[used] = j, d
                used += 1
                if d < least[i] or (d == least[i] and j < best[i]):
                    best[i], least[i] = j, d
        for k in range(used):
            j = seen[k]
            if j != best[i] and octave[j] == octave[best[i]] and distance[k] < second[i]:
                second[i] = distance[k]
    return best, least, second


@kernel(
    given(2), ROWS, given(2), given(3), given(1), ROWS, types.float64,
    returns=types.UniTuple(types.Array(types.int64, 1, "C"), 2),
)  # fmt: skip
def search_lines(line, descriptor, bearing, J_pixel, width, other, distance):
    """Twin of :func:`vslam_ref.systems.orbslam.mapper.new_points._search`: a pair at a time."""
    best, least = np.full(line.shape[0], -1), np.full(line.shape[0], FAR)
    p, q = _words(descriptor), _words(other)
    for i in range(line.shape[0]):
        x, y, z = line[i, 0], line[i, 1], line[i, 2]
        for j in range(bearing.shape[0]):
            e = x * bearing[j, 0] + y * bearing[j, 1] + z * bearing[j, 2]
            gx = x * J_pixel[j, 0, 0] + y * J_pixel[j, 1, 0] + z * J_pixel[j, 2, 0]
            gy = x * J_pixel[j, 0, 1] + y * J_pixel[j, 1, 1] + z * J_pixel[j, 2, 1]
            d = distance * width[j]
            if e * e <= d * d * (gx * gx + gy * gy):
                bits = _bits(p, i, q, j)
                if bits < least[i]:
                    best[i], least[i] = j, bits
    return best, least
