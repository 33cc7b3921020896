"""Numba twins of the SLAM filters' hot loops; same signatures as the NumPy functions they stand for.

One pass per run of the batch, fixed small inner loops, no temporaries of the size of P.  Every kernel
has one signature, for arrays of any strides: no second compilation when a map is full or a run alone.
This module is imported at the first accelerated call, so that is when the cache is read.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types


def _given(ndim, dtype=types.float64):
    """Type of an array that is only read; it may be a broadcast view."""
    return types.Array(dtype, ndim, "A", readonly=True)


def _changed(ndim, dtype=types.float64):
    """Type of an array that is changed in place."""
    return types.Array(dtype, ndim, "A")


def _kernel(*arguments, returns=types.void):
    """Compile for one signature and keep the machine code on disk."""
    return njit(returns(*arguments), cache=True)


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


@njit(cache=True)
def _step_rows(v, ds, m):
    """Apply the pose transition to (x, y, sin, cos), the first four of v, in place."""
    s, c = v[2], v[3]
    v[0] += ds * c
    v[1] += ds * s
    v[2] = m.real * s - m.imag * c
    v[3] = m.imag * s + m.real * c


@_kernel(
    *(_changed(2), _changed(2), _changed(3), _changed(3), _changed(3)),
    *(_given(4), _given(4), _given(1, types.int64), _given(2), _given(3)),
    returns=types.Array(types.float64, 3, "C"),
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


@_kernel(_changed(2), _changed(3), _changed(3), _given(2), _given(1), _given(1), _given(3))
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


@_kernel(_changed(2), _changed(3), _changed(2, types.complex128), _given(2), _given(3))
def reduced_predict(x_p, P_a, frame, control, cov):
    """Twin of :func:`vslam_ref.filters.carleman_ekf.reduced.reduced_predict`."""
    J = np.empty((8, 5))  # rows: x, y, sin, cos, Re A, Im A, Re g, Im g
    C = np.empty((8, 5))
    for b in range(x_p.shape[0]):
        ds = control[b, 0]
        m = complex(control[b, 1], control[b, 2])
        t = complex(control[b, 3], control[b, 4])
        s, c = x_p[b, 2], x_p[b, 3]
        tau = frame[b, 1]
        turned = m * frame[b, 0]
        A, g, u = 1.0 / m, -tau / turned, -1.0 / turned
        J[:] = 0.0
        J[0, 0], J[1, 0] = c, s
        J[2, 1], J[2, 2] = s, -c
        J[3, 1], J[3, 2] = c, s
        J[4, 1], J[4, 2] = A.real, -A.imag
        J[5, 1], J[5, 2] = A.imag, A.real
        J[6, 1], J[6, 2], J[6, 3], J[6, 4] = g.real, -g.imag, u.real, -u.imag
        J[7, 1], J[7, 2], J[7, 3], J[7, 4] = g.imag, g.real, u.imag, u.real
        for i in range(8):
            for j in range(5):
                v = 0.0
                for q in range(5):
                    v += J[i, q] * cov[b, q, j]
                C[i, j] = v
        P = P_a[b]
        _step_rows(x_p[b], ds, m)
        for j in range(8):
            _step_rows(P[:, j], ds, m)
        for i in range(8):
            _step_rows(P[i], ds, m)
        for i in range(8):
            for j in range(i + 1):
                v = 0.0
                for q in range(5):
                    v += C[i, q] * J[j, q]
                P[i, j] += v
                if j < i:
                    P[j, i] += v
        frame[b, 0] = turned
        frame[b, 1] = m * tau + t
        frame[b, 2] += ds * frame[b, 3]
        frame[b, 3] *= complex(m.real, -m.imag)


@_kernel(_changed(2), _changed(3), _changed(2, types.complex128), _given(1), _given(1), _given(3))
def reduced_predict_first_order(x_p, P_a, frame, ds, dalpha, cov):
    """Twin of :func:`vslam_ref.filters.carleman_ekf.reduced.reduced_predict_first_order`.

    Written out for noise in (ds, dalpha) only: it moves (x, y) along the old heading, (sin, cos) along the
    tangent, A by -i dalpha and g by -dds / c_old + i (m tau + t) dalpha / c_new.
    """
    G = np.zeros((8, 2))
    G[5, 1] = -1.0
    for b in range(x_p.shape[0]):
        d, m = ds[b], complex(np.cos(dalpha[b]), -np.sin(dalpha[b]))
        c_old = frame[b, 0]
        c_new, tau = m * c_old, m * frame[b, 1] + d * m
        along, turn = -1.0 / c_old, 1j * tau / c_new
        G[0, 0], G[1, 0] = x_p[b, 3], x_p[b, 2]
        P = P_a[b]
        _step_rows(x_p[b], d, m)
        for j in range(8):
            _step_rows(P[:, j], d, m)
        for i in range(8):
            _step_rows(P[i], d, m)
        G[2, 1], G[3, 1] = x_p[b, 3], -x_p[b, 2]
        G[6, 0], G[7, 0], G[6, 1], G[7, 1] = along.real, along.imag, turn.real, turn.imag
        q00, q01, q10, q11 = cov[b, 0, 0], cov[b, 0, 1], cov[b, 1, 0], cov[b, 1, 1]
        for i in range(8):
            u, v = G[i, 0] * q00 + G[i, 1] * q10, G[i, 0] * q01 + G[i, 1] * q11
            for j in range(i + 1):
                w = u * G[j, 0] + v * G[j, 1]
                P[i, j] += w
                if j < i:
                    P[j, i] += w
        frame[b, 0] = c_new
        frame[b, 1] = tau
        frame[b, 2] += d * frame[b, 3]
        frame[b, 3] *= complex(m.real, -m.imag)


@_kernel(
    *(_given(2), _changed(3), _changed(3), types.int64, _changed(3), _changed(2, types.complex128)),
)
def reduced_apply(x_m, P_pm, P_mm, b, P_a, frame):
    """Twin of :func:`vslam_ref.filters.carleman_ekf.reduced.reduced_apply`."""
    B, M = x_m.shape
    E = np.zeros((4, M))
    NE = np.empty((4, M))
    row = np.empty(M)
    for run in range(B):
        for j in range(0, M, b):
            re, im = x_m[run, j], x_m[run, j + 1]
            E[0, j], E[1, j], E[2, j] = re, -im, 1.0
            E[0, j + 1], E[1, j + 1], E[3, j + 1] = im, re, 1.0
        D, e = frame[run, 2], frame[run, 3]
        for j in range(M):
            s, c = P_pm[run, 2, j], P_pm[run, 3, j]
            P_pm[run, 0, j] += D.real * c - D.imag * s
            P_pm[run, 1, j] += D.imag * c + D.real * s
            P_pm[run, 2, j] = e.imag * c + e.real * s
            P_pm[run, 3, j] = e.real * c - e.imag * s
        for i in range(4):
            for q in range(4):
                f = P_a[run, i, 4 + q]
                for j in range(M):
                    P_pm[run, i, j] += f * E[q, j]
            for j in range(M):
                v = 0.0
                for q in range(4):
                    v += P_a[run, 4 + i, 4 + q] * E[q, j]
                NE[i, j] = v
        for r in range(0, M, b):
            for k in range(r, r + 2):  # world coordinates, when carried, gain no noise
                for c in range(k + 1):
                    row[c] = P_mm[run, k, c]
                for i in range(4):
                    f = E[i, k]
                    for c in range(k + 1):
                        row[c] += f * NE[i, c]
                for c in range(k + 1):
                    P_mm[run, k, c] = row[c]
                    P_mm[run, c, k] = row[c]
        P_a[run, 4:, :] = 0.0
        P_a[run, :, 4:] = 0.0
        frame[run, 2] = 0.0
        frame[run, 3] = 1.0


@_kernel(
    *(_changed(2), _changed(2), _changed(3), _changed(3), _changed(3)),
    *(_given(1, types.int64), _given(3), _given(3)),
    returns=types.Tuple((types.Array(types.float64, 2, "C"), types.Array(types.float64, 3, "C"))),
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


@_kernel(
    *(_changed(2), _changed(2), _changed(3), _changed(3), _changed(3), _given(1), _given(1), _given(3)),
    *(_given(1, types.int64), _given(3), _given(3)),
    returns=types.Tuple((types.Array(types.float64, 2, "C"), types.Array(types.float64, 3, "C"))),
)
def ekf_step(x_p, x_m, P_pp, P_pm, P_mm, ds, dalpha, cov, columns, z, cov_z):
    """Twin of :func:`vslam_ref.filters.ekf_step.ekf_step`."""
    at = np.empty((x_p.shape[0], 2))
    for b in range(x_p.shape[0]):
        at[b, 0], at[b, 1] = x_p[b, 2], ds[b]
    ekf_predict(x_p, P_pp, P_pm, at, ds, dalpha, cov)
    return ekf_update(x_p, x_m, P_pp, P_pm, P_mm, columns, z, cov_z)
