"""Numba twins of bundle adjustment's elimination: points out, and back again."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

_int = types.int64
_array = lambda n: types.Array(types.float64, n, "C")  # noqa: E731


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
def _same_lens(columns, i, j, own):
    """Whether two views have the same columns of the lens; one column alone may be none in both."""
    same = True
    for a in range(own, columns.shape[1]):
        same = same and columns[i, a] == columns[j, a]
    return same


def _block_of(width):
    """Make S[row:, column:] -= V Z^T for blocks of a width that the compiler knows, and its lower triangle.

    The loops are unrolled then.  Indices are unsigned: a signed one may be negative, and would be looked at.
    """

    @njit(cache=True)
    def subtract(S, row, column, V, s, t):
        row, column, s, t = np.uint64(row), np.uint64(column), np.uint64(s), np.uint64(t)
        for i in range(width):
            a = np.uint64(i)
            v0, v1, v2 = V[s, a, 0], V[s, a, 1], V[s, a, 2]
            for j in range(width):
                b = np.uint64(j)
                S[row + a, column + b] -= v0 * V[t, b, 0] + v1 * V[t, b, 1] + v2 * V[t, b, 2]

    @njit(cache=True)
    def subtract_own(S, row, V, s):
        row, s = np.uint64(row), np.uint64(s)
        for i in range(width):
            a = np.uint64(i)
            v0, v1, v2 = V[s, a, 0], V[s, a, 1], V[s, a, 2]
            for j in range(i + 1):
                b = np.uint64(j)
                S[row + a, row + b] -= v0 * V[s, b, 0] + v1 * V[s, b, 1] + v2 * V[s, b, 2]

    return subtract, subtract_own


_subtract_6, _subtract_own_6 = _block_of(6)  # poses
_subtract_9, _subtract_own_9 = _block_of(9)  # poses with a lens of their own, as BAL has them


@njit(cache=True)
def _subtract_pairs(S, parts, V, columns, span):
    """S -= V V^T, lower triangle, for all pairs of parts."""
    for s in range(parts):
        first, last, w = span[s, 0], span[s, 1], span[s, 2]
        known = w if span[s, 3] and (w == 6 or w == 9) else 0
        for t in range(parts):
            if span[t, 0] > last:  # the whole block lies above the diagonal
                continue
            below = span[s, 3] and span[t, 3] and span[t, 1] < first
            if below and known == 6 and span[t, 2] == 6:
                _subtract_6(S, first, span[t, 0], V, s, t)
            elif below and known == 9 and span[t, 2] == 9:
                _subtract_9(S, first, span[t, 0], V, s, t)
            elif below:
                _subtract_block(S, first, span[t, 0], V[s, :w], V[t, : span[t, 2]])
            elif s == t and known == 6:
                _subtract_own_6(S, first, V, s)
            elif s == t and known == 9:
                _subtract_own_9(S, first, V, s)
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
    given(1, _int),
    returns=types.Tuple((_array(2), _array(1))),
)
def schur_complement(B, g_view, g_point, W, M, view, columns, size, offsets):
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
    # parts: one an observation and one for each shared lens that sees the point
    V, at, span = (
        np.empty((2 * longest, d, 3)),
        np.empty((2 * longest, d), np.int64),
        np.empty((2 * longest, 4), np.int64),
    )
    W, columns = np.ascontiguousarray(W), np.ascontiguousarray(columns)  # no copies, mostly; quicker to index
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
            if shared and (o == begin or not _same_lens(columns, view[o], view[o - 1], own)):
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
