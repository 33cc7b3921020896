r"""Which blocks the normal equations have, in which order they are eliminated, and the sums that fill them.

::

    edge i -> j adds to            i     j
                             i  [ A^T A  A^T B ]       A, B: Jacobians of the edge's error in X_i, X_j,
                             j  [ B^T A  B^T B ]             times the root of its information

The matrix has a block for every pair of free nodes that an edge joins.  Where its zeros stand depends on the
edges alone, so the order of elimination, the places of the blocks and the sums that fill them are found once,
and used in every iteration.

The order decides the cost: eliminating a node joins all its neighbours.  It is chosen for *blocks*, on the
n x n graph of the nodes, not for the d n scalars; and by the cost itself: each candidate is eliminated once
in symbols, and the one whose factor takes the fewest products is kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.posegraph.fronts import Fronts, make_fronts

if TYPE_CHECKING:
    from scipy.sparse import csc_array

ORDERINGS = ("MMD_AT_PLUS_A", "COLAMD", "bandwidth")
"""Minimum degree of A + A^T, column minimum degree, reverse Cuthill-McKee; the cheapest is taken."""


class Ordering(NamedTuple):
    """An order of elimination: nodes ``order (k,)``, its name, its fronts, and its cost, a count."""

    order: IntArray
    name: str
    products: float
    fronts: Fronts


def choose_ordering(k: int, a: IntArray, b: IntArray, names: tuple[str, ...] = ORDERINGS) -> Ordering:
    """Order ``k`` nodes, joined by pairs ``a (m,)``, ``b (m,)``, for a sparse factor of few products.

    Implements :eq:`eq-graph-products`.

    Parameters
    ----------
    k : int
    a, b : ndarray of int, shape (m,)
        Pairs of free nodes.
    names : tuple of str
        Candidates, of ``ORDERINGS``.

    Returns
    -------
    Ordering
        The one with the least sum of squared column lengths of its factor (a count); of equals the first.

    Examples
    --------
    >>> chain = choose_ordering(4, np.array([0, 1, 2]), np.array([1, 2, 3]))
    >>> chain.products  # columns of 2, 2, 2 and 1 entries: no fill
    13.0
    """
    if k == 0:
        none = np.zeros(0, dtype=np.int64)
        return Ordering(none, names[0], 0.0, Fronts(none, none, none, none))
    adjacency = _adjacency(k, a, b)
    order, name, L, products = min((_eliminated(adjacency, name) for name in names), key=lambda one: one[-1])
    post, fronts = make_fronts(L.indptr, L.indices)
    return Ordering(order[post], name, products, fronts)


def _adjacency(k: int, a: IntArray, b: IntArray) -> csc_array:
    """Symmetric matrix with the pattern of the blocks, positive definite, so that no pivot is ever moved.

    It is barely so: along a long chain the entries of its factor would else underflow, and be missing.
    """
    from scipy.sparse import coo_array

    m = len(a)
    rows = np.concatenate([a, b, np.arange(k)])
    columns = np.concatenate([b, a, np.arange(k)])
    degree = np.bincount(a, minlength=k) + np.bincount(b, minlength=k)
    values = np.concatenate([np.full(2 * m, -1.0), degree + 1.0 / k])
    return coo_array((values, (rows, columns)), shape=(k, k)).tocsc()


def _eliminated(adjacency: csc_array, name: str) -> tuple[IntArray, str, csc_array, float]:
    """Order the nodes by one rule; the factor, and how many products it takes."""
    from scipy.sparse.csgraph import reverse_cuthill_mckee
    from scipy.sparse.linalg import splu

    options: dict[str, Any] = {"SymmetricMode": True}
    if name == "bandwidth":
        order = np.asarray(reverse_cuthill_mckee(adjacency.tocsr(), symmetric_mode=True), dtype=np.int64)
        factor = splu(adjacency[order][:, order], "NATURAL", 0.0, options=options)
    else:
        factor = splu(adjacency, name, 0.0, options=options)
        order = np.argsort(factor.perm_c)  # perm_c tells where a column went: a position, not an order
    lengths = np.diff(factor.L.indptr).astype(np.float64)
    return order.astype(np.int64), name, factor.L, float(lengths @ lengths)


@dataclass(frozen=True)
class Pattern:
    """Where the sums of edges go.

    Parameters
    ----------
    free : ndarray of int, shape (k,)
        Free nodes in the order of elimination.
    place : ndarray of int, shape (n,)
        Where a node stands in that order; -1 for those that are fixed.
    d : int
        Coordinates of a node.
    ordering : Ordering
    indptr, indices : ndarray of int, shapes (k d + 1,) and (entries,)
        Of the matrix (k d, k d), all its entries, column by column.
    gather : ndarray of int, shape (entries,)
        Each entry's place in the sums of blocks, which are (blocks, d, d).
    selection : csr_array, shape (blocks, 4 m)
        Adds the contributions of edges to blocks: A^T A, B^T B, A^T B, B^T A of each.
    diagonal : ndarray of int, shape (k d,)
        Places of the diagonal among the entries.
    """

    free: IntArray
    place: IntArray
    d: int
    ordering: Ordering
    indptr: IntArray
    indices: IntArray
    gather: IntArray
    selection: Any
    diagonal: IntArray

    @property
    def size(self) -> int:
        """Number of unknowns, k d."""
        return len(self.free) * self.d

    def matrix(self, J_tail: Array, J_head: Array) -> csc_array:
        """Sum the normal matrix of whitened Jacobians, (m, r, d) each."""
        from scipy.sparse import csc_array

        d = self.d
        A, B = np.swapaxes(J_tail, -1, -2), np.swapaxes(J_head, -1, -2)
        cross = A @ J_head
        parts = np.concatenate([A @ J_tail, B @ J_head, cross, np.swapaxes(cross, -1, -2)])
        sums = self.selection @ parts.reshape(len(parts), d * d)
        entries = sums.reshape(-1)[self.gather]
        return csc_array((entries, self.indices, self.indptr), shape=(self.size, self.size))

    def gradient(self, J_tail: Array, J_head: Array, r: Array, tail: IntArray, head: IntArray) -> Array:
        """Sum J^T r of whitened edges, r (m, r) or (m, r, s); shape (k d) or (k d, s)."""
        r = r if r.ndim == 3 else r[..., None]
        found = np.zeros((len(self.free) + 1, self.d * r.shape[-1]))
        for J, node in ((J_tail, tail), (J_head, head)):
            pull = (np.swapaxes(J, -1, -2) @ r).reshape(len(J), -1)
            where = self.place[node]
            for column in range(pull.shape[1]):
                found[:, column] += np.bincount(
                    where + 1, weights=pull[:, column], minlength=len(self.free) + 1
                )
        return (
            found[1:].reshape(self.size, -1).squeeze(-1)
            if r.shape[-1] == 1
            else found[1:].reshape(self.size, -1)
        )

    def of_nodes(self, step: Array, n: int) -> Array:
        """Steps of all ``n`` nodes, (n, d), from the unknowns (k d,); fixed nodes take none."""
        found = np.zeros((n, self.d))
        found[self.free] = step.reshape(-1, self.d)
        return found


def make_pattern(
    n: int,
    tail: IntArray,
    head: IntArray,
    fixed: BoolArray,
    d: int,
    ordering: Ordering | None = None,
) -> Pattern:
    """Find the pattern of ``n`` nodes with ``d`` coordinates each.

    Edges are ``tail (m,)`` and ``head (m,)``, nodes ``fixed (n,)`` have no place; all are counts.  An
    ``ordering`` that was found for other sizes of the same nodes is used again.
    """
    free = np.flatnonzero(~fixed)
    number = np.full(n, -1)
    number[free] = np.arange(len(free))
    both = ~fixed[tail] & ~fixed[head]
    if ordering is None:
        ordering = choose_ordering(len(free), number[tail[both]], number[head[both]])
    place = np.full(n, -1)
    place[free[ordering.order]] = np.arange(len(free))
    return _placed(free[ordering.order], place, d, ordering, place[tail], place[head])


def _placed(free: IntArray, place: IntArray, d: int, ordering: Ordering, a: IntArray, b: IntArray) -> Pattern:
    """Give every block of every edge, (m,) places a and b, its slot, and every entry its block."""
    from scipy.sparse import csr_array

    k, m = len(free), len(a)
    rows, columns = np.concatenate([a, b, a, b]), np.concatenate([a, b, b, a])
    used = np.flatnonzero((rows >= 0) & (columns >= 0))
    own = np.arange(k)
    key = np.concatenate([columns[used] * k + rows[used], own * k + own])
    blocks, slot = np.unique(key, return_inverse=True)  # column by column
    ones = np.ones(len(used))
    selection = csr_array((ones, (slot[: len(used)], used)), shape=(len(blocks), 4 * m))
    block_column, block_row = np.divmod(blocks, max(k, 1))
    count = np.bincount(block_column, minlength=k)
    begin = np.concatenate([[0], np.cumsum(count)])
    indptr = np.concatenate([[0], np.cumsum(np.repeat(count * d, d))])
    # scalar column c of a block column: its blocks one after another, d rows each
    within = np.arange(d)
    height = np.repeat(count, count) * d  # of the block's column
    first = d * d * begin[block_column]
    rank = (np.arange(len(blocks)) - begin[block_column]) * d
    at = first[:, None, None] + within[None, :, None] * height[:, None, None] + rank[:, None, None] + within
    size = int(indptr[-1])
    indices, gather = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    indices[at] = (block_row * d)[:, None, None] + within  # at is (blocks, column, row)
    source = np.arange(len(blocks))[:, None, None] * d * d + within[:, None] + within[None, :] * d
    gather[at] = source
    own_slot = slot[len(used) :]
    diagonal = at[own_slot][:, within, within].reshape(-1)
    narrow = np.int32 if size < 2**31 else np.int64
    return Pattern(
        free, place, d, ordering, indptr.astype(narrow), indices.astype(narrow), gather, selection, diagonal
    )
