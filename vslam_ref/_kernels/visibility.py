"""Numba twins of what a pinhole should see of a map, and of how it should look there."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import changed, given, kernel, njit, unpacks
from vslam_ref._kernels.features import BYTES
from vslam_ref._kernels.patches import AFTER, AREA, BEFORE, SIDE, _bilinear, _inside

MIN_DEPTH, MAX_TAN, MARGIN, LARGEST_STRETCH = 1e-100, 1e6, 5.0, 3.0
INTEGERS = given(1, types.int64)
NEW_INTEGERS, NEW_NUMBERS = types.Array(types.int64, 1, "C"), types.Array(types.float64, 1, "C")


@njit(cache=True)
def _affine(K, T, T_kf, x, y, z, X, slope, A):
    """A = d pixel / d pixel of the source, for a point X at (x, y, z) before the camera."""
    depth = T_kf[2, 0] * X[0] + T_kf[2, 1] * X[1] + T_kf[2, 2] * X[2] + T_kf[2, 3]
    J = np.empty((2, 3))
    for j in range(3):  # d pixel / d X_world
        J[0, j] = K[0] / z * (T[0, j] - x / z * T[2, j])
        J[1, j] = K[1] / z * (T[1, j] - y / z * T[2, j])
    for i in range(2):
        p = J[i, 0] * T_kf[0, 0] + J[i, 1] * T_kf[0, 1] + J[i, 2] * T_kf[0, 2]
        q = J[i, 0] * T_kf[1, 0] + J[i, 1] * T_kf[1, 1] + J[i, 2] * T_kf[1, 2]
        for j in range(2):
            A[i, j] = (p * slope[0, j] + q * slope[1, j]) * depth


@njit(cache=True)
def _level(A, source, levels):
    """Level on which a patch has nearly its own size; -1 where there is none."""
    size = 2.0**source
    area = size * A[0, 0] * (size * A[1, 1]) - size * A[0, 1] * (size * A[1, 0])
    if not area >= 0.25:
        return -1
    steps = np.ceil(np.log2(area / LARGEST_STRETCH) / 2)
    return int(max(steps, 0.0)) if steps < levels else -1


@kernel(
    *(given(3), given(2), INTEGERS, INTEGERS, given(3)),
    *(given(2), INTEGERS, given(1), types.int64, types.int64, types.int64),
    returns=types.Tuple(
        (
            NEW_INTEGERS,
            types.Array(types.float64, 2, "C"),
            NEW_NUMBERS,
            types.Array(types.float64, 3, "C"),
            NEW_INTEGERS,
        )
    ),
)
def _pinhole_visible(
    T_kf_world, X_world, source_kf, source_level, slope, T, number, K, height, width, levels
):
    count = number.shape[0]
    point, uv, depth = np.empty(count, np.int64), np.empty((count, 2)), np.empty(count)
    A, level, n = np.empty((count, 2, 2)), np.empty(count, np.int64), 0
    for k in range(count):
        j = number[k]
        X = X_world[j]
        x = T[0, 0] * X[0] + T[0, 1] * X[1] + T[0, 2] * X[2] + T[0, 3]
        y = T[1, 0] * X[0] + T[1, 1] * X[1] + T[1, 2] * X[2] + T[1, 3]
        z = T[2, 0] * X[0] + T[2, 1] * X[1] + T[2, 2] * X[2] + T[2, 3]
        if not (z > MIN_DEPTH and z < np.inf and abs(x) < MAX_TAN * z and abs(y) < MAX_TAN * z):
            continue
        u, v = K[0] * (x / z) + K[2], K[1] * (y / z) + K[3]
        if not (u >= 0.0 and v >= 0.0 and u <= width - 1 and v <= height - 1):
            continue
        _affine(K, T, T_kf_world[source_kf[j]], x, y, z, X, slope[j], A[n])
        level[n] = _level(A[n], source_level[j], levels)
        if level[n] < 0:
            continue
        size = 2.0 ** level[n]
        p, q = (u - (size - 1) / 2) / size, (v - (size - 1) / 2) / size
        right, low = width / size - 1 - MARGIN, height / size - 1 - MARGIN
        if p >= MARGIN and q >= MARGIN and p <= right and q <= low:
            point[n], uv[n, 0], uv[n, 1], depth[n] = j, u, v, z
            n += 1
    return point[:n].copy(), uv[:n].copy(), depth[:n].copy(), A[:n].copy(), level[:n].copy()


@unpacks(_pinhole_visible)
def pinhole_visible(known, T_cam_world, number, K, height, width, levels):
    """Twin of :func:`vslam_ref.systems.visual_map.visibility._pinhole_visible`."""
    columns = known.T_kf_world, known.X_world, known.source_kf, known.source_level, known.slope
    return _pinhole_visible(*columns, T_cam_world, number, K, height, width, levels)


@njit(cache=True)
def _rows_inside(y, M, height):
    """Whether a patch around y reaches into no other keyframe's image."""
    for dx in (-BEFORE, AFTER):
        for dy in (-BEFORE, AFTER):
            at = y + (M[1, 0] * dx + M[1, 1] * dy)
            if not (at >= 0 and at <= height - 1):
                return False
    return True


@kernel(
    *(BYTES, types.int64, types.int64, types.int64, INTEGERS, INTEGERS, given(2), given(3), INTEGERS),
    *(changed(2, types.uint8), changed(1, types.boolean)),
)
def read_templates(flat, width, height, each, kf, source_level, source_uv, A, level, patch, inside):
    """Twin of :func:`vslam_ref.systems.visual_map.visibility._read_templates`."""
    total, M, at = flat.shape[0] // width, np.empty((2, 2)), np.empty(2)
    for n in range(kf.shape[0]):
        if source_level[n] != each:
            continue
        over = 2.0 ** (level[n] - each) / (A[n, 0, 0] * A[n, 1, 1] - A[n, 0, 1] * A[n, 1, 0])
        M[0, 0], M[0, 1] = over * A[n, 1, 1], -over * A[n, 0, 1]
        M[1, 0], M[1, 1] = -over * A[n, 1, 0], over * A[n, 0, 0]
        half, size = (2.0**each - 1) / 2, 2.0**each
        at[0], y = (source_uv[n, 0] - half) / size, (source_uv[n, 1] - half) / size
        at[1] = y + kf[n] * np.float64(height)
        inside[n] = _rows_inside(y, M, height) and _inside(at, M, width, total)
        if not inside[n]:
            continue
        for k in range(AREA):
            dx, dy = k % SIDE - BEFORE, k // SIDE - BEFORE
            u = at[0] + (M[0, 0] * dx + M[0, 1] * dy)
            v = at[1] + (M[1, 0] * dx + M[1, 1] * dy)
            patch[n, k] = np.uint8(np.floor(_bilinear(flat, width, total, u, v) + 0.5))
