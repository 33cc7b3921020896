"""What a scan says of the cells of a map: missed, grazed or hit.

All lengths are counted in cells and have no unit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.grids.rays import MAX_LENGTH, QUANTA, TOO_LONG, Walks, _rows_at_lines, walks

GROUP = 40
"""Columns of all beams that are walked together: more would leave the processor's cache."""
UNSEEN, GRAZE, MISS, HIT = 0, 1, 2, 3
"""What a scan says of a cell; the larger one counts.  GRAZE is a miss just before the beam's own end."""
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

    The plain form is that of :func:`~vslam_ref.grids.rays.crossed_cells`: all lines of all beams in one
    array.  It takes twice as long, and OG-1 would be missed (16 times as fast as loops, where 30 are asked).
    So the beams are sorted, walked in groups of columns that stay in the cache, and counted in floats.
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
    """Return the cells (B, 2), x first, in which beams end, rounded as by ``walks``."""
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
        As :func:`~vslam_ref.grids.rays.walks`, or if a beam comes within a cell of the map's border.
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
