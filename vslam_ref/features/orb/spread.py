"""A quadtree that spreads features over the picture: it splits where there are most, and keeps the best.

The picture begins as a row of squares.  In each round, nodes with more than one corner are split into four,
the fullest first, until there are as many nodes as features are wanted.  The best corner of each node stays.
Empty nodes are none.  It is the distribution of ORB-SLAM.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import IntArray
from vslam_ref.features.fast import Pixels, pixels


class Nodes(NamedTuple):
    """Node of each corner (n,), and the nodes' first pixels and sizes (m, 2), in the order (x, y)."""

    of: IntArray
    corner: IntArray
    size: IntArray


def spread(xy: ArrayLike, score: ArrayLike, shape: tuple[int, int], wanted: int) -> IntArray:
    """Choose about ``wanted`` corners, as far apart as they come.

    Implements :eq:`eq-orb-quadtree`.

    Parameters
    ----------
    xy : array_like of int, shape (n, 2)
        Pixels (x, y), each once.
    score : array_like of int, shape (n,)
        The larger, the better; of equal ones in a node, the first stays.
    shape : tuple of int
        Height and width of the picture.
    wanted : int
        The last split may bring up to three more nodes; the best ``wanted`` of them all stay.

    Returns
    -------
    ndarray of int64, shape (k,)
        Which corners stay, in their order; k = min(n, wanted).

    Raises
    ------
    ValueError
        If a corner is no whole pixel of the picture.

    Examples
    --------
    >>> spread([[0, 0], [1, 0], [9, 9]], [5, 7, 2], (10, 10), 2)
    array([1, 2])
    """
    at = pixels(xy, shape, 0, 0)
    height, width = shape
    worth = np.asarray(score, dtype=np.int64)
    if wanted <= 0 or len(at) == 0:
        return np.zeros(0, np.int64)
    return _spread(at, worth, height, width, wanted)


def _spread(xy: Pixels, score: IntArray, height: int, width: int, wanted: int) -> IntArray:
    """Corners (k,) that stay."""
    squares = max((2 * width + height) // (2 * height), 1)  # the quotient, rounded
    left = -(-np.arange(squares + 1) * width // squares)  # rounded up: a pixel belongs where it begins
    of = xy[:, 0].astype(np.int64) * squares // width
    corner = np.stack([left[:-1], np.zeros(squares, np.int64)], 1)
    size = np.stack([np.diff(left), np.full(squares, height, np.int64)], 1)
    nodes = _without_empty(Nodes(of, corner, size))
    while len(nodes.corner) < wanted and len(nodes.corner) < len(xy):
        nodes = _split(nodes, xy, wanted)
    order = np.lexsort([np.arange(len(xy)), -score, nodes.of])
    first = np.flatnonzero(np.diff(nodes.of[order], prepend=-1))
    best = order[first]  # eq-orb-quadtree
    best = best[np.lexsort([best, -score[best]])][:wanted]
    kept: IntArray = np.sort(best)
    return kept


def _split(nodes: Nodes, xy: Pixels, wanted: int) -> Nodes:
    """One round: the fullest nodes are split until there are enough."""
    half = (nodes.size + 1) // 2
    beyond = (xy - nodes.corner[nodes.of]) >= half[nodes.of]
    quarter = beyond[:, 0] + 2 * beyond[:, 1]
    count = np.bincount(4 * nodes.of + quarter, minlength=4 * len(half)).reshape(-1, 4)
    inside = count.sum(1)
    fullest = np.lexsort([np.arange(len(inside)), -inside])
    fullest = fullest[inside[fullest] > 1]
    more = np.cumsum((count[fullest] > 0).sum(1) - 1)
    done = np.zeros(len(inside), np.bool_)
    done[fullest[: np.searchsorted(more, wanted - len(inside)) + 1]] = True
    child = np.where(done[nodes.of], quarter, 0)
    step: IntArray = np.array([(0, 0), (1, 0), (0, 1), (1, 1)])
    corner = nodes.corner[:, None] + step * half[:, None]
    size = np.where(step, (nodes.size - half)[:, None], half[:, None])
    size = np.where(done[:, None, None], size, nodes.size[:, None])
    return _without_empty(Nodes(4 * nodes.of + child, corner.reshape(-1, 2), size.reshape(-1, 2)))


def _without_empty(nodes: Nodes) -> Nodes:
    used = np.bincount(nodes.of, minlength=len(nodes.corner)) > 0
    return Nodes((np.cumsum(used) - 1)[nodes.of], nodes.corner[used], nodes.size[used])
