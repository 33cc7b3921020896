"""Numba twin of looking for patches: refined from where they are expected, else from the best corner."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit
from vslam_ref._kernels.features import BYTES, PIXELS
from vslam_ref._kernels.patches import (
    AFTER,
    AREA,
    BEFORE,
    FLAT,
    OK,
    PATCHES,
    ROOM,
    SIDE,
    _cost,
    _cross,
    _first,
    _read,
    _refined,
    _slopes,
    _sums,
)

FARTHEST_PLACE = 1e9


@njit(cache=True)
def _alike(flat, width, height, x, y, patch, a, aa, most, here):
    """Whether the image at a place between its pixels differs from a patch by ``most`` squares at most."""
    if not (x >= BEFORE and x + AFTER <= width - 1 and y >= BEFORE and y + AFTER <= height - 1):
        return False
    _read(flat, width, height, x, y, -BEFORE, SIDE, here)
    b = bb = cross = np.int64(0)
    for k in range(AREA):
        level = np.int64(np.floor(here[k] + 0.5))
        b, bb, cross = b + level, bb + level * level, cross + level * np.int64(patch[k])
    return _cost(cross, a, aa, b, bb, False) <= most


@njit(cache=True)
def _best_corner(flat, width, height, xy, row_start, u, v, r, patch, a, aa, correlate):
    """Corner within r of (u, v) that looks most like a patch, and its cost; -1 without one."""
    best, least = -1, np.inf
    middle, most = int(np.rint(v)), int(np.ceil(r))
    for y in range(max(middle - most, BEFORE), min(middle + most + 1, height - AFTER)):
        square = r * r - (y - v) * (y - v)
        if square < 0.0:
            continue
        half = np.sqrt(square)
        first = _first(xy, row_start[y], row_start[y + 1], np.ceil(u - half))
        for c in range(first, row_start[y + 1]):
            x = np.int64(xy[c, 0])
            if x > u + half:
                break
            if x < BEFORE or x >= width - AFTER:
                continue
            at = y * width + x
            b, bb = _sums(flat, width, at)
            this = _cost(_cross(patch, flat, width, at), a, aa, b, bb, correlate)
            if this < least:
                best, least = c, this
    return best, least


@kernel(
    *(BYTES, types.int64, PIXELS, given(1, types.int64), PATCHES, given(2), given(1)),
    *(types.float64, types.float64, types.boolean, types.boolean),
    returns=types.Tuple((types.Array(types.float64, 2, "C"), types.Array(types.bool_, 1, "C"))),
)
def locate(flat, width, xy, row_start, patch, uv, radius, limit, absolute, correlate, first_refine):
    """Twin of :func:`vslam_ref.systems.visual_map.measure._locate`."""
    height = flat.shape[0] // width
    place, ok = uv.copy(), np.zeros(uv.shape[0], np.bool_)
    T, gx, gy, here = np.empty(AREA), np.empty(AREA), np.empty(AREA), np.empty(ROOM)
    for n in range(uv.shape[0]):
        u, v, r = uv[n, 0], uv[n, 1], radius[n]
        S = _slopes(patch[n], T, gx, gy)
        a, aa = _sums(patch[n], SIDE, BEFORE * SIDE + BEFORE)
        spread = _cost(np.int64(0), a, aa, np.int64(0), np.int64(0), False)
        most = absolute if absolute > 0.0 else limit * spread
        if first_refine:
            x, y, _, state = _refined(flat, width, height, u, v, T, gx, gy, S, here)
            if state == FLAT:
                continue
            if state == OK and np.hypot(x - u, y - v) <= r:
                ok[n] = _alike(flat, width, height, x, y, patch[n], a, aa, most, here)
                if ok[n]:
                    place[n, 0], place[n, 1] = x, y
                    continue
        if not (abs(u) < FARTHEST_PLACE and abs(v) < FARTHEST_PLACE):
            continue
        best, cost = _best_corner(flat, width, height, xy, row_start, u, v, r, patch[n], a, aa, correlate)
        share = absolute / max(spread, 1.0) if absolute > 0.0 else limit
        if best < 0 or cost > share * (1.0 if correlate else spread):
            continue
        x, y = np.float64(xy[best, 0]), np.float64(xy[best, 1])
        x, y, _, state = _refined(flat, width, height, x, y, T, gx, gy, S, here)
        if state == OK and _alike(flat, width, height, x, y, patch[n], a, aa, most, here):
            place[n, 0], place[n, 1], ok[n] = x, y, True
    return place, ok
