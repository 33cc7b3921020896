"""Numba twins of binary descriptors: bits are counted 64 at a time."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import kernel, njit

ROWS = types.Array(types.uint8, 2, "C", readonly=True)


@njit(cache=True)
def _ones(word):
    """Bits that are set in 64: sums of neighbours, twice as wide each time."""
    word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    low = np.uint64(0x3333333333333333)
    word = (word & low) + ((word >> np.uint64(2)) & low)
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return (word * np.uint64(0x0101010101010101)) >> np.uint64(56)


@njit(cache=True)
def _words(rows):
    """Descriptors (n, bytes) as words of 64 bits, the last one filled up."""
    count = (rows.shape[1] + 7) // 8
    wide = np.zeros((rows.shape[0], 8 * count), np.uint8)
    wide[:, : rows.shape[1]] = rows
    return wide.reshape(-1).view(np.uint64).reshape(rows.shape[0], count)


@kernel(ROWS, ROWS, returns=types.Array(types.int32, 2, "C"))
def distances(a, b):
    """Twin of :func:`vslam_ref.features.hamming._distances`: many of b at once, word by word."""
    p, q = _words(a), _words(b).T.copy()
    bits = np.zeros((p.shape[0], q.shape[1]), np.int32)
    for i in range(p.shape[0]):
        row = bits[i]
        if p.shape[1] == 4:  # 256 bits: one pass
            q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
            p0, p1, p2, p3 = p[i, 0], p[i, 1], p[i, 2], p[i, 3]
            for j in range(row.shape[0]):
                low = _ones(p0 ^ q0[j]) + _ones(p1 ^ q1[j])
                row[j] = np.int32(low + _ones(p2 ^ q2[j]) + _ones(p3 ^ q3[j]))
        else:
            for k in range(p.shape[1]):
                word, others = p[i, k], q[k]
                for j in range(row.shape[0]):
                    row[j] += np.int32(_ones(word ^ others[j]))
    return bits
