"""Pairs of features of two pictures, looked for among those under the same node only.

A vocabulary parts descriptors coarsely on its first levels: features of one point are mostly under one node.
So only they are compared, and the work falls with the number of nodes.  At level 0 all are under the root.

A picture that is turned turns the directions of all its features alike: pairs whose directions differ
otherwise than most are wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import BoolArray, IntArray
from vslam_ref.features import hamming
from vslam_ref.features.vocabulary.tree import Bytes


@dataclass(frozen=True)
class Matching:
    """How features are paired.

    Parameters
    ----------
    ratio : float
        The nearest must be nearer than this share of the second nearest one; in (0, 1].
    limit : int
        Most bits in which a pair differs.
    bins : int
        Of the histogram of turns; a pair must be in one of the ``kept`` fullest.
    kept : int
    least : float
        Of these, only bins with so many pairs as this share of the fullest one's.

    Raises
    ------
    ValueError
        If a number is out of range.
    """

    ratio: float = 0.8
    limit: int = 100
    bins: int = 30
    kept: int = 3
    least: float = 0.0

    def __post_init__(self) -> None:
        """Refuse settings that mean nothing."""
        if not (0.0 < self.ratio <= 1.0 and 0 <= self.limit <= 256 and 1 <= self.kept <= self.bins):
            raise ValueError(f"{self}: need 0 < ratio <= 1, a limit up to 256, and 1 <= kept <= bins")
        if not 0.0 <= self.least <= 1.0:
            raise ValueError(f"least={self.least:g}: need a share from 0 to 1")


class Matched(NamedTuple):
    """Pairs of features.

    Attributes
    ----------
    first, second : ndarray of int, shape (m,)
        Numbers of features in the two pictures, in growing order of the first.
    distance : ndarray of int, shape (m,)
        Bits that differ.
    """

    first: IntArray
    second: IntArray
    distance: IntArray


def match(
    a: Bytes, b: Bytes, node_a: IntArray, node_b: IntArray, settings: Matching | None = None
) -> Matched:
    """Pair features under common nodes: nearest, by far the nearest, and each the other's.

    Parameters
    ----------
    a, b : ndarray of uint8, shape (N, 32) and (M, 32)
    node_a, node_b : ndarray of int, shape (N,) and (M,)
        Node of each, from :func:`~vslam_ref.features.vocabulary.tree.nodes_at_level`.
    settings : Matching, optional

    Returns
    -------
    Matched

    Raises
    ------
    ValueError
        If descriptors and nodes are not equally many.

    Examples
    --------
    >>> a, b = (np.repeat(np.uint8(rows), 32, 1) for rows in ([[0], [255]], [[255], [1], [0]]))
    >>> match(a, b, np.array([7, 8]), np.array([8, 7, 9]), Matching(limit=40)).second.tolist()  # not 2
    [1, 0]
    """
    how = settings or Matching()
    if node_a.shape != a.shape[:1] or node_b.shape != b.shape[:1]:
        raise ValueError(f"nodes {node_a.shape}, {node_b.shape} of descriptors {a.shape}, {b.shape}")
    first, second, distance = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for node in np.intersect1d(node_a, node_b):
        rows, columns = np.flatnonzero(node_a == node), np.flatnonzero(node_b == node)
        found = hamming.match(a[rows], b[columns], how.ratio, mutual=True, limit=how.limit)
        first.append(rows[found.first])
        second.append(columns[found.second])
        distance.append(found.distance)
    order = np.argsort(np.concatenate(first), kind="stable")
    return Matched(*(np.concatenate(part)[order] for part in (first, second, distance)))


def turned_alike(angle_a: ArrayLike, angle_b: ArrayLike, settings: Matching | None = None) -> BoolArray:
    """Which pairs turn as most do: those in the fullest bins of a histogram.

    Implements :eq:`eq-turn-histogram`.

    Parameters
    ----------
    angle_a, angle_b : array_like, shape (m,)
        Directions of the features of each pair, radians.
    settings : Matching, optional

    Returns
    -------
    ndarray of bool, shape (m,)
        No unit.

    Examples
    --------
    >>> turned_alike([0.1, 0.2, 0.3], [0.15, 0.25, 3.0], Matching(bins=12, kept=1)).tolist()
    [True, True, False]
    """
    how = settings or Matching()
    turn = (np.asarray(angle_b, np.float64) - np.asarray(angle_a, np.float64)) / (2 * np.pi) % 1.0
    place = np.minimum((turn * how.bins + 0.5).astype(np.int64), how.bins) % how.bins  # 0 in a bin's middle
    count = np.bincount(place, minlength=how.bins)
    full = np.zeros(how.bins, np.bool_)
    full[np.argsort(-count, kind="stable")[: how.kept]] = True
    full &= count >= how.least * count.max()
    return np.asarray(full[place])
