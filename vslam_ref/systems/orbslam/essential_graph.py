r"""The essential graph: the few edges between keyframes along which the error of a loop is spread.

::

    covisibility graph      every pair of keyframes with common points, weighted by how many
    spanning tree           each keyframe hangs at the earlier one with which it shared most points
    loop edges              pairs that a loop has joined
    essential graph         spanning tree + loop edges + the pairs with at least theta_min common points

It is no minimum spanning tree, as A§3.1 has it.  A tree has no cycle: whatever was measured along its edges,
poses exist that agree with all of it, and no error is spread at all.  The errors of a loop are shared out
because a *cycle* does not close.  Nor is its tree one of least weight: the weight counts common points, so
that the pairs of least weight are the ones that know least of each other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import IntArray

THETA_MIN = 100
"""Common points from which a pair of keyframes is joined."""
TREE, LOOP, COVISIBLE = 0, 1, 2


class EssentialEdges(NamedTuple):
    """Pairs of keyframes, each once, sorted.

    Attributes
    ----------
    tail, head : ndarray of int, shape (m,)
        Numbers of keyframes, tail < head.
    kind : ndarray of int, shape (m,)
        ``TREE``, ``LOOP`` or ``COVISIBLE``: the first of them that names the pair.
    """

    tail: IntArray
    head: IntArray
    kind: IntArray


def essential_edges(
    shared: ArrayLike, parent: ArrayLike, loops: ArrayLike = (), *, theta_min: float = THETA_MIN
) -> EssentialEdges:
    """Edges of the essential graph.

    Implements A§3.1's Essential Graph, as it is and not as a minimum spanning tree.

    Parameters
    ----------
    shared : array_like of int, shape (K, K)
        Common points of each pair of keyframes, a count; the diagonal has no meaning here.
    parent : array_like of int, shape (K,)
        Parent of each keyframe in the spanning tree; -1 for its root.
    loops : array_like of int, shape (L, 2)
        Pairs that loops have joined.
    theta_min : float
        Common points from which a pair is joined; 1 gives the whole covisibility graph, infinity none of it.

    Returns
    -------
    EssentialEdges

    Raises
    ------
    ValueError
        If ``shared`` is not square and symmetric, ``parent`` no tree, or a loop joins what does not exist.

    Examples
    --------
    >>> shared = [[0, 120, 90, 0], [120, 0, 110, 0], [90, 110, 0, 40], [0, 0, 40, 0]]
    >>> edges = essential_edges(shared, [-1, 0, 1, 2], [(3, 0)], theta_min=80)
    >>> list(zip(edges.tail.tolist(), edges.head.tolist(), edges.kind.tolist()))
    [(0, 1, 0), (0, 2, 2), (0, 3, 1), (1, 2, 0), (2, 3, 0)]
    """
    count, above = _counts(shared), _parents(parent)
    K = len(count)
    if len(above) != K:
        raise ValueError(f"{len(above)} parents for {K} keyframes")
    joined = np.asarray(loops, dtype=np.int64).reshape(-1, 2)
    bad = np.flatnonzero((joined < 0).any(1) | (joined >= K).any(1) | (joined[:, 0] == joined[:, 1]))
    if len(bad):
        raise ValueError(f"loop {joined[bad[0]].tolist()}: need two different keyframes of {K}")
    child = np.flatnonzero(above >= 0)
    strong = np.argwhere(np.triu(count >= max(theta_min, 1), 1))
    pairs = [np.column_stack([child, above[child]]), joined, strong]  # eq-essential-graph
    kind = np.repeat([TREE, LOOP, COVISIBLE], [len(one) for one in pairs])
    every = np.sort(np.concatenate(pairs).astype(np.int64), axis=1)
    _, first = np.unique(every @ [K, 1], return_index=True)  # the first kind that names a pair
    return EssentialEdges(every[first, 0], every[first, 1], kind[first])


def _counts(shared: ArrayLike) -> NDArray[np.int64]:
    count = np.asarray(shared, dtype=np.int64)
    if count.ndim != 2 or count.shape[0] != count.shape[1]:
        raise ValueError(f"shared {count.shape}: need (K, K)")
    odd = np.argwhere(count != count.T)
    if len(odd):
        i, j = odd[0]
        raise ValueError(f"shared[{i}, {j}] is {count[i, j]} and shared[{j}, {i}] is {count[j, i]}")
    return count


def _parents(parent: ArrayLike) -> IntArray:
    """Parents (K,), every one of which leads to a root."""
    above = np.asarray(parent, dtype=np.int64)
    K = len(above)
    bad = np.flatnonzero((above < -1) | (above >= K))
    if above.ndim != 1 or len(bad):
        raise ValueError(
            f"parent {above.tolist() if above.ndim != 1 else above[bad[0]]}: need (K,) of -1 to K - 1"
        )
    at = np.arange(K)
    for _ in range(K):
        if (at < 0).all():
            break
        at = np.where(at >= 0, above[at], -1)
    if (at >= 0).any():
        raise ValueError(
            f"keyframe {np.flatnonzero(at >= 0)[0]} has no way to a root: parents go in a circle"
        )
    return above
