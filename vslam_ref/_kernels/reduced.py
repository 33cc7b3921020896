"""Numba twins of the reduced Carleman filter's hot loops."""

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
    load_tile,
    only_seen,
    require_positive,
    room_for_innovation,
    shrink_rows,
    whiten,
)
from vslam_ref._kernels._signature import changed, given, kernel, njit, unpacks


@njit(cache=True)
def _step_rows(v, D, e):
    """P <- p + D h, h <- e h for (x, y, sin, cos), the first four of v, in place."""
    s, c = v[2], v[3]
    v[0] += D.real * c - D.imag * s
    v[1] += D.imag * c + D.real * s
    v[2] = e.imag * c + e.real * s
    v[3] = e.real * c - e.imag * s


@njit(cache=True)
def _move(x, P, frame, D, e):
    """Take the pose, the rows and columns of P (8, 8) and what is pending in the frame along."""
    _step_rows(x, D, e)
    for j in range(8):
        _step_rows(P[:, j], D, e)
    for i in range(8):
        _step_rows(P[i], D, e)
    frame[2] += D * frame[3]
    frame[3] *= e


@njit(cache=True)
def _add_control_noise(G, cov, N):
    """Lower triangle of N (8, 8) += G cov G^T."""
    r = cov.shape[0]
    for i in range(8):
        for q in range(r):
            v = 0.0
            for t in range(r):
                v += G[i, t] * cov[t, q]
            if v == 0.0:  # most of G is
                continue
            for j in range(i + 1):
                N[i, j] += v * G[j, q]


@njit(cache=True)
def _add_symmetric(N, P):
    """P += N, given by its lower triangle; N starts afresh."""
    for i in range(8):
        for j in range(i):
            P[i, j] += N[i, j]
            P[j, i] += N[i, j]
        P[i, i] += N[i, i]
    N[:] = 0.0


@njit(cache=True)
def _inverse(c):
    """1 / c for a number near the unit circle, without the care that division takes."""
    return c.conjugate() / (c.real * c.real + c.imag * c.imag)


@njit(cache=True)
def _put(G, row, column, value):
    """A complex noise of a real number into the two rows of a complex state."""
    G[row, column], G[row + 1, column] = value.real, value.imag


@kernel(changed(2), changed(3), changed(2, types.complex128), given(3), given(4))
def reduced_predict_in_place(x_p, P_a, frame, control, cov):
    """Twin of :func:`vslam_ref.filters.carleman_ekf.reduced_step.reduced_predict_in_place`.

    Control by control.
    """
    G, N = np.zeros((8, 5)), np.zeros((8, 8))  # rows: x, y, sin, cos, Re A, Im A, Re g, Im g
    for b in range(x_p.shape[0]):
        h, D, e = complex(x_p[b, 3], x_p[b, 2]), complex(0.0, 0.0), complex(1.0, 0.0)
        for k in range(control.shape[1]):
            ds = control[b, k, 0]
            m = complex(control[b, k, 1], control[b, k, 2])
            t = complex(control[b, k, 3], control[b, k, 4])
            tau, c = frame[b, 1], m * frame[b, 0]
            _put(G, 0, 0, e * h)
            D += ds * e
            e *= m.conjugate()
            for column, unit in ((1, complex(1.0, 0.0)), (2, complex(0.0, 1.0))):
                A = unit / m
                _put(G, 0, column, -D * h * A.conjugate())
                _put(G, 2, column, 1j * h.conjugate() * A)
                _put(G, 4, column, A)
                _put(G, 6, column, -tau * unit / c)
                _put(G, 6, column + 2, -unit / c)
            _add_control_noise(G, cov[b, k], N)
            frame[b, 0], frame[b, 1] = c, m * tau + t
        _add_symmetric(N, P_a[b])
        _move(x_p[b], P_a[b], frame[b], D, e)


@kernel(changed(2), changed(3), changed(2, types.complex128), given(2), given(2), given(4))
def reduced_predict_first_order_in_place(x_p, P_a, frame, ds, dalpha, cov):
    """Twin of :func:`vslam_ref.filters.carleman_ekf.reduced_step.reduced_predict_first_order_in_place`.

    Written out for noise in (ds, dalpha): with dm = -i m dalpha, A is -i dalpha and g is
    -dds / c_old + i tau_new dalpha / c_new.
    """
    G, N = np.zeros((8, 2)), np.zeros((8, 8))
    _put(G, 4, 1, complex(0.0, -1.0))
    for b in range(x_p.shape[0]):
        h, D, e = complex(x_p[b, 3], x_p[b, 2]), complex(0.0, 0.0), complex(1.0, 0.0)
        c, tau = frame[b, 0], frame[b, 1]
        _put(G, 2, 1, h.conjugate())
        for k in range(ds.shape[1]):
            d, m = ds[b, k], complex(np.cos(dalpha[b, k]), -np.sin(dalpha[b, k]))
            _put(G, 0, 0, e * h)
            _put(G, 6, 0, -_inverse(c))
            D += d * e
            e *= m.conjugate()
            c *= m
            tau = m * (tau + d)
            _put(G, 0, 1, -1j * D * h)
            _put(G, 6, 1, 1j * tau * _inverse(c))
            _add_control_noise(G, cov[b, k], N)
        frame[b, 0], frame[b, 1] = c, tau
        _add_symmetric(N, P_a[b])
        _move(x_p[b], P_a[b], frame[b], D, e)


