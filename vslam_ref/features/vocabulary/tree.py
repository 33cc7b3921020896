"""A tree of binary words: each node is a descriptor, and a leaf is a word.

Nodes stand level by level, the children of one node side by side: so the number of children of every node is
the whole tree, and no other node can be an ancestor of itself::

    children  2 3 2 0 0 0 0 0          0 has 1 2, 1 has 3 4 5, 2 has 6 7; words 3 4 5 6 7
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.hamming import bit_count
from vslam_ref.features.hamming import words as hamming_words

Bytes = NDArray[np.uint8]
Lanes = NDArray[np.uint64]
BYTES = 32
"""Of a descriptor."""
AT_ONCE = 2048
"""Features that descend together: their children's bits take some ten megabytes."""


@dataclass(frozen=True)
class Vocabulary:
    """Words of binary descriptors, as a tree.

    Attributes
    ----------
    children : ndarray of int, shape (n,)
        How many children each node has, level by level from the root, node 0; no unit.
    descriptor : ndarray of uint8, shape (n, 32)
        Of each node; that of the root is not used.
    weight : ndarray, shape (W,)
        Of each word, at least 0; a word of weight 0 is left out of every picture.  No unit.
    node : ndarray of int, shape (W,)
        Node of each word; by default the leaves in their order.

    Raises
    ------
    ValueError
        If the numbers are no tree, a weight is negative or not finite, or words and leaves differ.

    Examples
    --------
    >>> two = Vocabulary(np.array([2, 0, 0]), np.repeat(np.uint8([[0], [0], [255]]), 32, 1), np.ones(2))
    >>> two.words, two.levels, two.level.tolist(), two.parent.tolist()
    (2, 1, [0, 1, 1], [-1, 0, 0])
    """

    children: IntArray
    descriptor: Bytes
    weight: Array
    node: IntArray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        """Check that it is a tree with a weight for each of its leaves."""
        children = np.asarray(self.children, np.int64)
        n = len(children)
        if children.ndim != 1 or n < 2 or (children < 0).any():
            raise ValueError(f"children of shape {children.shape}: need counts of two nodes or more")
        if int(children.sum()) != n - 1 or (np.cumsum(children)[:-1] < np.arange(1, n)).any():
            raise ValueError(f"children add up to {children.sum()} of {n} nodes: need a tree, level by level")
        if self.descriptor.shape != (n, BYTES) or self.descriptor.dtype != np.uint8:
            raise ValueError(
                f"descriptor {self.descriptor.dtype} {self.descriptor.shape}: need bytes ({n}, 32)"
            )
        leaves = np.flatnonzero(children == 0)
        node = leaves if self.node is None else np.asarray(self.node, np.int64)
        if node.shape != leaves.shape or (np.sort(node) != leaves).any():
            raise ValueError(f"{node.size} words of {len(leaves)} leaves: need each leaf once")
        weight = np.asarray(self.weight, np.float64)
        if weight.shape != node.shape:
            raise ValueError(f"weight has shape {weight.shape}: need one of each of {len(node)} words")
        if not (np.isfinite(weight).all() and (weight >= 0).all()):
            raise ValueError("a weight is negative or not finite: need numbers of at least 0")
        for name, value in (("children", children), ("node", node), ("weight", weight)):
            object.__setattr__(self, name, value)

    @property
    def words(self) -> int:
        """How many words there are."""
        return len(self.node)

    @property
    def levels(self) -> int:
        """Level of the deepest word; the root has 0."""
        return int(self.level.max())

    @property
    def branching(self) -> int:
        """Most children of a node."""
        return int(self.children.max())

    @cached_property
    def first(self) -> IntArray:
        """First child (n,) of each node; where it has none, that of the next one with children."""
        return 1 + np.concatenate([[0], np.cumsum(self.children)[:-1]])

    @cached_property
    def parent(self) -> IntArray:
        """Parent (n,) of each node; of the root -1."""
        return np.concatenate([[-1], np.repeat(np.arange(len(self.children)), self.children)])

    @cached_property
    def level(self) -> IntArray:
        """Level (n,) of each node: steps from the root."""
        level = np.zeros(len(self.children), np.int64)
        start, stop = 1, 1 + int(self.children[0])
        while start < stop:  # a level at a time
            level[start:stop] = level[self.parent[start]] + 1
            start, stop = stop, stop + int(self.children[start:stop].sum())
        return level

    @cached_property
    def word(self) -> IntArray:
        """Word (n,) of each node, -1 where it is none."""
        word = np.full(len(self.children), -1)
        word[self.node] = np.arange(len(self.node))
        return word

    @cached_property
    def lanes(self) -> Lanes:
        """The descriptors as four numbers of 64 bits each, (n, 4)."""
        return lanes(self.descriptor)


