"""Numba twins of the reduced Carleman filter's hot loops."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from vslam_ref._kernels._signature import changed, given, kernel


@njit(cache=True)
def _step_rows(v, ds, m):
    """Apply the pose transition to (x, y, sin, cos), the first four of v, in place."""
    s, c = v[2], v[3]
    v[0] += ds * c
    v[1] += ds * s
    v[2] = m.real * s - m.imag * c
    v[3] = m.imag * s + m.real * c


@kernel(changed(2), changed(3), changed(2, types.complex128), given(2), given(3))
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


@kernel(changed(2), changed(3), changed(2, types.complex128), given(1), given(1), given(3))
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


@kernel(
    *(given(2), changed(3), changed(3), types.int64, changed(3), changed(2, types.complex128)),
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
