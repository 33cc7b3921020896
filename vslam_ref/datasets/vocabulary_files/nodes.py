"""Nodes of a vocabulary as a file lists them: checked one by one, and made a tree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.text import FormatError
from vslam_ref.features.vocabulary import Vocabulary, from_parents
from vslam_ref.features.vocabulary.tree import BYTES

MAX_BYTES = 256 * 2**20
"""Unpacked; the largest known vocabulary, of a million words, has 145 MiB as text."""
LEAST_K, MOST_K, MOST_L = 2, 65535, 20
HEAVIEST = 1e6
"""A weight is the logarithm of a number of pictures."""
WEIGHTINGS = ("tf-idf", "tf", "idf", "binary")
SCORINGS = ("L1", "L2", "chi square", "Kullback-Leibler", "Bhattacharyya", "dot product")


@dataclass(frozen=True)
class VocabularyFile:
    """A vocabulary and what its file says beside it.

    Parameters
    ----------
    vocabulary : Vocabulary
    path : Path
    format : str
        "dbow2", "dbow3", "text" or "own".
    branching, levels : int
        k and L as the file states them; the tree may have less.
    notes : tuple of str
        What is odd but harmless, a sentence each.
    """

    vocabulary: Vocabulary
    path: Path
    format: str
    branching: int
    levels: int
    notes: tuple[str, ...] = ()


def header(path: Path, line: int | None, k: int, L: int, scoring: int, weighting: int) -> None:
    """Refuse numbers of a header that mean nothing, or something else than tf-idf and L1."""
    if not (LEAST_K <= k <= MOST_K and 1 <= L <= MOST_L):
        right = f"expected {LEAST_K} to {MOST_K} children and 1 to {MOST_L} levels"
        raise FormatError(path, line, f"k is {k}, L is {L}; {right}")
    for name, number, known in (("weighting", weighting, WEIGHTINGS), ("scoring", scoring, SCORINGS)):
        if number != 0:
            said = known[number] if 0 < number < len(known) else "unknown"
            raise FormatError(path, line, f"{name} is {number} ({said}); expected 0 ({known[0]})")


@dataclass(frozen=True)
class ListedNodes:
    """Nodes in the order of a file, without the root.

    Parameters
    ----------
    path : Path
    ids, parents : ndarray of int, shape (n,)
        Numbers that the file gives; the root is 0.
    descriptor : ndarray of uint8, shape (n, 32)
    weight : ndarray, shape (n,)
    lines : sequence of int
    """

    path: Path
    ids: IntArray
    parents: IntArray
    descriptor: NDArray[np.uint8]
    weight: Array
    lines: Sequence[int]

    def error(self, row: int, what: str) -> FormatError:
        """The error at a node."""
        return FormatError(self.path, int(self.lines[row]), f"node {self.ids[row]} {what}")

    def rows(self) -> IntArray:
        """Row + 1 (n,) of each node's parent, 0 for the root; refuse missing parents and cycles."""
        order = np.argsort(self.ids, kind="stable")
        known = self.ids[order]
        again = np.flatnonzero(known[1:] == known[:-1])
        if len(again):
            raise self.error(int(order[again[0] + 1]), "stands twice; expected each number once")
        if (known == 0).any():
            raise self.error(
                int(order[np.flatnonzero(known == 0)[0]]), "is the root; expected numbers from 1"
            )
        at = np.minimum(np.searchsorted(known, self.parents), len(known) - 1)
        there = known[at] == self.parents
        missing = np.flatnonzero(~there & (self.parents != 0))
        if len(missing):
            row = int(missing[0])
            raise self.error(row, f"has parent {self.parents[row]}, which is not there; expected a node")
        up = np.where(self.parents == 0, 0, order[at] + 1)
        self._require_reached(up)
        return up

    def _require_reached(self, up: IntArray) -> None:
        """From every node the root is reached: double steps, twice as far each time."""
        jump = np.concatenate([[0], up])
        for _ in range(len(jump).bit_length()):
            jump = jump[jump]
        if jump.any():
            row = int(np.flatnonzero(jump[1:])[0])
            raise self.error(row, "is below itself or such a node (a cycle); expected a tree from the root 0")

    def tree(self, leaf_rows: IntArray | None, k: int, L: int, format: str) -> VocabularyFile:
        """Make the tree; ``leaf_rows`` (W,) are the nodes of the words, by default all without children."""
        self._require_weights()
        up = self.rows()
        count = np.bincount(up, minlength=len(up) + 1)
        if (wide := np.flatnonzero(count > k)).size:
            name = "the root" if wide[0] == 0 else f"node {self.ids[wide[0] - 1]}"
            raise FormatError(
                self.path, None, f"{name} has {count[wide[0]]} children; expected at most k = {k}"
            )
        leaves = np.flatnonzero(count[1:] == 0)
        given = leaves if leaf_rows is None else leaf_rows
        self._require_leaves(given, leaves)
        parent = np.concatenate([[-1], up])
        descriptor = np.concatenate([np.zeros((1, BYTES), np.uint8), self.descriptor])
        made = from_parents(parent, descriptor, self.weight[given], given + 1)
        if made.levels > L:
            raise FormatError(self.path, None, f"a word on level {made.levels}; expected at most L = {L}")
        return VocabularyFile(made, self.path, format, k, L, self._notes(given))

    def _require_weights(self) -> None:
        bad = np.flatnonzero(~(np.isfinite(self.weight) & (self.weight >= 0) & (self.weight <= HEAVIEST)))
        if len(bad):
            right = "expected a number of at least 0, such as a logarithm of counts"
            raise self.error(int(bad[0]), f"has weight {self.weight[bad[0]]:g}; {right}")

    def _require_leaves(self, given: IntArray, leaves: IntArray) -> None:
        inner = np.setdiff1d(given, leaves)
        if len(inner):
            raise self.error(int(inner[0]), "is a word and has children; expected words without")
        if len(given) != len(np.unique(given)):
            row = int(np.flatnonzero(np.bincount(given) > 1)[0])
            raise self.error(row, "is two words; expected one")
        forgotten = np.setdiff1d(leaves, given)
        if len(forgotten):
            raise self.error(int(forgotten[0]), "has neither children nor a word; expected one of them")

    def _notes(self, leaf_rows: IntArray) -> tuple[str, ...]:
        silent = int((self.weight[leaf_rows] == 0).sum())
        said = f"{silent} of {len(leaf_rows)} words have weight 0 and are left out of every picture"
        return (said,) if silent else ()
