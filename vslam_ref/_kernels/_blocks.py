"""What the update kernels share, for one run of the batch: rows of P gathered, whitened and subtracted.

``W (k, M + p + 1)`` holds H P, the map's columns first, and the innovation in its last column.  The loops
take two rows at a time, a landmark's x and y.  They run from 0 along rows that lie in one piece: that is
what the compiler turns into vector instructions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic

from vslam_ref._kernels._signature import njit

TILE = 256
"""Columns at a time, so that their part of W stays in the fastest cache."""
SINGULAR = 64 * 2.0**-52
"""As in :mod:`vslam_ref.filters.block_covariance`."""


def _as_contiguous(_, row):
    def same(context, builder, signature, arguments):
        return impl_ret_borrowed(context, builder, signature.return_type, arguments[0])

    return types.Array(row.dtype, 1, "C")(row), same


in_one_piece: Any = intrinsic(_as_contiguous)
"""Look at a row as at a contiguous array, which :func:`check_rows` found it to be."""


def room_for_innovation(z):
    """Empty arrays (B, 2 m), (B, 2 m, 2 m) for the innovation of measurements z (B, m, 2) and its S."""
    B, m, _ = z.shape
    return np.empty((B, 2 * m)), np.empty((B, 2 * m, 2 * m))


@njit(cache=True)
def check_rows(x_m, P_pm, P_mm):
    """Raise unless the last axis is contiguous, as it is in any view of whole rows or their beginnings."""
    if not (x_m.strides[1] == P_pm.strides[2] == P_mm.strides[2] == P_mm.itemsize):
        raise ValueError("the last axis of x_m, P_pm and P_mm must be contiguous")


@njit(cache=True)
def load_landmarks(P_pm, P_mm, columns, W):
    """Rows of P of the landmarks seen, into W."""
    p, M = P_pm.shape
    for i in range(columns.shape[0]):
        for r in range(2):
            at, w, row = columns[i] + r, W[2 * i + r], in_one_piece(P_mm[columns[i] + r])
            for c in range(M):
                w[c] = row[c]
            for q in range(p):
                w[M + q] = P_pm[q, at]


@njit(cache=True)
def _cholesky(S, L):
    """Lower Cholesky factor of S, with the inverses of its diagonal; raises as NumPy does."""
    for j in range(S.shape[0]):
        v = S[j, j]
        for q in range(j):
            v -= L[j, q] * L[j, q]
        if not v > 0.0:
            raise np.linalg.LinAlgError("Matrix is not positive definite")
        f = 1.0 / np.sqrt(v)
        L[j, j] = f
        for i in range(j + 1, S.shape[0]):
            v = S[i, j]
            for q in range(j):
                v -= L[i, q] * L[j, q]
            L[i, j] = v * f


@njit(cache=True)
def require_positive(S, L):
    """Raise, as NumPy's form does, where a pivot of S is no more than rounding; L (k, k) is room."""
    _cholesky(S, L)
    for j in range(S.shape[0]):
        if not SINGULAR * S[j, j] * L[j, j] * L[j, j] < 1.0:  # the diagonal of L holds inverses
            raise np.linalg.LinAlgError("Matrix is not positive definite to rounding")


@njit(cache=True)
def only_seen(x_m, P_pm, P_mm, columns, x, P, Q):
    """Mean x (k,), cross covariance P (p, k) and covariance Q (k, k) of the landmarks seen alone."""
    for i in range(columns.shape[0]):
        for r in range(2):
            at, to = columns[i] + r, 2 * i + r
            x[to] = x_m[at]
            for q in range(P_pm.shape[0]):
                P[q, to] = P_pm[q, at]
            for j in range(columns.shape[0]):
                Q[to, 2 * j], Q[to, 2 * j + 1] = P_mm[at, columns[j]], P_mm[at, columns[j] + 1]


