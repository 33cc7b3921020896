"""Numba twins of bundle adjustment's linearisation: one pass over each point, no temporaries."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

MIN_DEPTH = 1e-100
_int = types.int64
_array = lambda n: types.Array(types.float64, n, "C")  # noqa: E731


@njit(cache=True)
def _camera_point(R, t, X, i, j):
    x = R[i, 0, 0] * X[j, 0] + R[i, 0, 1] * X[j, 1] + R[i, 0, 2] * X[j, 2] + t[i, 0]
    y = R[i, 1, 0] * X[j, 0] + R[i, 1, 1] * X[j, 1] + R[i, 1, 2] * X[j, 2] + t[i, 1]
    z = R[i, 2, 0] * X[j, 0] + R[i, 2, 1] * X[j, 1] + R[i, 2, 2] * X[j, 2] + t[i, 2]
    return x, y, z


@njit(cache=True)
def _distorted(k, x, y):
    """Distorted position and radial factor."""
    q = x * x + y * y
    G = 1.0 + q * (k[4] + q * (k[5] + q * k[8]))
    factor = G + 2.0 * (k[7] * x + k[6] * y)
    return factor * x + q * k[7], factor * y + q * k[6], q, G


@kernel(
    *(given(3), given(2), given(2), given(2), given(1, _int), given(1, _int), given(1, _int), given(2)),
    returns=types.Tuple((_array(2), types.Array(types.boolean, 1, "C"))),
)
def polynomial_residuals(R_cam_world, t_cam_world, X_world, params, view, point, lens, uv):
    """Twin of :func:`vslam_ref.estimation.bundle.projection.polynomial_residuals`."""
    n = len(view)
    r, valid = np.zeros((n, 2)), np.zeros(n, dtype=np.bool_)
    for o in range(n):
        X, Y, z = _camera_point(R_cam_world, t_cam_world, X_world, view[o], point[o])
        if z > MIN_DEPTH and z < np.inf:
            valid[o] = True
            k = params[lens[o]]
            xd, yd, _, _ = _distorted(k, X / z, Y / z)
            r[o, 0] = k[0] * xd + k[2] - uv[o, 0]
            r[o, 1] = k[1] * yd + k[3] - uv[o, 1]
    return r, valid


@njit(cache=True)
def _lens_columns(k, basis, x, y, q, xd, yd, J):
    """Jacobian in the free directions of the intrinsics, into columns 6 and on of J (2, d)."""
    for c in range(basis.shape[1]):
        u, v = 0.0, 0.0
        for p in range(9):
            b = basis[p, c]
            if b == 0.0:
                continue
            if p == 0:
                u += b * xd
            elif p == 1:
                v += b * yd
            elif p == 2:
                u += b
            elif p == 3:
                v += b
            elif p == 6:
                u += b * k[0] * 2.0 * x * y
                v += b * k[1] * (q + 2.0 * y * y)
            elif p == 7:
                u += b * k[0] * (q + 2.0 * x * x)
                v += b * k[1] * 2.0 * x * y
            else:
                power = q if p == 4 else (q * q if p == 5 else q * q * q)
                u += b * k[0] * x * power
                v += b * k[1] * y * power
        J[0, 6 + c] = u
        J[1, 6 + c] = v


@njit(cache=True)
def _rows(R, k, basis, X, Y, z, uv, U, J, P, r):
    """Weighted rows of one observation: J (2, d), P (2, 3), r (2,)."""
    x, y = X / z, Y / z
    xd, yd, q, G = _distorted(k, x, y)
    r0, r1 = k[0] * xd + k[2] - uv[0], k[1] * yd + k[3] - uv[1]
    slope = 2.0 * (k[4] + q * (2.0 * k[5] + 3.0 * q * k[8]))
    dot = G + 2.0 * (k[7] * x + k[6] * y)
    a00 = dot + slope * x * x + 4.0 * k[7] * x
    a11 = dot + slope * y * y + 4.0 * k[6] * y
    a01 = slope * x * y + 2.0 * (k[7] * y + k[6] * x)
    fx, fy = k[0] / z, k[1] / z
    J[0, 0], J[0, 1], J[1, 0], J[1, 1] = fx * a00, fx * a01, fy * a01, fy * a11
    _lens_columns(k, basis, x, y, q, xd, yd, J)
    u00, u01, u10, u11 = U[0, 0], U[0, 1], U[1, 0], U[1, 1]
    r[0], r[1] = u00 * r0 + u01 * r1, u10 * r0 + u11 * r1
    for c in (0, 1):
        v, w = J[0, c], J[1, c]
        J[0, c], J[1, c] = u00 * v + u01 * w, u10 * v + u11 * w
    for c in range(6, J.shape[1]):
        v, w = J[0, c], J[1, c]
        J[0, c], J[1, c] = u00 * v + u01 * w, u10 * v + u11 * w
    for a in range(2):
        J[a, 2] = -(J[a, 0] * x + J[a, 1] * y)
        J[a, 3] = Y * J[a, 2] - z * J[a, 1]
        J[a, 4] = z * J[a, 0] - X * J[a, 2]
        J[a, 5] = X * J[a, 1] - Y * J[a, 0]
        for c in range(3):
            P[a, c] = J[a, 0] * R[0, c] + J[a, 1] * R[1, c] + J[a, 2] * R[2, c]


@kernel(
    *(given(3), given(2), given(2), given(2), given(1, _int), given(1, _int), given(1, _int), given(2)),
    *(given(3), given(2), given(1, _int), given(1, _int), given(1, _int)),
    returns=types.Tuple((_array(3), _array(2), _array(3), _array(2), _array(3))),
)
def polynomial_normal(
    R_cam_world,
    t_cam_world,
    X_world,
    params,
    view,
    point,
    lens,
    uv,
    U,
    basis,
    offsets,
    view_order,
    view_offsets,
):
    """Twin of :func:`vslam_ref.estimation.bundle.normal.polynomial_normal`."""
    n, d = len(view), 6 + basis.shape[1]
    views, points = len(view_offsets) - 1, len(offsets) - 1
    B, g_view = np.zeros((views, d, d)), np.zeros((views, d))
    C, g_point, W = np.zeros((points, 3, 3)), np.zeros((points, 3)), np.empty((n, d, 3))
    J, P, r = np.zeros((2, d)), np.zeros((2, 3)), np.zeros(2)
    for j in range(points):
        for o in range(offsets[j], offsets[j + 1]):
            i = view[o]
            X, Y, z = _camera_point(R_cam_world, t_cam_world, X_world, i, j)
            if not (z > MIN_DEPTH and z < np.inf):
                W[o] = 0.0
                continue
            _rows(R_cam_world[i], params[lens[o]], basis, X, Y, z, uv[o], U[o], J, P, r)
            for a in range(d):
                j0, j1 = J[0, a], J[1, a]
                g_view[i, a] += j0 * r[0] + j1 * r[1]
                for b in range(a + 1):
                    B[i, a, b] += j0 * J[0, b] + j1 * J[1, b]
                for c in range(3):
                    W[o, a, c] = j0 * P[0, c] + j1 * P[1, c]
            for a in range(3):
                p0, p1 = P[0, a], P[1, a]
                g_point[j, a] += p0 * r[0] + p1 * r[1]
                for c in range(a + 1):
                    C[j, a, c] += p0 * P[0, c] + p1 * P[1, c]
    for i in range(views):
        for a in range(d):
            for b in range(a):
                B[i, b, a] = B[i, a, b]
    for j in range(points):
        for a in range(3):
            for c in range(a):
                C[j, c, a] = C[j, a, c]
    return B, g_view, C, g_point, W
