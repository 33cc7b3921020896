"""Numba twins of bundle adjustment's hot loops: one pass over each point, no temporaries."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from vslam_ref._kernels._signature import given, kernel

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


@njit(cache=True)
def _lenses_are_shared(columns, size):
    """Whether a column beyond the pose belongs to more than one view."""
    taken = np.zeros(size + 1, dtype=np.bool_)
    for i in range(columns.shape[0]):
        for a in range(6, columns.shape[1]):
            if taken[columns[i, a]]:
                return True
            taken[columns[i, a]] = columns[i, a] < size
    return False


@njit(cache=True)
def _span(at, size):
    """First and last column of a part, and whether they are all there is between."""
    first, last, count = size, -1, 0
    for p in at:
        if p < size:
            count += 1
            first, last = min(first, p), max(last, p)
    return first, last, count == len(at) and last - first == len(at) - 1


@njit(cache=True)
def _add_part(parts, at, size, columns, span):
    """Note the columns of one more part, and their span, width, and whether they are neighbours."""
    width = len(at)
    columns[parts, :width] = at
    span[parts, 0], span[parts, 1], plain = _span(at, size)
    span[parts, 2], span[parts, 3] = width, plain
    return parts + 1


@njit(cache=True)
def _subtract_pairs(S, parts, V, columns, span):
    """S -= V V^T, lower triangle, for all pairs of parts."""
    for s in range(parts):
        w = span[s, 2]
        for t in range(parts):
            if span[t, 0] > span[s, 1]:  # the whole block lies above the diagonal
                continue
            if span[s, 3] and span[t, 3] and span[t, 1] < span[s, 0]:
                _subtract_block(S, span[s, 0], span[t, 0], V[s, :w], V[t, : span[t, 2]])
            else:
                _subtract_entries(S, columns[s, :w], columns[t, : span[t, 2]], V[s], V[t])


@njit(cache=True)
def _subtract_block(S, row, column, V, Z):
    """S[row:, column:] -= V Z^T, a block below the diagonal."""
    for a in range(V.shape[0]):
        v0, v1, v2 = V[a, 0], V[a, 1], V[a, 2]
        for b in range(Z.shape[0]):
            S[row + a, column + b] -= v0 * Z[b, 0] + v1 * Z[b, 1] + v2 * Z[b, 2]


@njit(cache=True)
def _subtract_entries(S, rows, columns, V, Z):
    """The same entry by entry, where columns are fixed, shared, or on the diagonal."""
    size = len(S)
    for a in range(len(rows)):
        p = rows[a]
        if p == size:
            continue
        v0, v1, v2 = V[a, 0], V[a, 1], V[a, 2]
        for b in range(len(columns)):
            if columns[b] <= p:
                S[p, columns[b]] -= v0 * Z[b, 0] + v1 * Z[b, 1] + v2 * Z[b, 2]


@kernel(
    *(given(3), given(2), given(2), given(3), given(3), given(1, _int), given(2, _int), _int),
    *(given(1, _int), given(1, _int), given(1, _int), given(1, _int), given(1, _int), given(2, _int)),
    returns=types.Tuple((_array(2), _array(1))),
)
def schur_complement(
    B,
    g_view,
    g_point,
    W,
    M,
    view,
    columns,
    size,
    offsets,
    runs,
    window_points,
    window_offsets,
    window_columns,
    local,
):
    """Twin of :func:`vslam_ref.estimation.bundle.schur.schur_complement`: blocks of pairs of observations."""
    views, d = g_view.shape
    S, rhs = np.zeros((size, size)), np.zeros(size)
    for i in range(views):
        for a in range(d):
            p = columns[i, a]
            if p < size:
                rhs[p] -= g_view[i, a]
                for b in range(d):
                    if columns[i, b] <= p:
                        S[p, columns[i, b]] += B[i, a, b]
    shared = _lenses_are_shared(columns, size)
    own = 6 if shared else d  # what a view has for itself
    longest = 1
    for j in range(len(offsets) - 1):
        longest = max(longest, offsets[j + 1] - offsets[j])
    # parts: one an observation and, of shared lenses, one a run
    V, at, span = (
        np.empty((2 * longest, d, 3)),
        np.empty((2 * longest, d), _int),
        np.empty((2 * longest, 4), _int),
    )
    run = 0
    for j in range(len(offsets) - 1):
        begin, end = offsets[j], offsets[j + 1]
        m00, m01, m02, m11, m12, m22 = M[j, 0, 0], M[j, 0, 1], M[j, 0, 2], M[j, 1, 1], M[j, 1, 2], M[j, 2, 2]
        g0, g1, g2 = g_point[j, 0], g_point[j, 1], g_point[j, 2]
        u0, u1, u2 = m00 * g0, m01 * g0 + m11 * g1, m02 * g0 + m12 * g1 + m22 * g2
        parts = 0
        for o in range(begin, end):
            parts = _add_part(parts, columns[view[o], :own], size, at, span)
        lens_part = parts - 1
        for o in range(begin, end):
            if shared and run < len(runs) and runs[run] == o:
                run += 1
                lens_part += 1
                V[lens_part] = 0.0
                parts = _add_part(parts, columns[view[o], own:], size, at, span)
            for a in range(d):
                w0, w1, w2 = W[o, a, 0], W[o, a, 1], W[o, a, 2]
                v0, v1, v2 = m00 * w0, m01 * w0 + m11 * w1, m02 * w0 + m12 * w1 + m22 * w2
                p = columns[view[o], a]
                if p < size:
                    rhs[p] += v0 * u0 + v1 * u1 + v2 * u2
                if a < own:
                    V[o - begin, a, 0], V[o - begin, a, 1], V[o - begin, a, 2] = v0, v1, v2
                else:
                    V[lens_part, a - own, 0] += v0
                    V[lens_part, a - own, 1] += v1
                    V[lens_part, a - own, 2] += v2
        if m00 != 0.0:
            _subtract_pairs(S, parts, V, at, span)
    return S, rhs


@kernel(
    *(given(3), given(3), given(2), given(2), given(1, _int), given(1, _int)),
    returns=_array(2),
)
def point_steps(W, M, g_point, view_steps, view, offsets):
    """Twin of :func:`vslam_ref.estimation.bundle.schur.point_steps`."""
    points, d = len(offsets) - 1, W.shape[1]
    out = np.zeros((points, 3))
    for j in range(points):
        s0, s1, s2 = g_point[j, 0], g_point[j, 1], g_point[j, 2]
        for o in range(offsets[j], offsets[j + 1]):
            i = view[o]
            for a in range(d):
                v = view_steps[i, a]
                s0 += v * W[o, a, 0]
                s1 += v * W[o, a, 1]
                s2 += v * W[o, a, 2]
        m00, m01, m02, m11, m12, m22 = M[j, 0, 0], M[j, 0, 1], M[j, 0, 2], M[j, 1, 1], M[j, 1, 2], M[j, 2, 2]
        u0, u1, u2 = m00 * s0, m01 * s0 + m11 * s1, m02 * s0 + m12 * s1 + m22 * s2
        out[j, 0] = -(m00 * u0 + m01 * u1 + m02 * u2)
        out[j, 1] = -(m11 * u1 + m12 * u2)
        out[j, 2] = -m22 * u2
    return out
