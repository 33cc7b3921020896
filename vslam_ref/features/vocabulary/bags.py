r"""What words a picture has, how much each of them says, and how alike two pictures are.

The weight of word i in a picture is the sum of its idf over the features that have it, over the sum of all:

.. math:: v_i = n_i \log(N / N_i) \Big/ \sum_j n_j \log(N / N_j) .

The score of two pictures is the L1 score of DBoW2.  For vectors that sum to 1 it has two forms,

.. math:: s(a, b) = 1 - \tfrac12 \lVert a - b \rVert_1 = \sum_i \min(a_i, b_i) .

Only the second one is right for a picture without words: the first says one half.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.vocabulary.tree import Vocabulary


class Bag(NamedTuple):
    """Words of a picture and their weights.

    Attributes
    ----------
    word : ndarray of int, shape (m,)
        Each once, in growing order.
    value : ndarray, shape (m,)
        Weight of each, above 0; they sum to 1.  No unit.
    """

    word: IntArray
    value: Array


def bag(vocabulary: Vocabulary, word: ArrayLike) -> Bag:
    """Weigh the words of a picture's features.

    Parameters
    ----------
    vocabulary : Vocabulary
    word : array_like of int, shape (N,)
        Word of each feature, as from :func:`~vslam_ref.features.vocabulary.tree.words`.

    Returns
    -------
    Bag
        Without words of weight 0; empty if there is no other.

    Raises
    ------
    ValueError
        If a word is none of the vocabulary's.

    Examples
    --------
    >>> from vslam_ref.features.vocabulary.tree import Vocabulary
    >>> three = Vocabulary(np.array([3, 0, 0, 0]), np.zeros((4, 32), np.uint8), np.array([1.0, 2.0, 0.0]))
    >>> bag(three, [1, 0, 0, 2])
    Bag(word=array([0, 1]), value=array([0.5, 0.5]))
    """
    given = np.asarray(word, np.int64)
    if given.size and not (given.min() >= 0 and given.max() < vocabulary.words):
        raise ValueError(f"words from {given.min()} to {given.max()}: need 0 to {vocabulary.words - 1}")
    found, count = np.unique(given, return_counts=True)
    value = count * vocabulary.weight[found]
    found, value = found[value > 0], value[value > 0]
    return Bag(found, value / value.sum() if len(value) else value)  # eq-bag


def score(a: Bag, b: Bag) -> float:
    """How alike two pictures are: from 0, no common word, to 1, the same weights; a ratio.

    Examples
    --------
    >>> one, two = Bag(np.array([0, 4]), np.array([0.25, 0.75])), Bag(np.array([4]), np.array([1.0]))
    >>> score(one, two), score(one, one), score(one, Bag(np.array([], int), np.array([])))
    (0.75, 1.0, 0.0)
    """
    _, at_a, at_b = np.intersect1d(a.word, b.word, assume_unique=True, return_indices=True)
    return float(np.minimum(a.value[at_a], b.value[at_b]).sum())  # eq-bag-score
