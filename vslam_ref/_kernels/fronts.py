"""Numba twin of a sparse symmetric solution: a Cholesky factor made of dense fronts, children first.

Each front is a dense matrix of all rows that its own columns reach.  Edges, and what the children left over,
are added up in it; its own columns are eliminated, and the rest waits on a stack for the parent.  It is held
as its upper triangle, so that the columns of the factor are rows here, and lie in one piece.
"""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit, unpacks

PANEL = 48
"""Rows that are eliminated by loops; what they take from the rest is a matrix product."""
STRIPE = 96
"""Rows of that product at a time, so that little is computed below the diagonal."""
FEW = 32
"""Fewer rows than this on either side, and loops do the product: they take less time than the call."""

_int = types.int64


@njit(cache=True)
def _take(U, k0, k1, j):
    """Row j of U, from the diagonal on, less what rows k0 to k1 contribute to it; three at a time."""
    out = U[j, j:]
    k = k0
    while k + 3 <= k1:
        a, b, c = U[k, j], U[k + 1, j], U[k + 2, j]
        A, B, C = U[k, j:], U[k + 1, j:], U[k + 2, j:]
        for i in range(len(out)):
            out[i] -= a * A[i] + b * B[i] + c * C[i]
        k += 3
    while k < k1:
        a, A = U[k, j], U[k, j:]
        for i in range(len(out)):
            out[i] -= a * A[i]
        k += 1


@njit(cache=True)
def _eliminate(U, own):
    """Turn the first rows of an upper triangle into the factor's; the others keep what is left."""
    n = len(U)
    for k0 in range(0, own, PANEL):
        k1 = min(k0 + PANEL, own)
        for j in range(k0, k1):
            _take(U, k0, j, j)
            if not U[j, j] > 0.0:
                return False
            scale = 1.0 / np.sqrt(U[j, j])
            for i in range(j, n):
                U[j, i] *= scale
        if k1 - k0 < FEW or n - k1 < FEW:
            for j in range(k1, n):
                _take(U, k0, k1, j)
            continue
        P = U[k0:k1, k1:].T.copy()
        for r in range(0, n - k1, STRIPE):
            s = min(r + STRIPE, n - k1)
            U[k1 + r : k1 + s, k1 + r :] -= np.dot(P[r:s], P[r:].T)
    return True


@njit(cache=True)
def _add_edges(U, data, indices, indptr, first, own, place, d):
    """Entries of the front's own columns, on and below the diagonal: as rows."""
    for c in range(own):
        column = first * d + c
        for at in range(indptr[column], indptr[column + 1]):
            row = np.int64(indices[at])
            if row >= column:
                U[c, place[row // d] * d + row % d] += data[at]


@njit(cache=True)
def _add_child(U, rest, rows, place, d):
    """What a child left over, in rows and columns of its own; its upper triangle."""
    for a in range(len(rows)):
        p = place[rows[a]] * d
        for i in range(d):
            into, given = U[p + i], rest[a * d + i]
            for b in range(a, len(rows)):
                q = place[rows[b]] * d
                for j in range(d):
                    into[q + j] += given[b * d + j]


@njit(cache=True)
def _forward(U, rows, x, v, d):
    """Solve for a front's own unknowns, and take them out of the equations below."""
    for a in range(len(rows)):
        for i in range(d):
            v[a * d + i] = x[rows[a] * d + i]
    for c in range(U.shape[0]):
        v[c] /= U[c, c]
        for k in range(c + 1, U.shape[1]):
            v[k] -= U[c, k] * v[c]
    for a in range(len(rows)):
        for i in range(d):
            x[rows[a] * d + i] = v[a * d + i]


@njit(cache=True)
def _backward(U, rows, x, v, d):
    """The same with the factor itself, from the last front to the first."""
    for a in range(len(rows)):
        for i in range(d):
            v[a * d + i] = x[rows[a] * d + i]
    for c in range(U.shape[0] - 1, -1, -1):
        for k in range(c + 1, U.shape[1]):
            v[c] -= U[c, k] * v[k]
        v[c] /= U[c, c]
        x[rows[0] * d + c] = v[c]


@njit(cache=True)
def _room(first, begin, children, d):
    """Numbers in the factor, and the most that ever wait on the stack."""
    factor, waiting, most, at, largest = 0, 0, 0, 0, 0
    left = np.empty(len(first), dtype=np.int64)
    for s in range(len(first) - 1):
        size, own = d * (begin[s + 1] - begin[s]), d * (first[s + 1] - first[s])
        factor, largest = factor + size * own, max(largest, size)
        for _ in range(children[s]):
            at -= 1
            waiting -= left[at]
        left[at] = (size - own) ** 2
        if size > own:
            waiting, at = waiting + left[at], at + 1
            most = max(most, waiting)
    return factor, most, largest


@kernel(
    given(1),
    given(1, types.int32),
    given(1, types.int32),
    *(given(1, _int),) * 4,
    given(1),
    returns=types.Array(types.float64, 1, "C"),
)
def _solve(data, indices, indptr, first, begin, rows, children, b):
    d = len(b) // first[-1]
    factor, most, largest = _room(first, begin, children, d)
    kept, stack, work, v = np.empty(factor), np.empty(most), np.empty(largest**2), np.empty(largest)
    place = np.empty(first[-1], dtype=np.int64)
    waiting = np.empty(len(first), dtype=np.int64)  # fronts whose rest is on the stack
    x, at, top, count = b.copy(), 0, 0, 0
    for s in range(len(first) - 1):
        own, reach = d * (first[s + 1] - first[s]), rows[begin[s] : begin[s + 1]]
        n = d * len(reach)
        for k in range(len(reach)):
            place[reach[k]] = k
        U = work[: n * n].reshape(n, n)
        for j in range(n):
            U[j, j:] = 0.0
        _add_edges(U, data, indices, indptr, first[s], own, place, d)
        for _ in range(children[s]):
            count -= 1
            t = waiting[count]
            left = rows[begin[t] + first[t + 1] - first[t] : begin[t + 1]]
            m = d * len(left)
            top -= m * m
            _add_child(U, stack[top : top + m * m].reshape(m, m), left, place, d)
        if not _eliminate(U, own):
            x[:] = np.nan
            return x
        factor_rows = kept[at : at + own * n].reshape(own, n)
        factor_rows[:] = U[:own]
        _forward(factor_rows, reach, x, v, d)
        at += own * n
        if n > own:
            rest = stack[top : top + (n - own) ** 2].reshape(n - own, n - own)
            for j in range(n - own):
                rest[j, j:] = U[own + j, own + j :]
            top += (n - own) ** 2
            waiting[count] = s
            count += 1
    for s in range(len(first) - 2, -1, -1):
        own, reach = d * (first[s + 1] - first[s]), rows[begin[s] : begin[s + 1]]
        n = d * len(reach)
        at -= own * n
        _backward(kept[at : at + own * n].reshape(own, n), reach, x, v, d)
    return x


@unpacks(_solve)
def solve_in_order(data, indices, indptr, fronts, b):
    """Twin of :func:`vslam_ref.estimation.posegraph.fronts.solve_in_order`: front by front."""
    return _solve(data, indices, indptr, *fronts, b)
