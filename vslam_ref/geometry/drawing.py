"""Random samples without repetition, many at once: what every consensus begins with."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import IntArray

SMALL = 4
"""Below so many times the size of a sample, repetitions are likely, and sorting all numbers is quicker."""


def different_numbers(rng: np.random.Generator, count: int, below: int, size: int) -> IntArray:
    """Samples (count, size) of different whole numbers from 0 to ``below`` - 1, each sample equally likely.

    Parameters
    ----------
    rng : numpy.random.Generator
    count : int
        Samples.
    below : int
        How many numbers there are to draw from.
    size : int
        Numbers in a sample.

    Raises
    ------
    ValueError
        If there are fewer numbers than a sample takes.

    Examples
    --------
    >>> drawn = different_numbers(np.random.default_rng(0), 1000, 4, 3)
    >>> drawn.shape, sorted({len(set(row)) for row in drawn.tolist()}), int(drawn.max())
    ((1000, 3), [3], 3)
    """
    if below < size:
        raise ValueError(f"samples of {size} from {below} numbers: need at least {size}")
    if below <= SMALL * size:
        return np.argsort(rng.random((count, below)), axis=1)[:, :size]
    rows = rng.integers(below, size=(count, size))
    while True:
        ordered = np.sort(rows, axis=1)
        twice = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
        if not twice.any():
            return rows
        rows[twice] = rng.integers(below, size=(int(twice.sum()), size))
