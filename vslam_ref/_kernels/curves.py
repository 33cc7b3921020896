"""Numba twins of the search along a curve: rays of corners, and corners that lie near a ray's curve."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit, unpacks
from vslam_ref._kernels.features import BYTES, NEW_INTEGERS, NUMBERS
from vslam_ref._kernels.patches import AFTER, AREA, BEFORE, PATCHES, SIDE, _cost, _cross, _sums

MAX_TAN = 1e6
CORNERS = given(2, types.int32)
MASK = given(1, types.boolean)


@kernel(
    given(1),
    given(2),
    returns=types.Tuple(
        (
            types.Array(types.float64, 2, "C"),
            types.Array(types.float64, 3, "C"),
            types.Array(types.bool_, 1, "C"),
        )
    ),
)
def pinhole_rays(K, uv):
    """Twin of :func:`vslam_ref.systems.ptam.mapper.curve_search._pinhole_rays`."""
    count = uv.shape[0]
    bearing, J_pixel, valid = np.zeros((count, 3)), np.zeros((count, 3, 2)), np.zeros(count, np.bool_)
    for n in range(count):
        x, y = (uv[n, 0] - K[2]) / K[0], (uv[n, 1] - K[3]) / K[1]
        bearing[n, 2] = 1.0
        if not (abs(x) < MAX_TAN and abs(y) < MAX_TAN):
            continue
        valid[n] = True
        size = np.sqrt(x * x + y * y + 1.0)
        b = x / size, y / size, 1.0 / size
        for i in range(3):
            bearing[n, i] = b[i]
            for j in range(2):
                along = 1.0 if i == j else 0.0
                J_pixel[n, i, j] = (along - b[i] * b[j]) / (size * K[j])
    return bearing, J_pixel, valid


@njit(cache=True)
def _columns(xy, bearing, J_pixel, valid, width, height):
    """Bearings and their slopes (9, n) with a number a row; corners that may be taken are not all 0."""
    rows = np.zeros((9, (xy.shape[0] + 7) // 8 * 8))
    use = np.zeros(rows.shape[1], np.bool_)
    for c in range(xy.shape[0]):
        x, y = xy[c, 0], xy[c, 1]
        whole = x >= BEFORE and y >= BEFORE and x < width - AFTER and y < height - AFTER
        use[c] = valid[c] and whole
        for i in range(3):
            rows[i, c] = bearing[c, i]
            rows[3 + i, c], rows[6 + i, c] = J_pixel[c, i, 0], J_pixel[c, i, 1]
    return rows, use


@njit(cache=True)
def _mark(rows, use, lx, ly, lz, squared, close):
    """Corners within a distance, given squared, of the curve whose plane has the normal l."""
    b0, b1, b2, x0, x1, x2 = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    y0, y1, y2 = rows[6], rows[7], rows[8]
    for c in range(close.shape[0]):
        e = lx * b0[c] + ly * b1[c] + lz * b2[c]
        gx = lx * x0[c] + ly * x1[c] + lz * x2[c]
        gy = lx * y0[c] + ly * y1[c] + lz * y2[c]
        close[c] = use[c] & (e * e <= squared * (gx * gx + gy * gy))


@njit(cache=True)
def _depths(ra, b, t):
    """Distances along two rays of where they come closest."""
    c = ra[0] * b[0] + ra[1] * b[1] + ra[2] * b[2]
    p = ra[0] * t[0] + ra[1] * t[1] + ra[2] * t[2]
    q = b[0] * t[0] + b[1] * t[1] + b[2] * t[2]
    under = max(1.0 - c * c, 1e-12)
    return (c * q - p) / under, (q - c * p) / under


@kernel(
    *(PATCHES, given(2), MASK, BYTES, types.int64, CORNERS, given(2), given(3), MASK),
    *(given(2), types.float64, types.float64, types.float64),
    returns=types.Tuple((NEW_INTEGERS, NUMBERS)),
)
def _search_curve(
    patch, bearing_a, valid_a, flat, width, xy, bearing_b, J_b, valid_b, T_b_a, distance, near, limit
):
    rows, use = _columns(xy, bearing_b, J_b, valid_b, width, flat.shape[0] // width)
    R, t = np.ascontiguousarray(T_b_a[:3, :3]), T_b_a[:3, 3]
    corner, cost = np.full(patch.shape[0], -1), np.full(patch.shape[0], np.inf)
    close, sums = np.empty(rows.shape[1], np.bool_), np.full((xy.shape[0], 2), -1)
    words, ra = close.view(np.uint64), np.empty(3)
    for n in range(patch.shape[0]):
        if not valid_a[n]:
            continue
        for i in range(3):
            ra[i] = R[i, 0] * bearing_a[n, 0] + R[i, 1] * bearing_a[n, 1] + R[i, 2] * bearing_a[n, 2]
        lx, ly, lz = t[1] * ra[2] - t[2] * ra[1], t[2] * ra[0] - t[0] * ra[2], t[0] * ra[1] - t[1] * ra[0]
        _mark(rows, use, lx, ly, lz, distance * distance, close)
        a, aa = _sums(patch[n], SIDE, BEFORE * SIDE + BEFORE)
        spread = max(_cost(np.int64(0), a, aa, np.int64(0), np.int64(0), False), 1.0)
        for w in range(words.shape[0]):
            if words[w] == 0:
                continue
            for c in range(8 * w, 8 * w + 8):
                if not close[c]:
                    continue
                p, q = _depths(ra, bearing_b[c], t)
                if not (p >= near and q > 0.0):
                    continue
                at = np.int64(xy[c, 1]) * width + xy[c, 0]
                if sums[c, 0] < 0:
                    sums[c, 0], sums[c, 1] = _sums(flat, width, at)
                this = _cost(_cross(patch[n], flat, width, at), a, aa, sums[c, 0], sums[c, 1], False) / spread
                if this < cost[n]:
                    corner[n], cost[n] = c, this
        if not cost[n] <= limit:
            corner[n] = -1
    return corner, cost


@unpacks(_search_curve)
def search_curve(patch, a, image, b, T_b_a, gates):
    """Twin of :func:`vslam_ref.systems.ptam.mapper.curve_search._search`."""
    flat, width, distance = image.reshape(-1), image.shape[1], gates.distance * 2.0**gates.level
    there = flat, width, b.xy, b.bearing, b.J_pixel, b.valid
    return _search_curve(
        patch.reshape(-1, AREA), a.bearing, a.valid, *there, T_b_a, distance, gates.near, gates.limit
    )
