r"""A pose graph as arrays: poses, and the edges between them.

::

    node  0        1        2        3        n poses T_world, sorted by their ids: 0 1 2 ... in time
          o------->o------->o------->o        edges between neighbours: odometry
          \__________________________^        every other edge: a loop
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.posegraph.spaces import WORDS, Space, element_shape, tangent_size

LEAST_EIGENVALUE = 1e-13
"""Of an information matrix with ones on its diagonal: below it the matrix is singular to rounding."""


@dataclass(frozen=True)
class PoseGraph:
    """Poses and what was measured between them.

    Parameters
    ----------
    space : {"se2", "se3", "sim3"}
    T_world : ndarray, shape (n, 3) or (n, 4, 4)
        Poses of the nodes, in the order of time: T_world_0, T_world_1, ...
    tail, head : ndarray of int, shape (m,)
        Nodes i and j of each edge.
    measured : ndarray, shape (m, 3) or (m, 4, 4)
        T_i_j.
    information : ndarray, shape (m, d, d)
        Inverse covariance of the error (translation, rotation, log-scale), symmetric positive definite.
    fixed : ndarray of bool, shape (n,), optional
        Nodes that stay where they are: the gauge.  By default the first node of every part.

    Raises
    ------
    ValueError
        On shapes that do not fit, a node that does not exist, an edge from a node to itself, numbers that
        are not finite, an information matrix that is not positive definite, or a part without a fixed node.

    Examples
    --------
    >>> square = np.array([[1.0, 0.0, np.pi / 2]] * 4)
    >>> one = np.array([np.eye(3)] * 4)
    >>> graph = PoseGraph("se2", np.zeros((4, 3)), [0, 1, 2, 3], [1, 2, 3, 0], square, one)
    >>> graph.loops.tolist(), graph.fixed.tolist()
    ([False, False, False, True], [True, False, False, False])
    """

    space: Space
    T_world: Array
    tail: IntArray
    head: IntArray
    measured: Array
    information: Array
    fixed: BoolArray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        d, shape = tangent_size(self.space), element_shape(self.space)
        for name, tail in (("T_world", shape), ("measured", shape), ("information", (d, d))):
            value = np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            if value.ndim != 1 + len(tail) or value.shape[1:] != tail:
                wanted = ", ".join(map(str, tail))
                raise ValueError(f"{name} has shape {value.shape}: {WORDS[self.space]} needs (k, {wanted})")
            _require(
                np.isfinite(value).reshape(len(value), -1).all(-1), name, "has a number that is not finite"
            )
            object.__setattr__(self, name, value)
        n, m = self.sizes
        if len(self.information) != m:
            raise ValueError(f"{len(self.information)} information matrices for {m} edges")
        for name in ("tail", "head"):
            index = np.ascontiguousarray(getattr(self, name), dtype=np.int64)
            if index.shape != (m,):
                raise ValueError(f"{name} has shape {index.shape}: need ({m},)")
            _require((index >= 0) & (index < n), name, f"is no node; there are {n}, from 0")
            object.__setattr__(self, name, index)
        _require(self.tail != self.head, "edge", "joins a node with itself")
        _require(positive_definite(self.information), "information", "is not positive definite")
        object.__setattr__(self, "fixed", self._gauge())

    @property
    def sizes(self) -> tuple[int, int]:
        """Number of nodes and edges."""
        return len(self.T_world), len(self.measured)

    @property
    def loops(self) -> BoolArray:
        """Edges between nodes that are not neighbours in time, (m,)."""
        loops: BoolArray = np.abs(self.tail - self.head) != 1
        return loops

    def at(self, T_world: Array) -> Self:
        """Return the same graph with other poses."""
        return replace(self, T_world=T_world)

    def only(self, keep: BoolArray) -> Self:
        """Return the graph with some of its edges, by a mask (m,), and the same fixed nodes.

        Raises
        ------
        ValueError
            If a part is left without a fixed node.
        """
        kept = {name: getattr(self, name)[keep] for name in ("tail", "head", "measured", "information")}
        return replace(self, **kept)

    def _gauge(self) -> BoolArray:
        n, _ = self.sizes
        part = parts(n, self.tail, self.head)
        given: object = self.fixed
        if given is None:
            fixed = np.zeros(n, dtype=np.bool_)
            fixed[np.unique(part, return_index=True)[1]] = True
            return fixed
        fixed = np.ascontiguousarray(self.fixed, dtype=np.bool_)
        if fixed.shape != (n,):
            raise ValueError(f"fixed has shape {fixed.shape}: need ({n},)")
        loose = np.flatnonzero(~np.isin(part, part[fixed]))
        if len(loose):
            raise ValueError(f"node {loose[0]} hangs on no fixed node: fix one in every part of the graph")
        return fixed


def parts(n: int, tail: IntArray, head: IntArray) -> IntArray:
    """Number of the connected part of each of ``n`` nodes, (n,), counted from the first node on.

    Edges join ``tail (m,)`` with ``head (m,)``; nodes are counts without a unit.

    Examples
    --------
    >>> parts(5, np.array([0, 3]), np.array([1, 4])).tolist()
    [0, 0, 1, 2, 2]
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    adjacency = coo_array((np.ones(len(tail)), (tail, head)), shape=(n, n))
    label = connected_components(adjacency, directed=False)[1]
    first = np.unique(label, return_index=True)[1]
    found: IntArray = np.argsort(np.argsort(first))[label].astype(np.int64)
    return found


def positive_definite(matrices: Array) -> BoolArray:
    """Which symmetric matrices (m, d, d) are positive definite, whatever the units of their rows."""
    diagonal = np.diagonal(matrices, axis1=-2, axis2=-1)
    positive: BoolArray = np.logical_and((diagonal > 0).all(-1), np.isfinite(matrices).all((-2, -1)))
    size = np.sqrt(np.where(positive[:, None], diagonal, 1.0))
    scaled = np.where(positive[:, None, None], matrices / (size[:, :, None] * size[:, None, :]), 0.0)
    symmetric = (np.abs(scaled - np.swapaxes(scaled, -1, -2)) <= 1e-9).all((-2, -1))
    least = np.linalg.eigvalsh(scaled)[:, 0] if len(scaled) else np.zeros(0)
    good: BoolArray = positive & symmetric & (least > LEAST_EIGENVALUE)
    return good


def _require(good: Any, name: str, what: str) -> None:
    bad = np.flatnonzero(~good)
    if len(bad):
        raise ValueError(f"{name}[{bad[0]}] {what}")
