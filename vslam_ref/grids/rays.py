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
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, BoolArray, IntArray

QUANTA = 4096
"""Parts of a cell to which the ends of beams are rounded."""
MAX_LENGTH = 16384
"""Cells per axis that a beam may span: 16384 * 4096 = 2^26, and products of two such numbers are exact."""
GROUP = 40
"""Columns of all beams that are walked together: more would leave the processor's cache."""
UNSEEN, GRAZE, MISS, HIT = 0, 1, 2, 3
"""What a scan says of a cell; the larger one counts.  GRAZE is a miss just before the beam's own end."""
TOO_LONG = f"a beam is not finite or spans more than {MAX_LENGTH} cells; take a coarser resolution"
OUTSIDE = "a beam leaves the map, or comes within a cell of its border; grow the map first"


class BeamsInCells(NamedTuple):
    """Beams of one scan on a map, in cells from the map's corner (no unit; times the resolution: metres).

    Attributes
    ----------
    start : ndarray, shape (2,)
        (x, y) of the laser.
    ends : ndarray, shape (B, 2)
        (x, y) of the beams' ends.
    hit : ndarray of bool, shape (B,)
        Whether something is at the end.  The other beams were cut, or nothing came back.
    """

    start: Array
    ends: Array
    hit: BoolArray


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


def _cut(w: Walks, columns: IntArray) -> Walks:
    """Beams without their last ``columns`` (B,); those that had no more have none left."""
    left = np.maximum(w.columns - columns, 0)
    top = np.ceil((w.rise * left + w.offset) / w.run) - 1.0  # the row at which the last column is left
    return w._replace(columns=left, last_row=np.where(columns > 0, np.maximum(top, 0.0), w.last_row))


def mark_beams(shape: tuple[int, int], beams: BeamsInCells, graze: int = 0) -> NDArray[np.uint8]:
    """Return what a scan says of a window (rows, columns): MISS where beams cross, HIT at their ends.

    A cell in which one beam ends and which another crosses is a HIT: the scan is one observation,
    and the thing need not fill the cell.  A cell that one beam grazes and another misses is a MISS.

    Parameters
    ----------
    shape : tuple of two ints
        Rows, columns of the window; all beams lie in it.
    beams : BeamsInCells
        From the window's corner.
    graze : int
        Cells before a hit, counted along the beam's longer axis, in which it leaves GRAZE and no MISS.

    Returns
    -------
    ndarray of uint8, shape (rows, columns)
        UNSEEN, GRAZE, MISS or HIT.
    """
    start, ends, hit = beams
    w = walks(start, ends)
    marks = np.zeros(shape[0] * shape[1], dtype=np.uint8)
    if graze > 0:
        _write(marks, shape[1], w.of(hit), GRAZE, graze + 1)
        w = _cut(w, np.where(hit, graze + 1, 0))
    _write(marks, shape[1], w, MISS)
    marks[end_cells(ends[hit]) @ [1, shape[1]]] = HIT
    return marks.reshape(shape)


def _write(marks: NDArray[np.uint8], columns: int, w: Walks, mark: int, last: int = MAX_LENGTH + 1) -> None:
    """Write ``mark`` to the cells that beams cross in their ``last`` columns.

    The first cell and one in the column before these are written, too: what is right there must come later.

    The plain form is that of :func:`crossed_cells`: all lines of all beams in one array.  It takes twice as
    long, and OG-1 would be missed (16 times as fast as loops, where 30 are asked).  So the beams are sorted,
    walked in groups of columns that stay in the cache, and counted in floats.
    """
    lines = np.minimum(w.columns - 1.0, last)
    order = np.argsort(-lines)  # long beams first
    order = order[: np.count_nonzero(w.columns)]
    w, lines = w.of(order), lines[order]
    strides = (w.signs * [1, columns]).T
    along, across = np.where(w.steep, strides[::-1], strides)
    first = w.start @ [1, columns]
    skipped = w.columns - 1 - lines
    marks[first] = mark
    marks[first + along * (w.columns - 1) + across * w.last_row.astype(np.int64)] = mark

    # all other cells lie beside a line between columns; in floats, as their products are vector code
    offset, start = w.offset + w.rise * skipped, (first + along * skipped).astype(np.float64)
    along_of, across_of = along.astype(np.float64), across.astype(np.float64)
    whole = np.int32 if marks.size < 2**31 else np.int64  # from floats to int32 first: vector code
    most = int(lines.max(initial=0))
    for k in range(1, most + 1, GROUP):
        n = np.count_nonzero(lines >= k)
        line = np.arange(float(k), min(k + GROUP, most + 1))[:, None]
        if lines[n - 1] < line[-1]:
            line = np.minimum(line, lines[:n])  # of a beam that ends before, the last line is repeated
        row, corner = _rows_at_lines(w.rise[:n], offset[:n], w.run[:n], line)
        row *= across_of[:n]
        column = line * along_of[:n]
        column += start[:n]
        row += column
        right = row.astype(whole).astype(np.int64)
        left = right - along[:n]
        np.copyto(left, right, where=corner)
        marks[right] = mark
        marks[left] = mark


def end_cells(ends: Array) -> IntArray:
    """Return the cells (B, 2), x first, in which beams end, after the rounding of :func:`walks`."""
    cells: IntArray = np.floor(np.rint(ends * QUANTA) / QUANTA).astype(np.int64)
    return cells


class Look(NamedTuple):
    """What a scan says of some rows and columns of a map: ``window (r, c)`` of UNSEEN, GRAZE, MISS or HIT."""

    rows: slice
    columns: slice
    window: NDArray[np.uint8]


def look(shape: tuple[int, int], beams: BeamsInCells, graze: int = 0) -> Look:
    """Return what a scan says of a map of ``shape`` (rows, columns), in its bounding window.

    Parameters
    ----------
    shape, beams, graze : tuple of two ints, BeamsInCells, int
        As for :func:`mark_beams`.

    Raises
    ------
    ValueError
        As :func:`walks`, or if a beam comes within a cell of the map's border.
    """
    start, ends, _ = beams
    if not (np.abs(ends - start) <= MAX_LENGTH).all():
        raise ValueError(TOO_LONG)
    low = np.floor(np.minimum(ends.min(axis=0), start)).astype(np.int64) - 1
    high = np.floor(np.maximum(ends.max(axis=0), start)).astype(np.int64) + 2
    if (low < 0).any() or high[0] > shape[1] or high[1] > shape[0]:
        raise ValueError(OUTSIDE)
    inside = beams._replace(start=start - low, ends=ends - low)
    window = mark_beams((int(high[1] - low[1]), int(high[0] - low[0])), inside, graze)
    return Look(slice(low[1], high[1]), slice(low[0], high[0]), window)


def looked_at(
    shape: tuple[int, int], beams: BeamsInCells, graze: int = 0
) -> tuple[IntArray, IntArray, NDArray[np.uint8]]:
    """Rows and columns (n,) of the cells that a scan looks at, and what it says of each; as :func:`look`."""
    rows, columns, window = look(shape, beams, graze)
    where = np.flatnonzero(window)  # in two dimensions ten times slower
    row, column = np.divmod(where, window.shape[1])
    return row + rows.start, column + columns.start, window.reshape(-1)[where]
