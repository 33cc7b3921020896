"""Numba twin of pose tracking with a pinhole: all reweighted steps in one compiled loop."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

MIN_DEPTH, MAX_TAN = 1e-100, 1e6
MAD_NORM_2D = 0.8493218002880191
LEAST_POINTS, WORST = 4, 1e12
FINE, FEW, UNDETERMINED = 0, 1, 2


@njit(cache=True)
def _errors(K, T, X, u, root, e, J, valid):
    """Errors e (N, 2) and Jacobian J (N, 2, 6) over sigma; how many points are in front."""
    seen = 0
    for n in range(X.shape[0]):
        x = T[0, 0] * X[n, 0] + T[0, 1] * X[n, 1] + T[0, 2] * X[n, 2] + T[0, 3]
        y = T[1, 0] * X[n, 0] + T[1, 1] * X[n, 1] + T[1, 2] * X[n, 2] + T[1, 3]
        z = T[2, 0] * X[n, 0] + T[2, 1] * X[n, 1] + T[2, 2] * X[n, 2] + T[2, 3]
        valid[n] = z > MIN_DEPTH and z < np.inf and abs(x) < MAX_TAN * z and abs(y) < MAX_TAN * z
        if not valid[n]:
            continue
        seen += 1
        a, b = x / z, y / z
        fx, fy = K[0] * root[n], K[1] * root[n]
        e[n, 0] = (K[0] * a + K[2] - u[n, 0]) * root[n]
        e[n, 1] = (K[1] * b + K[3] - u[n, 1]) * root[n]
        J[n, 0, 0], J[n, 0, 1], J[n, 0, 2] = fx / z, 0.0, -fx * a / z
        J[n, 1, 0], J[n, 1, 1], J[n, 1, 2] = 0.0, fy / z, -fy * b / z
        J[n, 0, 3], J[n, 0, 4], J[n, 0, 5] = -fx * a * b, fx * (1.0 + a * a), -fx * b
        J[n, 1, 3], J[n, 1, 4], J[n, 1, 5] = -fy * (1.0 + b * b), fy * a * b, fy * a
    return seen


@njit(cache=True)
def _scale(e, valid, seen, least):
    """Scale of the errors from the median norm."""
    if seen == 0:
        return np.inf
    size, k = np.empty(seen), 0
    for n in range(e.shape[0]):
        if valid[n]:
            size[k] = np.hypot(e[n, 0], e[n, 1])
            k += 1
    return max(MAD_NORM_2D * np.median(size), least)


@njit(cache=True)
def _weigh(e, J, valid, c, w, H, g):
    """Tukey's weights, and the normal equations; how many weights are not zero."""
    H[:], g[:], held = 0.0, 0.0, 0
    for n in range(e.shape[0]):
        w[n] = 0.0
        if not valid[n]:
            continue
        t = np.hypot(e[n, 0], e[n, 1]) / c
        s = max(1.0 - t * t, 0.0)
        w[n] = s * s
        if w[n] == 0.0:
            continue
        held += 1
        for i in range(6):
            p, q = w[n] * J[n, 0, i], w[n] * J[n, 1, i]
            g[i] += p * e[n, 0] + q * e[n, 1]
            for j in range(i + 1):
                H[i, j] += p * J[n, 0, j] + q * J[n, 1, j]
    for i in range(6):
        for j in range(i):
            H[j, i] = H[i, j]
    return held


@njit(cache=True)
def _trouble(H, held):
    if held < LEAST_POINTS:
        return FEW
    scaled = np.empty((6, 6))
    for i in range(6):
        if not H[i, i] > 0.0:
            return UNDETERMINED
        for j in range(6):
            scaled[i, j] = H[i, j] / np.sqrt(H[i, i]) / np.sqrt(H[j, j])
    values = np.linalg.eigvalsh(scaled)
    return FINE if values[5] <= WORST * values[0] else UNDETERMINED


@njit(cache=True)
def _moved(T, mu):
    """Exp(mu) T."""
    p, q, r = mu[3], mu[4], mu[5]
    squared = p * p + q * q + r * r
    theta = np.sqrt(squared)
    if theta < 1e-3:
        a = 1.0 - squared / 6.0 * (1.0 - squared / 20.0)
        b = 0.5 - squared / 24.0 * (1.0 - squared / 30.0)
        d = 1.0 / 6.0 - squared / 120.0 * (1.0 - squared / 42.0)
    else:
        a, b = np.sin(theta) / theta, (1.0 - np.cos(theta)) / squared
        d = (1.0 - a) / squared
    W = np.array([[0.0, -r, q], [r, 0.0, -p], [-q, p, 0.0]])
    WW = W @ W
    E = np.eye(4)
    E[:3, :3] += a * W + b * WW
    E[:3, 3] = (np.eye(3) + b * W + d * WW) @ mu[:3]
    return E @ T


@kernel(
    *(given(1), given(2), given(2), given(2), given(1), types.float64, types.int64, types.float64),
    returns=types.Tuple(
        (
            types.Array(types.float64, 2, "C"),
            types.Array(types.float64, 1, "C"),
            types.Array(types.float64, 2, "C"),
            types.Array(types.float64, 1, "C"),
        )
    ),
)
def pinhole_steps(K, T_start, X, u, root, c, steps, least):
    """Twin of :func:`vslam_ref.estimation.pose_tracking._pinhole_steps`."""
    n = X.shape[0]
    T = T_start.copy()
    e, J, valid, w = np.zeros((n, 2)), np.zeros((n, 2, 6)), np.zeros(n, np.bool_), np.zeros(n)
    H, g, sigma, trouble = np.zeros((6, 6)), np.zeros(6), np.inf, FINE
    for step in range(steps + 1):
        seen = _errors(K, T, X, u, root, e, J, valid)
        sigma = _scale(e, valid, seen, least)
        trouble = _trouble(H, _weigh(e, J, valid, c * sigma, w, H, g))
        if trouble != FINE or step == steps:
            break
        T = _moved(T, -np.linalg.solve(H, g))
    return T, w, H, np.array([sigma, float(trouble)])
