"""Probabilities of cells as bounded log-odds: evidence adds up, and certainty is never final.

``L = ln(p / (1 - p))``.  L = 0 is p = 0.5, unknown.  Stored values are kept within a bound, so that no cell
becomes so certain that it could not learn otherwise, and no odds overflow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array
from vslam_ref.grids.lattice import Lattice

DECIDED = 0.9
"""A cell is decided above this probability (A's chapter 4) or, as free, below one minus it."""
DECIDED_LOG_ODDS = math.log(DECIDED / (1.0 - DECIDED))
FREE, UNKNOWN, OCCUPIED = 0, 1, 2
"""States of a cell, in the order of the inverse sensor's table."""


def log_odds(probability: ArrayLike) -> Array:
    """Return ``ln(p / (1 - p))`` of probabilities strictly between 0 and 1.

    Implements the left side of :eq:`eq-log-odds`.

    Raises
    ------
    ValueError
        If one is not.

    Examples
    --------
    >>> log_odds([0.5, 0.9]).round(4)
    array([0.    , 2.1972])
    """
    p = np.asarray(probability, dtype=np.float64)
    if not ((p > 0) & (p < 1)).all():
        raise ValueError("probabilities must lie strictly between 0 and 1 to have finite log-odds")
    values: Array = np.log(p) - np.log1p(-p)
    return values


def probability(log_odds: ArrayLike) -> Array:
    """Return ``1 / (1 + exp(-L))`` of log-odds of any shape (...,), without overflow.

    Implements the right side of :eq:`eq-log-odds`.

    Examples
    --------
    >>> probability([0.0, -1000.0, 1000.0])
    array([0.5, 0. , 1. ])
    """
    L = np.asarray(log_odds, dtype=np.float64)
    small = np.exp(-np.abs(L))
    p: Array = np.where(L >= 0, 1.0, small) / (1.0 + small)
    return p


def states(log_odds: ArrayLike) -> NDArray[np.int8]:
    """Return FREE (p < 0.1), UNKNOWN or OCCUPIED (p > 0.9) for log-odds of any shape (...,)."""
    L = np.asarray(log_odds)
    decided: NDArray[np.int8] = (L > DECIDED_LOG_ODDS).astype(np.int8) - (L < -DECIDED_LOG_ODDS) + np.int8(1)
    return decided


def entropy_bits(log_odds: ArrayLike) -> Array:
    """Return the entropy of every cell in bits: 1 where nothing is known, 0 where all is.

    Notes
    -----
    With ``a = |L|`` and ``q = 1/(1 + exp(a))``, the smaller probability, the entropy is
    ``(log1p(exp(-a)) + a q) / ln 2``, which neither cancels nor overflows.
    """
    a = np.abs(np.asarray(log_odds, dtype=np.float64))
    small = np.exp(-a)
    q = small / (1.0 + small)
    bits: Array = (np.log1p(small) + a * q) / math.log(2.0)
    return bits


@dataclass(frozen=True)
class LogOddsGrid:
    """One map: ``log_odds (rows, columns)`` on a lattice.

    Raises
    ------
    ValueError
        If the shapes differ.
    """

    lattice: Lattice
    log_odds: Array

    def __post_init__(self) -> None:
        """Check the shapes."""
        if self.log_odds.shape != self.lattice.shape:
            raise ValueError(f"log-odds of shape {self.log_odds.shape} on a lattice of {self.lattice.shape}")

    @property
    def origin_xy(self) -> tuple[float, float]:
        """World coordinates of the lower left corner of cell [0, 0], in metres."""
        return self.lattice.origin_xy

    @property
    def resolution(self) -> float:
        """Side of a cell, in metres."""
        return self.lattice.resolution

    @property
    def probability(self) -> Array:
        """Probability of every cell (rows, columns)."""
        return probability(self.log_odds)

    @property
    def states(self) -> NDArray[np.int8]:
        """FREE, UNKNOWN or OCCUPIED for every cell (rows, columns)."""
        return states(self.log_odds)

    def at(self, xy_world: ArrayLike) -> Array:
        """Log-odds (N,) at world points (N, 2); 0, unknown, outside."""
        cells = self.lattice.cells_from_world(np.atleast_2d(xy_world))
        held = self.lattice.inside(cells)
        values = np.zeros(len(cells))
        values[held] = self.log_odds[cells[held, 0], cells[held, 1]]
        return values

    def part(self, rows: slice, columns: slice) -> LogOddsGrid:
        """Return some rows and columns as a map of their own."""
        return LogOddsGrid(self.lattice.part(rows, columns), self.log_odds[rows, columns])
