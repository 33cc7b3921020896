r"""Train a vocabulary: hierarchical k-medians of binary descriptors.

At each node its descriptors are parted into k clusters, and so are those of every cluster, down to a given
level or until a single descriptor is left.  The centre of a cluster has in each bit what most of its members
have, which is the word with the smallest sum of distances to them; a draw becomes 1, as in DBoW2.

Centres start as in k-means++, each drawn with a probability that is the distance to the nearest one before.

The weight of a word is its inverse document frequency, :math:`\log(N / N_i)`: N pictures, of which
:math:`N_i` have it.  A word that all pictures have says nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.vocabulary.tree import BYTES, Bytes, Vocabulary, from_parents, words

Signs = NDArray[np.float32]
"""Bits as -1 and 1: 256 less twice the distance is a product of two rows, exact in these numbers."""
MOST_ROUNDS = 50


def train(
    pictures: Sequence[Bytes], rng: np.random.Generator, *, branching: int = 10, levels: int = 4
) -> Vocabulary:
    """Train a vocabulary on the descriptors of pictures.

    Parameters
    ----------
    pictures : sequence of ndarray of uint8, shape (N_i, 32)
        Descriptors of each picture.
    rng : numpy.random.Generator
        Draws the first centres; the same state, the same vocabulary.
    branching : int
        Most children of a node; at least 2.
    levels : int
        Level of the deepest words; at least 1.

    Returns
    -------
    Vocabulary
        At most ``branching ** levels`` words, each the median of one descriptor or more.

    Raises
    ------
    ValueError
        If there are fewer than two different descriptors, or a number is out of range.

    Examples
    --------
    >>> blocks = np.repeat(np.uint8([[0], [255]]), 32, 1)
    >>> found = train([blocks[:1], blocks], np.random.default_rng(0), branching=2, levels=1)
    >>> found.words, sorted(found.weight.round(4).tolist())  # log(2 / 2), log(2 / 1)
    (2, [0.0, 0.6931])
    """
    if branching < 2 or not 1 <= levels <= 10:
        raise ValueError(f"branching {branching}, levels {levels}: need 2 or more, and 1 to 10")
    every = np.concatenate([np.zeros((0, BYTES), np.uint8), *pictures])
    if len(np.unique(every[:2], axis=0)) < 2 and len(np.unique(every, axis=0)) < 2:
        raise ValueError("fewer than two different descriptors: need pictures with features")
    grown = _Growing([-1], [np.zeros(BYTES, np.uint8)], [])
    _grow(grown, 0, every, rng, branching, levels)
    parent, node = np.array(grown.parent), np.array(grown.leaves)
    plain = from_parents(parent, np.array(grown.descriptor), np.zeros(len(node)), node)
    tree = Vocabulary(plain.children, plain.descriptor, plain.weight)
    weight = inverse_document_frequency([words(tree, one) for one in pictures], tree.words)
    return Vocabulary(tree.children, tree.descriptor, weight)


def inverse_document_frequency(pictures: Sequence[ArrayLike], count: int) -> Array:
    """Weight (W,) of each of ``count`` words, from the words (N_i,) of each picture; of one that none has 0.

    >>> inverse_document_frequency([[0, 0, 1], [0]], 3).round(4).tolist()
    [0.0, 0.6931, 0.0]
    """
    seen = np.zeros(count, np.int64)
    for one in pictures:
        seen[np.unique(np.asarray(one, np.int64))] += 1
    return np.asarray(np.where(seen > 0, np.log(len(pictures) / np.maximum(seen, 1)), 0.0))  # eq-idf


class Parted(NamedTuple):
    """Clusters of descriptors.

    Attributes
    ----------
    centre : ndarray of uint8, shape (k, 32)
    label : ndarray of int, shape (N,)
        Cluster of each descriptor; each cluster has one.
    """

    centre: Bytes
    label: IntArray


def part(descriptor: Bytes, rng: np.random.Generator, clusters: int) -> Parted:
    """Part descriptors (N, 32) into at most some clusters by k-medians.

    Examples
    --------
    >>> found = part(np.repeat(np.uint8([[0], [1], [254], [255]]), 32, 1), np.random.default_rng(3), 2)
    >>> bool(found.label[0] == found.label[1] != found.label[2] == found.label[3])
    True
    """
    signs = _signs(descriptor)
    centre = _first_centres(signs, rng, clusters)
    label = np.full(len(signs), -1)
    for _ in range(MOST_ROUNDS):
        nearest = np.argmax(signs @ centre.T, axis=1)
        if (nearest == label).all():
            break
        label = nearest
        _, label = np.unique(label, return_inverse=True)  # clusters without a member are left out
        centre = _medians(signs, label)
    return Parted(np.packbits(centre > 0, axis=1), label)


def _signs(descriptor: Bytes) -> Signs:
    return 2.0 * np.unpackbits(descriptor, axis=1).astype(np.float32) - np.float32(1.0)


def _first_centres(signs: Signs, rng: np.random.Generator, clusters: int) -> Signs:
    """Centres (k, 256) among the descriptors, drawn by their distance to the nearest one before."""
    chosen = [int(rng.integers(len(signs)))]
    distance = np.full(len(signs), np.inf)
    while len(chosen) < clusters:
        distance = np.minimum(distance, (8 * BYTES - signs @ signs[chosen[-1]]) / 2)
        total = np.cumsum(distance)
        if total[-1] <= 0:
            break
        chosen.append(int(np.searchsorted(total, rng.uniform(0.0, total[-1]), side="right")))
    return signs[chosen]


def _medians(signs: Signs, label: IntArray) -> Signs:
    """Bit by bit what most members of each cluster have, (k, 256); a draw becomes 1."""
    member = (label == np.arange(label.max() + 1)[:, None]).astype(np.float32)
    total = member @ signs  # sums of whole numbers: exact
    return np.where(total >= 0, 1.0, -1.0).astype(np.float32)  # eq-word-median


class _Growing(NamedTuple):
    """Parents and descriptors of the nodes so far, and which of them are leaves."""

    parent: list[int]
    descriptor: list[Bytes]
    leaves: list[int]


def _grow(
    grown: _Growing, node: int, members: Bytes, rng: np.random.Generator, branching: int, levels: int
) -> None:
    """Add the children of a node, and what is below them."""
    if levels == 0 or len(np.unique(members, axis=0)) == 1:
        grown.leaves.append(node)
        return
    parted = part(members, rng, branching)
    below = range(len(grown.parent), len(grown.parent) + len(parted.centre))
    grown.parent.extend([node] * len(below))
    grown.descriptor.extend(parted.centre)
    for k, child in enumerate(below):
        _grow(grown, child, members[parted.label == k], rng, branching, levels - 1)
