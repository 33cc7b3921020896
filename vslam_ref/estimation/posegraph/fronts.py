r"""Fronts: the columns of a sparse factor that can be eliminated together, and the tree in which they stand.

::

    factor of a chain with a loop        columns 3, 4, 5 have the same rows below them: one front,
                                         a small dense matrix; columns 0, 1 and 2 are fronts themselves
        x                                      {3, 4, 5}
        . x                                   /    |    \
        . . x                               {0}   {1}   {2}
        x x . x                          a front adds up its edges and what its children leave over,
        x . x x x                        eliminates its own columns, and leaves the rest to its parent
        . x x x x x

(Columns are blocks of d unknowns, one for each node of the graph.)  NumPy has SuperLU factor the matrix in
the order in which it stands, and needs no fronts; the compiled twin eliminates front by front, each a dense
matrix.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray

if TYPE_CHECKING:
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import SuperLU


class Fronts(NamedTuple):
    """Fronts in the order of elimination, children before parents; all numbers are counts of blocks.

    ``first (s + 1,)`` is the first column of each front's own, and the number of all columns at the end;
    ``begin (s + 1,)`` is where its rows begin in ``rows (r,)``; ``children (s,)`` are those in the tree.  The
    rows of a front are sorted: its own columns, then those that it leaves to its parent.
    """

    first: IntArray
    begin: IntArray
    rows: IntArray
    children: IntArray


def make_fronts(indptr: IntArray, indices: IntArray) -> tuple[IntArray, Fronts]:
    """Order the columns of a factor so that each front's are neighbours, and find the fronts.

    Implements the elimination that :eq:`eq-graph-products` counts.

    Parameters
    ----------
    indptr, indices : ndarray of int, shapes (k + 1,) and (entries,)
        Counts: pattern of a lower triangular factor, column by column, diagonal included.

    Returns
    -------
    post : ndarray of int, shape (k,)
        Which column comes next: each subtree of the elimination tree in one piece.
    fronts : Fronts
        Of the columns in that order.

    Examples
    --------
    >>> arrow = np.array([0, 2, 4, 5]), np.array([0, 2, 1, 2, 2])  # the last row is full
    >>> post, fronts = make_fronts(*arrow)
    >>> post.tolist(), fronts.first.tolist(), fronts.rows.tolist(), fronts.children.tolist()
    ([1, 0, 2], [0, 1, 3], [0, 2, 1, 2], [0, 1])
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import depth_first_order

    k = len(indptr) - 1
    column = np.repeat(np.arange(k), np.diff(indptr))
    parent = np.full(k, k)  # the first row below the diagonal; a root's is k
    below = indices > column
    np.minimum.at(parent, column[below], indices[below])
    tree = csr_array((np.ones(k), (parent, np.arange(k))), shape=(k + 1, k + 1))
    post: IntArray = depth_first_order(tree, k, return_predecessors=False)[:0:-1].astype(np.int64)
    place = np.append(np.empty(k, dtype=np.int64), k)
    place[post] = np.arange(k)
    order = np.lexsort((place[indices], place[column]))
    rows, count, up = place[indices][order], np.diff(indptr)[post], place[parent[post]]
    same = (up[:-1] == np.arange(1, k)) & (count[:-1] == count[1:] + 1)  # rows as in the next column
    first = np.append(np.flatnonzero(np.append(np.full(min(k, 1), True), ~same)), k)
    start = np.append(0, np.cumsum(count))
    begin = np.append(0, np.cumsum(count[first[:-1]]))
    own = np.arange(begin[-1]) + np.repeat(start[first[:-1]] - begin[:-1], np.diff(begin))
    roof = up[first[1:] - 1]  # first column of what is left over
    children = np.bincount(np.searchsorted(first, roof[roof < k], "right") - 1, minlength=len(first) - 1)
    return post, Fronts(first, begin, rows[own], children)


@accelerated("fronts:solve_in_order")
def solve_in_order(data: Array, indices: IntArray, indptr: IntArray, fronts: Fronts, b: Array) -> Array:
    """Solve A x = b for a symmetric positive definite A, eliminated in the order in which it stands.

    Parameters
    ----------
    data, indices, indptr : ndarray, shapes (entries,), (entries,) and (q + 1,)
        A, column by column, both triangles; rows of a column are sorted.  Numbers of 32 bits, as SciPy's.
    fronts : Fronts
        Of the blocks of A, of q / k unknowns each.
    b : ndarray, shape (q,)

    Returns
    -------
    ndarray, shape (q,)
        x, in the units of b over those of A; NaN where A is not positive definite to rounding.

    Examples
    --------
    >>> _, one = make_fronts(np.array([0, 1]), np.array([0]))
    >>> row, start = np.array([0], np.int32), np.array([0, 1], np.int32)
    >>> solve_in_order(np.array([4.0]), row, start, one, np.array([2.0])).tolist()
    [0.5]
    """
    from scipy.sparse import csc_array

    factor = factorised(csc_array((data, indices, indptr), shape=(len(b), len(b))))
    return np.full(len(b), np.nan) if factor is None else np.asarray(factor.solve(b))


def factorised(matrix: csc_array) -> SuperLU | None:
    """Factor a symmetric positive definite matrix in the order in which it stands; None if it is singular."""
    from scipy.sparse.linalg import splu

    try:
        return splu(matrix, "NATURAL", 0.0, options={"SymmetricMode": True})
    except RuntimeError:
        return None