def from_parents(parent: ArrayLike, descriptor: Bytes, weight: ArrayLike, node: ArrayLike) -> Vocabulary:
    """Make a vocabulary of nodes in any order, each with its parent.

    Parameters
    ----------
    parent : array_like of int, shape (n,)
        Number of each node's parent; -1 for the root, which is node 0.
    descriptor : ndarray of uint8, shape (n, 32)
    weight : array_like, shape (W,)
        Of each word; no unit.
    node : array_like of int, shape (W,)
        Node of each word, in the order of the words.

    Returns
    -------
    Vocabulary
        Nodes level by level; children of a node keep their order.

    Raises
    ------
    ValueError
        If a parent is none of the nodes, a node cannot be reached from the root, or as :class:`Vocabulary`.
    """
    up = np.asarray(parent, np.int64)
    n = len(up)
    if n < 2 or up[0] != -1 or (up[1:] < 0).any() or (up >= n).any():
        raise ValueError("need a root, node 0 with parent -1, and parents among the nodes")
    by_parent = np.argsort(up[1:], kind="stable") + 1
    count = np.bincount(up[1:], minlength=n)
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    order = [np.zeros(1, np.int64)]
    while len(order[-1]):  # a level at a time
        at = order[-1][count[order[-1]] > 0]
        spans = [by_parent[first[k] : first[k] + count[k]] for k in at]
        order.append(np.concatenate(spans) if spans else np.zeros(0, np.int64))
    nodes = np.concatenate(order)
    if len(nodes) < n:
        missed = int(np.setdiff1d(np.arange(n), nodes)[0])
        raise ValueError(f"node {missed} cannot be reached from the root: a cycle")
    new = np.empty(n, np.int64)
    new[nodes] = np.arange(n)
    leaf = np.asarray(node, np.int64)
    if ((leaf < 0) | (leaf >= n)).any():
        raise ValueError("a word has none of the nodes")
    return Vocabulary(count[nodes], descriptor[nodes], np.asarray(weight, np.float64), new[leaf])


class Descended(NamedTuple):
    """Where features ended.

    Attributes
    ----------
    node : ndarray of int, shape (N,)
        The leaf of each feature; no unit.
    distance : ndarray of int, shape (N,)
        Bits in which it differs from that leaf.
    """

    node: IntArray
    distance: IntArray


def lanes(descriptor: Bytes) -> Lanes:
    """Descriptors (N, 32) as four numbers of 64 bits each, (N, 4).

    Raises
    ------
    ValueError
        If they are not bytes of this shape.
    """
    if descriptor.ndim != 2 or descriptor.shape[1] != BYTES or descriptor.dtype != np.uint8:
        raise ValueError(f"descriptor {descriptor.dtype} {descriptor.shape}: need bytes (N, {BYTES})")
    return hamming_words(descriptor)


def descend(vocabulary: Vocabulary, descriptor: Bytes) -> Descended:
    """From the root to a word: at each node on to the nearest child, the first one of equals.

    Parameters
    ----------
    vocabulary : Vocabulary
    descriptor : ndarray of uint8, shape (N, 32)

    Returns
    -------
    Descended

    Raises
    ------
    ValueError
        If the descriptors have another shape.

    Examples
    --------
    >>> two = Vocabulary(np.array([2, 0, 0]), np.repeat(np.uint8([[0], [0], [255]]), 32, 1), np.ones(2))
    >>> at = descend(two, np.repeat(np.uint8([[15], [127]]), 32, 1))  # half of the bits, and seven of eight
    >>> at.node.tolist(), at.distance.tolist()
    ([1, 2], [128, 32])
    """
    v = vocabulary
    return Descended(*_descend(lanes(descriptor), v.lanes, v.first, v.children))


@accelerated("vocabulary:descend")
def _descend(features: Lanes, nodes: Lanes, first: IntArray, children: IntArray) -> tuple[IntArray, IntArray]:
    """Leaves (N,) of features (N, 4) in a tree of nodes (n, 4), and their distances (N,)."""
    node, distance = np.zeros(len(features), np.int64), np.zeros(len(features), np.int64)
    place = np.arange(int(children.max()))
    for start in range(0, len(features), AT_ONCE):
        rows = np.arange(start, min(start + AT_ONCE, len(features)))
        while len(rows := rows[children[node[rows]] > 0]):
            there = place < children[node[rows], None]
            below = np.where(there, first[node[rows], None] + place, 0)
            differing = features[rows, None] ^ nodes[below]
            bits = bit_count(differing).sum(-1, dtype=np.int64)
            nearest = np.argmin(np.where(there, bits, 8 * BYTES + 1), axis=1)
            node[rows] = first[node[rows]] + nearest
            distance[rows] = bits[np.arange(len(rows)), nearest]
    return node, distance


def words(vocabulary: Vocabulary, descriptor: Bytes) -> IntArray:
    """Word (N,) of each descriptor (N, 32); no unit."""
    return vocabulary.word[descend(vocabulary, descriptor).node]


def nodes_at_level(vocabulary: Vocabulary, node: IntArray, level: int) -> IntArray:
    """Direct index: the ancestor (N,) of each node (N,) on a level, itself if higher; no unit.

    Raises
    ------
    ValueError
        If the level is negative.
    """
    if level < 0:
        raise ValueError(f"level {level}: need 0 (the root) or more")
    at = np.asarray(node, np.int64).copy()
    while (low := vocabulary.level[at] > level).any():
        at[low] = vocabulary.parent[at[low]]
    return at
