"""Numba twin of the descent through a vocabulary: 64 bits are compared at once."""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit

PAIRS, FOURS = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
EIGHTS, SUM = np.uint64(0x0F0F0F0F0F0F0F0F), np.uint64(0x0101010101010101)
ONE, TWO, FOUR, TOP = np.uint64(1), np.uint64(2), np.uint64(4), np.uint64(56)
NEW_INTEGERS = types.Array(types.int64, 1, "C")


@njit(cache=True)
def _ones(x):
    """How many bits of 64 are 1: by pairs, fours and bytes, which a product adds up."""
    x = x - ((x >> ONE) & PAIRS)
    x = (x & FOURS) + ((x >> TWO) & FOURS)
    x = (x + (x >> FOUR)) & EIGHTS
    return np.int64((x * SUM) >> TOP)


@kernel(
    given(2, types.uint64),
    given(2, types.uint64),
    given(1, types.int64),
    given(1, types.int64),
    returns=types.UniTuple(NEW_INTEGERS, 2),
)
def descend(features, nodes, first, children):
    """Twin of :func:`vslam_ref.features.vocabulary.tree._descend`."""
    n = features.shape[0]
    node, distance = np.zeros(n, np.int64), np.zeros(n, np.int64)
    for f in range(n):
        a, b, c, d = features[f, 0], features[f, 1], features[f, 2], features[f, 3]
        at, least = np.int64(0), np.int64(0)
        while children[at] > 0:
            start, nearest, least = first[at], np.int64(0), np.int64(257)
            for k in range(start, start + children[at]):
                bits = _ones(a ^ nodes[k, 0]) + _ones(b ^ nodes[k, 1])
                bits += _ones(c ^ nodes[k, 2]) + _ones(d ^ nodes[k, 3])
                if bits < least:
                    nearest, least = k, bits  # type: ignore[assignment]
            at = nearest
        node[f], distance[f] = at, least
    return node, distance