@njit(cache=True)
def _noise_rows(x_m, b, E):
    """Columns of E (4, M) for a landmark rho: d rho = A rho + g."""
    for j in range(0, x_m.shape[0], b):
        re, im = x_m[j], x_m[j + 1]
        E[0, j], E[1, j], E[2, j] = re, -im, 1.0
        E[0, j + 1], E[1, j + 1], E[3, j + 1] = im, re, 1.0


@njit(cache=True)
def _times_E(N, E, row):
    """Row += N (4,) E."""
    f, g, s, t = N[0], N[1], N[2], N[3]
    p, q, r, u = E[0], E[1], E[2], E[3]
    for j in range(row.shape[0]):
        row[j] += f * p[j] + g * q[j] + s * r[j] + t * u[j]


@njit(cache=True)
def _apply_to_pose(E, P_pm, P_a, frame, NE):
    """P_pm <- Phi P_pm + N_pg E, and NE = N_gg E for the map."""
    D, e = frame[2], frame[3]
    x, y = in_one_piece(P_pm[0]), in_one_piece(P_pm[1])
    sin, cos = in_one_piece(P_pm[2]), in_one_piece(P_pm[3])
    for j in range(E.shape[1]):
        s, c = sin[j], cos[j]
        x[j] += D.real * c - D.imag * s
        y[j] += D.imag * c + D.real * s
        sin[j] = e.imag * c + e.real * s
        cos[j] = e.real * c - e.imag * s
    NE[:] = 0.0
    for i in range(4):
        _times_E(P_a[i, 4:], E, in_one_piece(P_pm[i]))
        _times_E(P_a[4 + i, 4:], E, NE[i])


@njit(cache=True)
def _add_noise(re, im, NE, even, odd):
    """Rows of P_mm of the landmark rho = re + i im += their part of E^T N_gg E.

    Two loops: one with six arrays asks for more checks of overlap than the compiler makes.
    """
    f, g, s, t = NE[0], NE[1], NE[2], NE[3]
    for c in range(even.shape[0]):
        even[c] += re * f[c] - im * g[c] + s[c]
    for c in range(odd.shape[0]):
        odd[c] += im * f[c] + re * g[c] + t[c]


@njit(cache=True)
def _add_noise_and_two(re, im, rows, W, r, even, odd):
    """:func:`_add_noise`, and minus four rows of W; ``rows`` are four of NE and four of W, a tile of each."""
    f, g, s, t, u, v, w, x = rows
    p, q, m, n = W[0, r], W[1, r], W[2, r], W[3, r]
    for c in range(even.shape[0]):
        even[c] += (re * f[c] - im * g[c] + s[c]) - p * u[c] - q * v[c] - m * w[c] - n * x[c]
    p, q, m, n = W[0, r + 1], W[1, r + 1], W[2, r + 1], W[3, r + 1]
    for c in range(odd.shape[0]):
        odd[c] += (im * f[c] + re * g[c] + t[c]) - p * u[c] - q * v[c] - m * w[c] - n * x[c]


@njit(cache=True)
def _change_map(W, tile, E, NE, noise, b, P_mm):
    """P_mm += E^T N_gg E - W^T W; ``tile`` and ``noise`` are room for tiles of W and of NE.

    The noise and the first two landmarks seen share a loop: seven rows are read for one that is written.
    """
    M, k = P_mm.shape[0], W.shape[0]
    for lo in range(0, M, TILE):
        hi = min(M, lo + TILE)
        load_tile(W, lo, tile)
        load_tile(NE, lo, noise)
        rows = noise[0], noise[1], noise[2], noise[3], tile[0], tile[1], tile[2 % k], tile[3 % k]
        for r in range(0, M, 2):
            even, odd = in_one_piece(P_mm[r])[lo:hi], in_one_piece(P_mm[r + 1])[lo:hi]
            first, re, im = 0, E[0, r], E[0, r + 1]
            if r % b == 0 and k >= 4:
                first = 4
                _add_noise_and_two(re, im, rows, W, r, even, odd)
            elif r % b == 0:
                _add_noise(re, im, noise, even, odd)
            shrink_rows(W, tile, first, r, even, odd)


@njit(cache=True)
def _forget(P_a, frame):
    P_a[4:, :] = 0.0
    P_a[:, 4:] = 0.0
    frame[2] = 0.0
    frame[3] = 1.0


_MAP = (given(2), changed(3), changed(3), types.int64, changed(3), changed(2, types.complex128))


