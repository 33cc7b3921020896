"""Every cell that a beam crosses, once, and without rounding.

A cell is the half-open square [i, i+1) x [j, j+1).  A beam *crosses* it if a part of the beam of positive
length lies in it.  Touching a corner is not crossing; running along an edge is crossing the cell that owns
the edge.

How it stays exact.  Ends of beams are rounded to 1/4096 of a cell (24 micrometres at 0.1 m).  Beyond that
all numbers are integers held in floating point.  Where a beam crosses the k-th line between columns, its
height is n/d with integers n and d; the quotient is rounded, but its floor and ceiling are those of n/d as
long as n < 2^53: a fraction that is not an integer m misses it by at least 1/d, and half a unit in the last
place of m is less.  Hence beams of up to :data:`MAX_LENGTH` cells.

How it is done.  Each beam is mirrored to run to the right and upwards, and walked along the axis on which it
is longer.  It crosses its first cell, its last one, and the two cells beside each line between columns that
it meets: both lie in the row n/d rounded down.  In a corner, where n/d is an integer, only the right one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray

QUANTA = 4096
"""Parts of a cell to which the ends of beams are rounded."""
MAX_LENGTH = 16384
"""Cells per axis that a beam may span: 16384 * 4096 = 2^26, and products of two such numbers are exact."""
TOO_LONG = f"a beam is not finite or spans more than {MAX_LENGTH} cells; take a coarser resolution"


class Walks(NamedTuple):
    """Mirrored beams: integers held in floats, but ``start`` and ``signs``.

    ``columns (B,)`` and ``last_row (B,)`` count cells; ``offset (B,)``, ``rise (B,)`` and ``run (B,)`` are in
    squared quanta, so ratios of them are cells.  All columns are crossed; at column ``k`` the beam enters
    ``(rise k + offset) / run`` cells above its first row; ``last_row`` is the row in which it ends.
    ``start`` (B, 2) is the first cell (x, y), ``signs`` (B, 2) mark the mirrored axes, ``steep (B,)`` the
    beams whose columns are rows.
    """

    columns: IntArray
    offset: Array
    rise: Array
    run: Array
    last_row: Array
    start: IntArray
    signs: IntArray
    steep: BoolArray

    def of(self, beams: IntArray | BoolArray) -> Walks:
        """Return some of the beams."""
        return Walks(*(field[beams] for field in self))  # type: ignore[arg-type]


def walks(start: ArrayLike, ends: ArrayLike) -> Walks:
    """Prepare beams from ``start`` (2,) to ``ends`` (B, 2), in cells, for the walk along their longer axis.

    Raises
    ------
    ValueError
        If a point is not finite, or a beam spans more than ``MAX_LENGTH`` cells.
    """
    p = np.rint(np.asarray(start, np.float64) * QUANTA)
    delta = np.rint(np.asarray(ends, np.float64).reshape(-1, 2) * QUANTA) - p
    d = np.abs(delta)
    if not (d <= MAX_LENGTH * QUANTA).all():
        raise ValueError(TOO_LONG)
    signs = np.where(delta < 0, -1.0, 1.0)
    first = np.floor(signs * p / QUANTA)  # first cell of the mirrored beam
    inside = signs * p - first * QUANTA  # in [0, QUANTA)
    steep = d[:, 1] > d[:, 0]
    du, dv = np.where(steep, d.T[::-1], d.T)
    pu, pv = np.where(steep, inside.T[::-1], inside.T)
    columns = np.maximum(np.ceil((pu + du) / QUANTA), 1.0)
    run = np.maximum(du * QUANTA, 1.0)
    cells = np.where(signs < 0, -1 - first, first).astype(np.int64)
    return Walks(
        columns=columns.astype(np.int64),
        offset=pv * du - pu * dv,  # eq-beam-height: numerator at k = 0; rise and run are the rest
        rise=QUANTA * dv,
        run=run,
        last_row=np.maximum(np.ceil((pv + dv) / QUANTA) - 1.0, 0.0),
        start=cells,
        signs=signs.astype(np.int64),
        steep=steep,
    )


class Crossings(NamedTuple):
    """Cells that beams cross: ``beam`` (N,), ``cells`` (N, 2) as (row, column); each pair once."""

    beam: IntArray
    cells: IntArray


def crossed_cells(start: ArrayLike, ends: ArrayLike) -> Crossings:
    """Return every cell that each beam crosses, once, in the order of the beams and along each.

    Parameters
    ----------
    start, ends : array_like, shapes (2,), (B, 2)
        (x, y) in cells.

    Raises
    ------
    ValueError
        As :func:`walks`.

    Notes
    -----
    A beam that runs to the right and ends on the left edge of a cell does not cross that cell.

    Examples
    --------
    >>> crossed_cells([0.5, 0.5], [[2.5, 1.5]]).cells.tolist()
    [[0, 0], [0, 1], [1, 1], [1, 2]]
    >>> crossed_cells([0.5, 0.5], [[-1.5, 2.5]]).cells.tolist()  # through two corners
    [[0, 0], [1, -1], [2, -2]]
    """
    w = walks(start, ends)
    every, last = np.arange(len(w.columns)), w.columns - 1
    line = np.arange(1, int(last.max(initial=0)) + 1)[:, None]
    row, corner = _rows_at_lines(w.rise, w.offset, w.run, np.minimum(line, last))
    met = line <= last
    (k, right), (m, left) = np.nonzero(met), np.nonzero(met & ~corner)
    beam = np.concatenate([every, every, right, left])
    column = np.concatenate([0 * every, last, k + 1, m])
    height = np.concatenate([0 * every, w.last_row, row[k, right], row[m, left]]).astype(np.int64)
    order = np.lexsort((height, column, beam))
    beam, column, height = beam[order], column[order], height[order]
    again = np.zeros(len(beam), dtype=np.bool_)  # a cell to the right of one line and to the left of the next
    again[1:] = (np.diff(beam) == 0) & (np.diff(column) == 0) & (np.diff(height) == 0)
    beam, column, height = beam[~again], column[~again], height[~again]
    steep = w.steep[beam]
    walked = np.stack([np.where(steep, height, column), np.where(steep, column, height)], 1)
    cells = w.start[beam] + w.signs[beam] * walked
    return Crossings(beam, cells[:, ::-1].copy())


def _rows_at_lines(rise: Array, offset: Array, run: Array, line: ArrayLike) -> tuple[Array, BoolArray]:
    """Rows in which mirrored beams cross lines between columns, and whether they do so in a corner.

    Implements :eq:`eq-beam-height`.
    Both cells beside the line are crossed; in a corner the right one only.
    """
    height = rise * np.asarray(line)
    height += offset
    height /= run
    row = np.floor(height)
    return row, row == height