@njit(cache=True)
def whiten(S, L, W):
    """W <- L^-1 W with S = L L^T; L (k, k) is room for the factor."""
    _cholesky(S, L)
    for i in range(0, S.shape[0], 2):
        even, odd = W[i], W[i + 1]
        for j in range(0, i, 2):
            u, v = W[j], W[j + 1]
            a, b, d, e = L[i, j], L[i, j + 1], L[i + 1, j], L[i + 1, j + 1]
            for c in range(W.shape[1]):
                even[c] -= a * u[c] + b * v[c]
                odd[c] -= d * u[c] + e * v[c]
        a, b, e = L[i, i], L[i + 1, i], L[i + 1, i + 1]
        for c in range(W.shape[1]):
            even[c] *= a
            odd[c] = e * (odd[c] - b * even[c])


@njit(cache=True)
def add_noise(cov_z, S):
    """Covariances (m, 2, 2) of independent measurements onto the diagonal of S."""
    for j in range(cov_z.shape[0]):
        for r in range(2):
            for q in range(2):
                S[2 * j + r, 2 * j + q] += cov_z[j, r, q]


@njit(cache=True)
def apply_gate(gate, W):
    """Nothing of the whitened W is left where its last column, L^-1 innovation, is longer than the gate."""
    squared, last = 0.0, W.shape[1] - 1
    for i in range(W.shape[0]):
        squared += W[i, last] * W[i, last]
    if squared > gate:
        W[:] = 0.0


@njit(cache=True)
def gain(W, x_p, x_m, P_pp, P_pm):
    """X += W^T y, y the last column of the whitened W, and -= W^T W in the pose's blocks."""
    p, M = P_pm.shape
    map_mean = in_one_piece(x_m)
    for i in range(0, W.shape[0], 2):
        u, v = W[i], W[i + 1]
        y, z = u[M + p], v[M + p]
        for c in range(M):
            map_mean[c] += y * u[c] + z * v[c]
        for q in range(p):
            x_p[q] += y * u[M + q] + z * v[M + q]
            for r in range(p):
                P_pp[q, r] -= u[M + q] * u[M + r] + v[M + q] * v[M + r]
            a, b, row = u[M + q], v[M + q], in_one_piece(P_pm[q])
            for c in range(M):
                row[c] -= a * u[c] + b * v[c]


@njit(cache=True)
def load_tile(A, lo, tile):
    """Copy columns ``lo`` and on of A, as many as there are or fit, into ``tile``."""
    for i in range(A.shape[0]):
        a, t = A[i][lo:], tile[i]
        for c in range(min(a.shape[0], t.shape[0])):
            t[c] = a[c]


@njit(cache=True)
def shrink_rows(W, tile, first, r, even, odd):
    """Rows r and r + 1 of P_mm, ``even`` and ``odd``, -= their part of W^T W, from row ``first`` of W on.

    ``tile`` holds the columns of W that belong to those of the rows.
    """
    for i in range(first, W.shape[0], 2):
        u, v = tile[i], tile[i + 1]
        a, b, d, e = W[i, r], W[i + 1, r], W[i, r + 1], W[i + 1, r + 1]
        for c in range(even.shape[0]):
            even[c] -= a * u[c] + b * v[c]
            odd[c] -= d * u[c] + e * v[c]


@njit(cache=True)
def shrink_map(W, tile, P_mm):
    """P_mm -= W^T W, tile by tile of ``TILE`` columns; ``tile`` (k, at most TILE) is room for one of W.

    Whole rows are taken: P[r, c] and P[c, r] lose the same products in the same order, so P_mm stays
    symmetric to the last bit.
    """
    M = P_mm.shape[0]
    for lo in range(0, M, TILE):
        hi = min(M, lo + TILE)
        load_tile(W, lo, tile)
        for r in range(0, M, 2):
            shrink_rows(W, tile, 0, r, in_one_piece(P_mm[r])[lo:hi], in_one_piece(P_mm[r + 1])[lo:hi])