@kernel(*_MAP)
def _apply_all(x_m, P_pm, P_mm, b, P_a, frame):
    check_rows(x_m, P_pm, P_mm)
    M = x_m.shape[1]
    E, NE = np.zeros((4, M)), np.empty((4, M))
    for run in range(x_m.shape[0]):
        _noise_rows(x_m[run], b, E)
        _apply_to_pose(E, P_pm[run], P_a[run], frame[run], NE)
        for r in range(0, M, b):
            even, odd = in_one_piece(P_mm[run, r]), in_one_piece(P_mm[run, r + 1])
            _add_noise(E[0, r], E[0, r + 1], NE, even, odd)
        _forget(P_a[run], frame[run])


@unpacks(_apply_all)
def reduced_apply_in_place(state, b, P_a, frame):
    """Twin of :func:`vslam_ref.filters.carleman_ekf.reduced_step.reduced_apply_in_place`."""
    _apply_all(state.x_m, state.P_pm, state.P_mm, b, P_a, frame)


@njit(cache=True)
def _turn_pairs(c, columns, W, S):
    """H P from rows of P, and (H P) H^T: multiply row pairs, then column pairs, by the real matrix of c."""
    for i in range(0, W.shape[0], 2):
        u, v = W[i], W[i + 1]
        for j in range(W.shape[1]):
            s, t = u[j], v[j]
            u[j], v[j] = c.real * s - c.imag * t, c.imag * s + c.real * t
    for i in range(W.shape[0]):
        w = W[i]
        for j in range(columns.shape[0]):
            s, t = w[columns[j]], w[columns[j] + 1]
            S[i, 2 * j], S[i, 2 * j + 1] = c.real * s - c.imag * t, c.imag * s + c.real * t


@njit(cache=True)
def _expect(x, P_pm, P, frame, columns, z, cov_z, NE, innovation, S, W):
    """Innovation, S and the map's part of W of one run, whose pending noise is in P_pm and NE already."""
    M, c, tau = x.shape[0], frame[0], frame[1]
    load_landmarks(P_pm, P, columns, W)
    for j in range(columns.shape[0]):
        at = columns[j]
        _add_noise(x[at], x[at + 1], NE, W[2 * j][:M], W[2 * j + 1][:M])
        predicted = c * complex(x[at], x[at + 1]) - tau
        innovation[2 * j] = z[j, 0] - predicted.real
        innovation[2 * j + 1] = z[j, 1] - predicted.imag
    _turn_pairs(c, columns, W, S)
    W[:, M + 4] = innovation
    add_noise(cov_z, S)


@njit(cache=True)
def _require_positive(x_m, P_pm, P_mm, P_a, frame, columns, z, cov_z, innovation, S):
    """Raise before anything is changed where S is singular in one of the runs: landmarks seen are enough."""
    k = 2 * columns.shape[0]
    x, P, Q, L, W = np.empty(k), np.empty((4, k)), np.empty((k, k)), np.empty((k, k)), np.empty((k, k + 5))
    E, NE, here = np.zeros((4, k)), np.empty((4, k)), np.arange(0, k, 2)
    for b in range(x_m.shape[0]):
        only_seen(x_m[b], P_pm[b], P_mm[b], columns, x, P, Q)
        _noise_rows(x, 2, E)
        _apply_to_pose(E, P, P_a[b], frame[b], NE)
        _expect(x, P, Q, frame[b], here, z[b], cov_z, NE, innovation[b], S[b], W)
        require_positive(S[b], L)


@kernel(
    *(changed(2), changed(2), *_MAP[1:]),
    *(given(1, types.int64), given(3), given(3), types.float64, changed(2), changed(3)),
)
def _update_all(x_p, x_m, P_pm, P_mm, b, P_a, frame, columns, z, cov_z, gate, innovation, S):
    check_rows(x_m, P_pm, P_mm)
    _require_positive(x_m, P_pm, P_mm, P_a, frame, columns, z, cov_z, innovation, S)
    k, M = 2 * columns.shape[0], x_m.shape[1]
    L, W, tile = np.empty((k, k)), np.empty((k, M + 5)), np.empty((k, min(M, TILE)))
    E, NE, noise = np.zeros((4, M)), np.empty((4, M)), np.empty((4, min(M, TILE)))
    for run in range(x_p.shape[0]):
        x, P = x_m[run], P_mm[run]
        _noise_rows(x, b, E)
        _apply_to_pose(E, P_pm[run], P_a[run], frame[run], NE)
        _expect(x, P_pm[run], P, frame[run], columns, z[run], cov_z, NE, innovation[run], S[run], W)
        whiten(S[run], L, W)
        apply_gate(gate, W)
        gain(W, x_p[run], x, P_a[run, :4, :4], P_pm[run])
        _change_map(W, tile, E, NE, noise, b, P)
        _forget(P_a[run], frame[run])


@unpacks(_update_all)
def reduced_update_in_place(state, b, P_a, frame, columns, z, cov_z, gate):
    """Twin of :func:`vslam_ref.filters.carleman_ekf.reduced_step.reduced_update_in_place`."""
    innovation, S = room_for_innovation(z)
    x_p, x_m, _, P_pm, P_mm = state
    _update_all(x_p, x_m, P_pm, P_mm, b, P_a, frame, columns, z, cov_z, gate, innovation, S)
    return innovation, S
