"""Numba twin of triangulation with pinholes: every point goes to its minimum by itself."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

MIN_DEPTH, MAX_TAN = 1e-100, 1e6
SETTLED, FIRST, LEAST, MOST, FLAT = 1e-16, 1e-3, 1e-12, 1e12, 1e-14
PLAIN = 1e-8
"""Determinant of a matrix with unit diagonal from which on its smallest eigenvalue is above 1e-9."""


@njit(cache=True)
def _linearise(K, T, uv, root, X, g, H):
    """Cost, gradient and Gauss-Newton Hessian; infinite where a view that counts sees nothing."""
    g[:], H[:], cost = 0.0, 0.0, 0.0
    J = np.empty((2, 3))
    for v in range(T.shape[0]):
        if not root[v] > 0.0:
            continue
        x = T[v, 0, 0] * X[0] + T[v, 0, 1] * X[1] + T[v, 0, 2] * X[2] + T[v, 0, 3]
        y = T[v, 1, 0] * X[0] + T[v, 1, 1] * X[1] + T[v, 1, 2] * X[2] + T[v, 1, 3]
        z = T[v, 2, 0] * X[0] + T[v, 2, 1] * X[1] + T[v, 2, 2] * X[2] + T[v, 2, 3]
        if not (z > MIN_DEPTH and z < np.inf and abs(x) < MAX_TAN * z and abs(y) < MAX_TAN * z):
            return np.inf
        a, b, fx, fy = x / z, y / z, K[v, 0] * root[v], K[v, 1] * root[v]
        r0 = (K[v, 0] * a + K[v, 2] - uv[v, 0]) * root[v]
        r1 = (K[v, 1] * b + K[v, 3] - uv[v, 1]) * root[v]
        for j in range(3):
            J[0, j] = fx / z * (T[v, 0, j] - a * T[v, 2, j])
            J[1, j] = fy / z * (T[v, 1, j] - b * T[v, 2, j])
        cost += 0.5 * (r0 * r0 + r1 * r1)
        for i in range(3):
            g[i] += J[0, i] * r0 + J[1, i] * r1
            for j in range(3):
                H[i, j] += J[0, i] * J[0, j] + J[1, i] * J[1, j]
    return cost


@njit(cache=True)
def _solve(H, damping, g, x):
    """X = (H + damping diag H)^-1 g; zero along directions in which that is singular."""
    more = 1.0 + damping
    d0, d1 = np.sqrt(max(more * H[0, 0], 1e-300)), np.sqrt(max(more * H[1, 1], 1e-300))
    d2 = np.sqrt(max(more * H[2, 2], 1e-300))
    d = d0, d1, d2
    a, b, c = H[0, 1] / d0 / d1, H[0, 2] / d0 / d2, H[1, 2] / d1 / d2
    p, q, r = g[0] / d0, g[1] / d1, g[2] / d2
    m = 1.0 - a * a
    under = m * (1.0 - b * b) - (c - a * b) ** 2  # m times the determinant
    if m > PLAIN and under > PLAIN * m:
        z = (m * (r - b * p) - (c - a * b) * (q - a * p)) / under
        y = (q - a * p - (c - a * b) * z) / m
        x[0], x[1], x[2] = (p - a * y - b * z) / d0, y / d1, z / d2
        return
    scaled = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            scaled[i, j] = H[i, j] * (more if i == j else 1.0) / d[i] / d[j]
    values, vectors = np.linalg.eigh(scaled)
    x[:] = 0.0
    for k in range(3):
        if values[k] > FLAT * values[2]:
            along = (vectors[0, k] * p + vectors[1, k] * q + vectors[2, k] * r) / values[k]
            for i in range(3):
                x[i] += vectors[i, k] * along / d[i]


@njit(cache=True)
def _decrement(H, g, step):
    """Squared length of the whole step, in the point's own standard deviations."""
    _solve(H, 0.0, g, step)
    return g[0] * step[0] + g[1] * step[1] + g[2] * step[2]


@njit(cache=True)
def _point(K, T, uv, root, X, most):
    """Move one point to its minimum; whether it settled, its Hessian, and the steps tried."""
    g, H, step, trial = np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    g_new, H_new = np.zeros(3), np.zeros((3, 3))
    far, rounding = 1.0, 0.0
    for v in range(uv.shape[0]):
        far = max(far, abs(uv[v, 0]), abs(uv[v, 1]))
    for v in range(uv.shape[0]):
        rounding += (root[v] * (16 * 2.220446049250313e-16 * far)) ** 2
    cost, damping, tried = _linearise(K, T, uv, root, X, g, H), FIRST, 0
    to_go = _decrement(H, g, step)
    settled = to_go <= SETTLED + rounding
    while not settled and np.isfinite(cost) and damping <= MOST and tried < most:
        _solve(H, damping, g, step)
        for i in range(3):
            trial[i] = X[i] - step[i]
        new = _linearise(K, T, uv, root, trial, g_new, H_new)
        left = _decrement(H_new, g_new, step) if np.isfinite(new) else np.inf
        level = abs(new - cost) <= np.sqrt(2.0 * cost * rounding)
        tried += 1
        if new < cost or (level and left < 0.25 * to_go):
            X[:], g[:], H[:], cost, to_go = trial, g_new, H_new, new, left
            damping = max(damping * 0.1, LEAST)
            settled = to_go <= SETTLED + rounding
        else:
            damping = max(damping * 10.0, LEAST)
    return settled, H, tried


@njit(cache=True)
def _rmse(K, T, uv, root, X):
    """Root of the mean squared distance, pixels; infinite where a view that counts sees nothing."""
    g, H, used = np.zeros(3), np.zeros((3, 3)), 0
    one = np.zeros(root.shape[0])
    for v in range(root.shape[0]):
        if root[v] > 0.0:
            one[v] = 1.0
            used += 1
    return np.sqrt(2.0 * _linearise(K, T, uv, one, X, g, H) / max(used, 1))


@kernel(
    *(given(2), given(3), given(3), given(2), given(2), types.int64),
    returns=types.Tuple(
        (
            types.Array(types.float64, 2, "C"),
            types.Array(types.bool_, 1, "C"),
            types.Array(types.float64, 3, "C"),
            types.Array(types.float64, 1, "C"),
            types.Array(types.int64, 1, "C"),
        )
    ),
)
def pinhole_descent(K, T_cam_world, uv, root, X_start, max_iterations):
    """Twin of :func:`vslam_ref.estimation.triangulation._pinhole_descent`."""
    n = X_start.shape[0]
    X, settled, H = X_start.copy(), np.zeros(n, np.bool_), np.zeros((n, 3, 3))
    rmse, tried = np.zeros(n), np.zeros(n, np.int64)
    for k in range(n):
        settled[k], H[k], tried[k] = _point(K, T_cam_world, uv[k], root[k], X[k], max_iterations)
        rmse[k] = _rmse(K, T_cam_world, uv[k], root[k], X[k])
    return X, settled, H, rmse, tried
