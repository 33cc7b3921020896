"""Numba twins of EKF-SLAM's hot loops; same signatures as the NumPy functions they stand for.

One pass per run of the batch, fixed small inner loops, no temporaries of the size of P.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from vslam_ref._kernels._signature import changed, given, kernel, made


@njit(cache=True)
def _measured_rows(b, P_pp, P_pm, P_mm, H_p, H_l, columns, W_p, W_m):
    """H P, row by row: W_p (k, p) and W_m (k, M)."""
    p, M = P_pp.shape[1], P_mm.shape[1]
    for i in range(columns.shape[0]):
        c0 = columns[i]
        for r in range(2):
            a = 2 * i + r
            h0, h1 = H_l[b, i, r, 0], H_l[b, i, r, 1]
            for c in range(M):
                W_m[a, c] = h0 * P_mm[b, c0, c] + h1 * P_mm[b, c0 + 1, c]
            for q in range(p):
                W_p[a, q] = h0 * P_pm[b, q, c0] + h1 * P_pm[b, q, c0 + 1]
            for t in range(p):
                h = H_p[b, i, r, t]
                if h != 0.0:
                    for c in range(M):
                        W_m[a, c] += h * P_pm[b, t, c]
                    for q in range(p):
                        W_p[a, q] += h * P_pp[b, t, q]


@njit(cache=True)
def _cholesky(S, L):
    """Lower Cholesky factor of S into L; raises as NumPy does when S is not positive definite."""
    for i in range(S.shape[0]):
        for j in range(i + 1):
            v = S[i, j]
            for q in range(j):
                v -= L[i, q] * L[j, q]
            if i == j:
                if not v > 0.0:
                    raise np.linalg.LinAlgError("Matrix is not positive definite")
                L[i, i] = np.sqrt(v)
            else:
                L[i, j] = v / L[j, j]


@njit(cache=True)
def _downdate(b, W_p, W_m, P_pp, P_pm, P_mm, row):
    """P -= W^T W in the three blocks, the lower triangle of P_mm mirrored."""
    k, p = W_p.shape
    M = W_m.shape[1]
    for q in range(p):
        for i in range(k):
            w = W_p[i, q]
            for r in range(p):
                P_pp[b, q, r] -= w * W_p[i, r]
            for c in range(M):
                P_pm[b, q, c] -= w * W_m[i, c]
    for r in range(M):
        for c in range(r + 1):
            row[c] = P_mm[b, r, c]
        for i in range(k):
            w = W_m[i, r]
            for c in range(r + 1):
                row[c] -= w * W_m[i, c]
        for c in range(r + 1):
            P_mm[b, r, c] = row[c]
        for c in range(r):
            P_mm[b, c, r] = row[c]


@njit(cache=True)
def _wrap(a):
    """Angle in (-pi, pi]."""
    if -np.pi < a <= np.pi:
        return a
    turned = np.pi - (np.pi - a) % (2.0 * np.pi)
    return np.pi if turned <= -np.pi else turned


@kernel(
    *(changed(2), changed(2), changed(3), changed(3), changed(3)),
    *(given(4), given(4), given(1, types.int64), given(2), given(3)),
    returns=made(3),
)
def landmark_update(x_p, x_m, P_pp, P_pm, P_mm, H_p, H_l, columns, innovation, cov_z):
    """Twin of :func:`vslam_ref.filters.block_covariance.landmark_update`."""
    B, p = x_p.shape
    M = x_m.shape[1]
    m = columns.shape[0]
    k = 2 * m
    S_all = np.empty((B, k, k))
    W_p, W_m = np.empty((k, p)), np.empty((k, M))
    L, y = np.empty((k, k)), np.empty(k)
    row = np.empty(M)
    for b in range(B):
        _measured_rows(b, P_pp, P_pm, P_mm, H_p, H_l, columns, W_p, W_m)
        for i in range(m):
            for j in range(m):
                c = columns[j]
                for r in range(2):
                    for s in range(2):
                        a = 2 * i + r
                        v = W_m[a, c] * H_l[b, j, s, 0] + W_m[a, c + 1] * H_l[b, j, s, 1]
                        for q in range(p):
                            v += W_p[a, q] * H_p[b, j, s, q]
                        if i == j:
                            v += cov_z[i, r, s]
                        S_all[b, a, 2 * j + s] = v
        _cholesky(S_all[b], L)
        for i in range(k):
            t = innovation[b, i]
            for j in range(i):
                f = L[i, j]
                t -= f * y[j]
                for q in range(p):
                    W_p[i, q] -= f * W_p[j, q]
                for c in range(M):
                    W_m[i, c] -= f * W_m[j, c]
            f = 1.0 / L[i, i]
            y[i] = t * f
            for q in range(p):
                W_p[i, q] *= f
            for c in range(M):
                W_m[i, c] *= f
        for i in range(k):
            for q in range(p):
                x_p[b, q] += W_p[i, q] * y[i]
            for c in range(M):
                x_m[b, c] += W_m[i, c] * y[i]
        _downdate(b, W_p, W_m, P_pp, P_pm, P_mm, row)
    return S_all


@kernel(changed(2), changed(3), changed(3), given(2), given(1), given(1), given(3))
def ekf_predict(x_p, P_pp, P_pm, at, ds, dalpha, cov):
    """Twin of :func:`vslam_ref.filters.ekf_step.ekf_predict`."""
    M = P_pm.shape[2]
    for b in range(x_p.shape[0]):
        c, s, d = np.cos(at[b, 0]), np.sin(at[b, 0]), at[b, 1]
        x_p[b, 0] += ds[b] * np.cos(x_p[b, 2])
        x_p[b, 1] += ds[b] * np.sin(x_p[b, 2])
        x_p[b, 2] = _wrap(x_p[b, 2] + dalpha[b])
        f0, f1 = -d * s, d * c
        P = P_pp[b]
        for q in range(3):
            P[0, q] += f0 * P[2, q]
            P[1, q] += f1 * P[2, q]
        for q in range(3):
            P[q, 0] += f0 * P[q, 2]
            P[q, 1] += f1 * P[q, 2]
        q00, q01, q11 = cov[b, 0, 0], cov[b, 0, 1], cov[b, 1, 1]
        P[0, 0] += c * c * q00
        P[0, 1] += c * s * q00
        P[1, 0] += c * s * q00
        P[1, 1] += s * s * q00
        P[0, 2] += c * q01
        P[2, 0] += c * q01
        P[1, 2] += s * q01
        P[2, 1] += s * q01
        P[2, 2] += q11
        for j in range(M):
            P_pm[b, 0, j] += f0 * P_pm[b, 2, j]
            P_pm[b, 1, j] += f1 * P_pm[b, 2, j]


@kernel(
    *(changed(2), changed(2), changed(3), changed(3), changed(3)),
    *(given(1, types.int64), given(3), given(3)),
    returns=types.Tuple((made(2), made(3))),
)
def ekf_update(x_p, x_m, P_pp, P_pm, P_mm, columns, z, cov_z):
    """Twin of :func:`vslam_ref.filters.ekf_step.ekf_update`."""
    B, m = z.shape[0], z.shape[1]
    innovation = np.empty((B, 2 * m))
    H_p, H_l = np.empty((B, m, 2, 3)), np.empty((B, m, 2, 2))
    for b in range(B):
        c, s = np.cos(x_p[b, 2]), np.sin(x_p[b, 2])
        for j in range(m):
            dx, dy = x_m[b, columns[j]] - x_p[b, 0], x_m[b, columns[j] + 1] - x_p[b, 1]
            ahead, left = c * dx + s * dy, c * dy - s * dx
            innovation[b, 2 * j] = z[b, j, 0] - ahead
            innovation[b, 2 * j + 1] = z[b, j, 1] - left
            H_l[b, j, 0, 0], H_l[b, j, 0, 1], H_l[b, j, 1, 0], H_l[b, j, 1, 1] = c, s, -s, c
            H_p[b, j, 0, 0], H_p[b, j, 0, 1], H_p[b, j, 0, 2] = -c, -s, left
            H_p[b, j, 1, 0], H_p[b, j, 1, 1], H_p[b, j, 1, 2] = s, -c, -ahead
    S = landmark_update(x_p, x_m, P_pp, P_pm, P_mm, H_p, H_l, columns, innovation, cov_z)
    for b in range(B):
        x_p[b, 2] = _wrap(x_p[b, 2])
    return innovation, S


@kernel(
    *(changed(2), changed(2), changed(3), changed(3), changed(3), given(1), given(1), given(3)),
    *(given(1, types.int64), given(3), given(3)),
    returns=types.Tuple((made(2), made(3))),
)
def ekf_step(x_p, x_m, P_pp, P_pm, P_mm, ds, dalpha, cov, columns, z, cov_z):
    """Twin of :func:`vslam_ref.filters.ekf_step.ekf_step`."""
    at = np.empty((x_p.shape[0], 2))
    for b in range(x_p.shape[0]):
        at[b, 0], at[b, 1] = x_p[b, 2], ds[b]
    ekf_predict(x_p, P_pp, P_pm, at, ds, dalpha, cov)
    return ekf_update(x_p, x_m, P_pp, P_pm, P_mm, columns, z, cov_z)
