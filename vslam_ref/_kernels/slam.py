"""Numba twins of EKF-SLAM's hot loops; same signatures as the NumPy functions they stand for."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._blocks import (
    TILE,
    add_noise,
    apply_gate,
    check_rows,
    gain,
    in_one_piece,
    load_landmarks,
    only_seen,
    require_positive,
    room_for_innovation,
    shrink_map,
    whiten,
)
from vslam_ref._kernels._signature import changed, given, kernel, njit, unpacks


@njit(cache=True)
def _wrap(a):
    """Angle in (-pi, pi]."""
    if -np.pi < a <= np.pi:
        return a
    turned = np.pi - (np.pi - a) % (2.0 * np.pi)
    return np.pi if turned <= -np.pi else turned


@njit(cache=True)
def _predict(x, P, P_pm, ds, dalpha, cov):
    """Predict one run: B4, F and G of :func:`vslam_ref.filters.vehicle.motion_model`, and the covariance."""
    c, s = np.cos(x[2]), np.sin(x[2])
    x[0] += ds * c
    x[1] += ds * s
    x[2] = _wrap(x[2] + dalpha)
    f0, f1 = -ds * s, ds * c
    for q in range(3):
        P[0, q] += f0 * P[2, q]
        P[1, q] += f1 * P[2, q]
    for q in range(3):
        P[q, 0] += f0 * P[q, 2]
        P[q, 1] += f1 * P[q, 2]
    q00, q01, q11 = cov[0, 0], cov[0, 1], cov[1, 1]
    P[0, 0] += c * c * q00
    P[0, 1] += c * s * q00
    P[1, 0] += c * s * q00
    P[1, 1] += s * s * q00
    P[0, 2] += c * q01
    P[2, 0] += c * q01
    P[1, 2] += s * q01
    P[2, 1] += s * q01
    P[2, 2] += q11
    for j in range(P_pm.shape[1]):
        P_pm[0, j] += f0 * P_pm[2, j]
        P_pm[1, j] += f1 * P_pm[2, j]


@kernel(changed(2), changed(3), changed(3), given(1), given(1), given(3))
def _predict_all(x_p, P_pp, P_pm, ds, dalpha, cov):
    for b in range(x_p.shape[0]):
        _predict(x_p[b], P_pp[b], P_pm[b], ds[b], dalpha[b], cov[b])


@unpacks(_predict_all)
def ekf_predict_in_place(state, increment):
    """Twin of :func:`vslam_ref.filters.ekf_slam.ekf_predict_in_place`."""
    _predict_all(state.x_p, state.P_pp, state.P_pm, *increment)


@njit(cache=True)
def _in_vehicle_frame(c, s, x_p, x_m, column):
    """Landmark of a map column, seen from the pose: ahead and to the left."""
    dx, dy = x_m[column] - x_p[0], x_m[column + 1] - x_p[1]
    return c * dx + s * dy, c * dy - s * dx


@njit(cache=True)
def _expect(x_p, x_m, P_pp, P_pm, P_mm, columns, z, cov_z, innovation, S, W):
    """Innovation, S and W of one run: H v = R^T (v_landmark - v_position) + (left, -ahead) v_heading."""
    M = x_m.shape[0]
    c, s = np.cos(x_p[2]), np.sin(x_p[2])
    X, Y, T = in_one_piece(P_pm[0]), in_one_piece(P_pm[1]), in_one_piece(P_pm[2])
    load_landmarks(P_pm, P_mm, columns, W)
    for j in range(columns.shape[0]):
        ahead, left = _in_vehicle_frame(c, s, x_p, x_m, columns[j])
        u, v = W[2 * j], W[2 * j + 1]
        for i in range(M):
            dx, dy = u[i] - X[i], v[i] - Y[i]
            u[i] = c * dx + s * dy + left * T[i]
            v[i] = c * dy - s * dx - ahead * T[i]
        for q in range(3):
            dx, dy = u[M + q] - P_pp[0, q], v[M + q] - P_pp[1, q]
            u[M + q] = c * dx + s * dy + left * P_pp[2, q]
            v[M + q] = c * dy - s * dx - ahead * P_pp[2, q]
        u[M + 3] = innovation[2 * j] = z[j, 0] - ahead
        v[M + 3] = innovation[2 * j + 1] = z[j, 1] - left
    for j in range(columns.shape[0]):
        ahead, left = _in_vehicle_frame(c, s, x_p, x_m, columns[j])
        for a in range(S.shape[0]):
            w = W[a]
            dx, dy = w[columns[j]] - w[M], w[columns[j] + 1] - w[M + 1]
            S[a, 2 * j] = c * dx + s * dy + left * w[M + 2]
            S[a, 2 * j + 1] = c * dy - s * dx - ahead * w[M + 2]
    add_noise(cov_z, S)


@njit(cache=True)
def _require_positive(x_p, x_m, P_pp, P_pm, P_mm, columns, z, cov_z, innovation, S):
    """Raise before anything is changed where S is singular in one of the runs: landmarks seen are enough."""
    k = 2 * columns.shape[0]
    x, P, Q, L, W = np.empty(k), np.empty((3, k)), np.empty((k, k)), np.empty((k, k)), np.empty((k, k + 4))
    here = np.arange(0, k, 2)
    for b in range(x_p.shape[0]):
        only_seen(x_m[b], P_pm[b], P_mm[b], columns, x, P, Q)
        _expect(x_p[b], x, P_pp[b], P, Q, here, z[b], cov_z, innovation[b], S[b], W)
        require_positive(S[b], L)


@kernel(
    *(changed(2), changed(2), changed(3), changed(3), changed(3)),
    *(given(1, types.int64), given(3), given(3), types.float64, changed(2), changed(3)),
)
def _update_all(x_p, x_m, P_pp, P_pm, P_mm, columns, z, cov_z, gate, innovation, S):
    check_rows(x_m, P_pm, P_mm)
    _require_positive(x_p, x_m, P_pp, P_pm, P_mm, columns, z, cov_z, innovation, S)
    k, M = 2 * columns.shape[0], x_m.shape[1]
    L, W, tile = np.empty((k, k)), np.empty((k, M + 4)), np.empty((k, min(M, TILE)))
    for b in range(x_p.shape[0]):
        x, P = x_m[b], P_mm[b]
        _expect(x_p[b], x, P_pp[b], P_pm[b], P, columns, z[b], cov_z, innovation[b], S[b], W)
        whiten(S[b], L, W)
        apply_gate(gate, W)
        gain(W, x_p[b], x, P_pp[b], P_pm[b])
        shrink_map(W, tile, P)
        x_p[b, 2] = _wrap(x_p[b, 2])


@unpacks(_update_all)
def ekf_update_in_place(state, columns, z, cov_z, gate):
    """Twin of :func:`vslam_ref.filters.ekf_slam.ekf_update_in_place`."""
    innovation, S = room_for_innovation(z)
    _update_all(*state, columns, z, cov_z, gate, innovation, S)
    return innovation, S
