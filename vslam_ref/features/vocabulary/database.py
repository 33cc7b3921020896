"""An inverted index: for each word the pictures that have it, so that a query touches only those."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.features.vocabulary.bags import Bag


class QueryResult(NamedTuple):
    """Answer of a query.

    Attributes
    ----------
    entry : ndarray of int, shape (m,)
        Numbers of pictures.
    score : ndarray, shape (m,)
        In (0, 1]; no unit.
    common : ndarray of int, shape (m,)
        Words that both have; a count.
    """

    entry: IntArray
    score: Array
    common: IntArray


class Database:
    """Pictures by their words.

    Parameters
    ----------
    words : int
        Words of the vocabulary.

    Examples
    --------
    >>> index = Database(5)
    >>> index.add(Bag(np.array([0, 4]), np.array([0.25, 0.75]))), index.add(Bag(np.array([1]), np.ones(1)))
    (0, 1)
    >>> index.query(Bag(np.array([4]), np.ones(1)))
    QueryResult(entry=array([0]), score=array([0.75]), common=array([1]))
    """

    def __init__(self, words: int) -> None:
        self._entries: list[list[int]] = [[] for _ in range(words)]
        self._values: list[list[float]] = [[] for _ in range(words)]
        self._bags: list[Bag | None] = []

    def __len__(self) -> int:
        return len(self._bags)

    def add(self, bag: Bag) -> int:
        """Add a picture; return its number, 0, 1, 2, ..."""
        number = len(self._bags)
        self._bags.append(bag)
        for word, value in zip(bag.word.tolist(), bag.value.tolist(), strict=True):
            self._entries[word].append(number)
            self._values[word].append(value)
        return number

    def remove(self, entry: int) -> None:
        """Forget a picture; the numbers of the others stay.

        Raises
        ------
        ValueError
            If there is none of this number.
        """
        for word in self.bag(entry).word.tolist():
            at = self._entries[word].index(entry)
            del self._entries[word][at], self._values[word][at]
        self._bags[entry] = None

    def bag(self, entry: int) -> Bag:
        """Words of a picture.

        Raises
        ------
        ValueError
            If there is none of this number.
        """
        bag = self._bags[entry] if 0 <= entry < len(self._bags) else None
        if bag is None:
            raise ValueError(f"entry {entry} of {len(self._bags)}: not there, or removed")
        return bag

    def query(self, bag: Bag, allowed: BoolArray | None = None) -> QueryResult:
        """Pictures that share words with a picture, by their numbers.

        Parameters
        ----------
        bag : Bag
        allowed : ndarray of bool, shape (entries,), optional
            Pictures that may be found; by default all.  No unit.

        Returns
        -------
        QueryResult

        Raises
        ------
        ValueError
            If ``allowed`` has another shape.
        """
        n = len(self._bags)
        if allowed is not None and allowed.shape != (n,):
            raise ValueError(f"allowed has shape {allowed.shape}: need ({n},)")
        total, common = np.zeros(n), np.zeros(n, np.int64)
        for word, value in zip(bag.word.tolist(), bag.value.tolist(), strict=True):
            at = self._entries[word]  # each picture once
            total[at] += np.minimum(value, self._values[word])
            common[at] += 1
        keep = common > 0 if allowed is None else (common > 0) & allowed
        entry = np.flatnonzero(keep)
        return QueryResult(entry, total[entry], common[entry])


def best(found: QueryResult, most: int) -> QueryResult:
    """The best ``most`` pictures of an answer, by score; of equal ones the first.

    >>> found = QueryResult(np.array([3, 5, 8]), np.array([0.1, 0.3, 0.2]), np.array([1, 4, 2]))
    >>> best(found, 2).entry.tolist()
    [5, 8]
    """
    order = np.argsort(-found.score, kind="stable")[:most]
    return QueryResult(found.entry[order], found.score[order], found.common[order])
