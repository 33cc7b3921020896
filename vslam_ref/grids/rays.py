"""Every cell that a beam crosses, once, and without rounding.

A cell is the half-open square [i, i+1) x [j, j+1).  A beam *crosses* it if a part of the beam of positive
length lies in it.  Touching a corner is not crossing; running along an edge is crossing the cell that owns
the edge.

How it stays exact.  Ends of beams are rounded to 1/4096 of a cell (24 micrometres at 0.1 m).  Beyond that
all numbers are integers held in floating point.  Where a beam crosses the k-th line between columns, its
height is n/d with integers n and d; the quotient is rounded, but its floor and ceiling are those of n/d as
long as n < 2^53: a fraction that is no integer m misses it by at least 1/d, and half a unit in the last
place of m is less.  Hence beams of up to :data:`MAX_LENGTH` cells.

How it is done without sorting.  Each beam is mirrored to run to the right and upwards, and walked along
the axis on which it is longer.  In one column it then crosses one cell or two: from the row at which it
enters to the row at which it leaves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

QUANTA = 4096
"""Parts of a cell to which the ends of beams are rounded."""
MAX_LENGTH = 16384
"""Cells per axis that a beam may span: 16384 * 4096 = 2^26, and products of two such numbers are exact."""
GROUP = 64
"""Beams that are walked together."""
UNSEEN, GRAZE, MISS, HIT = 0, 1, 2, 3
"""What a scan says of a cell; the larger one counts.  GRAZE is a miss just before the beam's own end."""
TOO_LONG = f"a beam is not finite or spans more than {MAX_LENGTH} cells; take a coarser resolution"
OUTSIDE = "a beam leaves the map, or comes within a cell of its border; grow the map first"


class Walks(NamedTuple):
    """Mirrored beams, for (B,): integers held in floats, but ``start`` and ``signs``.

    ``columns`` are crossed; at column ``k`` the beam enters at the height ``(rise k + offset) / run`` cells
    above its first row; ``last_row`` is the row in which it ends.  ``start`` (B, 2) is the first cell (x, y),
    ``signs`` (B, 2) tell the mirrored axes, ``steep`` the beams whose columns are rows.
    """

    columns: IntArray
    offset: Array
    rise: Array
    run: Array
    last_row: Array
    start: IntArray
    signs: IntArray
    steep: NDArray[np.bool_]


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
    u = np.where(steep, 1, 0)
    beam = np.arange(len(d))
    du, dv = d[beam, u], d[beam, 1 - u]
    pu, pv = inside[beam, u], inside[beam, 1 - u]
    columns = np.maximum(np.ceil((pu + du) / QUANTA), 1.0)
    run = np.maximum(du * QUANTA, 1.0)
    cells = np.where(signs < 0, -1 - first, first).astype(np.int64)
    return Walks(
        columns=columns.astype(np.int64),
        offset=pv * du - pu * dv,
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
    start : array_like, shape (2,)
        (x, y) in cells.
    ends : array_like, shape (B, 2)
        (x, y) in cells.

    Raises
    ------
    ValueError
        As :func:`walks`.

    Notes
    -----
    The cell in which a beam ends is among them only if a part of positive length lies in it: a beam
    that runs to the right and ends on the left edge of a cell does not cross that cell.

    Examples
    --------
    >>> crossed_cells([0.5, 0.5], [[2.5, 1.5]]).cells.tolist()
    [[0, 0], [0, 1], [1, 1], [1, 2]]
    >>> crossed_cells([0.5, 0.5], [[-1.5, 2.5]]).cells.tolist()  # through two corners
    [[0, 0], [1, -1], [2, -2]]
    """
    w = walks(start, ends)
    every = np.arange(len(w.columns))
    rows = _rows_of_columns(w, every)
    here = np.arange(rows.enter.shape[1]) < w.columns[:, None]
    beam = np.concatenate([np.nonzero(here)[0], np.nonzero(here & (rows.leave > rows.enter))[0]])
    column = np.concatenate([np.nonzero(here)[1], np.nonzero(here & (rows.leave > rows.enter))[1]])
    row = np.concatenate([rows.enter[here], rows.leave[here & (rows.leave > rows.enter)]]).astype(np.int64)
    order = np.lexsort((row, column, beam))
    beam, column, row = beam[order], column[order], row[order]
    steep = w.steep[beam]
    walked = np.stack([np.where(steep, row, column), np.where(steep, column, row)], 1)
    cells = w.start[beam] + w.signs[beam] * walked
    return Crossings(beam, cells[:, ::-1].copy())


class _Rows(NamedTuple):
    """Columns (G, K) of beams, and the rows at which they enter and leave; the last column is repeated."""

    column: Array
    enter: Array
    leave: Array


def _rows_of_columns(w: Walks, beams: IntArray) -> _Rows:
    """Rows in which some mirrored beams cross each of their columns."""
    last = w.columns[beams] - 1
    k = np.minimum(np.arange(int(last.max(initial=0)) + 2.0), last[:, None])
    height = w.rise[beams, None] * k
    height += w.offset[beams, None]
    height /= w.run[beams, None]  # at the left line of the column
    enter = np.floor(height[:, :-1])
    enter[:, :1] = 0.0
    enter[last == 0] = 0.0  # the first column, repeated
    leave = np.ceil(height[:, 1:])  # at the right line, seen from below
    leave -= 1.0
    leave[np.arange(len(last)), last] = w.last_row[beams]
    return _Rows(k[:, :-1], enter, np.maximum(leave, enter, out=leave))


def _cut(w: Walks, columns: IntArray) -> Walks:
    """Beams without their last ``columns`` (B,); those that had no more have none left."""
    left = np.maximum(w.columns - columns, 0)
    top = np.ceil((w.rise * left + w.offset) / w.run) - 1.0  # the row at which the last column is left
    return w._replace(columns=left, last_row=np.where(columns > 0, np.maximum(top, 0.0), w.last_row))


def _rows_of_last_columns(w: Walks, beams: IntArray, columns: int) -> _Rows:
    """:func:`_rows_of_columns` for the last ``columns`` only; of fewer the first is repeated."""
    last = w.columns[beams, None] - 1
    k = np.maximum(last - np.arange(columns), 0).astype(np.float64)
    rise, offset, run = w.rise[beams, None], w.offset[beams, None], w.run[beams, None]
    enter = np.where(k == 0, 0.0, np.floor((rise * k + offset) / run))
    leave = np.where(k == last, w.last_row[beams, None], np.ceil((rise * (k + 1) + offset) / run) - 1.0)
    return _Rows(k, enter, np.maximum(leave, enter))


def mark_beams(
    window: NDArray[np.uint8], start: Array, ends: Array, hit: NDArray[np.bool_], graze: int = 0
) -> None:
    """Mark in ``window`` (rows, columns) what a scan says: MISS where beams cross, HIT at their ends.

    Parameters
    ----------
    window : ndarray of uint8, shape (rows, columns)
        Changed in place; all beams lie in it.
    start : ndarray, shape (2,)
        (x, y) in cells from the window's corner.
    ends : ndarray, shape (B, 2)
        (x, y) in cells from the window's corner.
    hit : ndarray of bool, shape (B,)
        Whether something is at the end.  The other beams were cut, or nothing came back.
    graze : int
        Cells before a hit, counted along the beam's longer axis, in which it leaves GRAZE and no MISS.

    Notes
    -----
    A cell in which one beam ends and which another crosses is a HIT: the scan is one observation,
    and the thing need not fill the cell.  A cell that one beam grazes and another misses is a MISS.
    """
    seen = _marks(window.shape[0], window.shape[1], start, ends, hit, graze)
    np.maximum(window, seen, out=window)


def _marks(
    rows: int, columns: int, start: Array, ends: Array, hit: NDArray[np.bool_], graze: int = 0
) -> NDArray[np.uint8]:
    """What a scan says of a window that nothing was said of before."""
    w = walks(start, ends)
    strides = np.array([1, columns])
    steps = (w.signs * strides).astype(np.float64)
    along = np.where(w.steep, steps[:, 1], steps[:, 0])
    across = np.where(w.steep, steps[:, 0], steps[:, 1])
    first = (w.start @ strides).astype(np.float64)
    marks = np.zeros(rows * columns, dtype=np.uint8)

    def write(beams: IntArray, walked: _Rows, mark: int) -> None:
        column = walked.column * along[beams, None]
        column += first[beams, None]
        for row in (walked.enter, walked.leave):
            row *= across[beams, None]
            row += column
            marks[row.astype(np.int64)] = mark

    if graze > 0:
        grazing = np.flatnonzero(hit)
        write(grazing, _rows_of_last_columns(w, grazing, graze + 1), GRAZE)
        w = _cut(w, np.where(hit, graze + 1, 0))
    order = np.argsort(w.columns)  # like lengths together
    order = order[np.searchsorted(w.columns[order], 1) :]
    for beams in (order[n : n + GROUP] for n in range(0, len(order), GROUP)):
        write(beams, _rows_of_columns(w, beams), MISS)
    marks[end_cells(ends[hit]) @ strides] = HIT
    return marks.reshape(rows, columns)


def end_cells(ends: Array) -> IntArray:
    """Return the cells (B, 2), x first, in which beams end, after the rounding of :func:`walks`."""
    cells: IntArray = np.floor(np.rint(ends * QUANTA) / QUANTA).astype(np.int64)
    return cells


class Look(NamedTuple):
    """What a scan says of some rows and columns of a map: ``window`` holds UNSEEN, GRAZE, MISS or HIT."""

    rows: slice
    columns: slice
    window: NDArray[np.uint8]

    @property
    def hits(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the window's hits."""
        found = np.flatnonzero(self.window.reshape(-1) == HIT)  # in two dimensions ten times slower
        row, column = np.divmod(found, self.window.shape[1])
        return row, column


def look(shape: tuple[int, int], start: Array, ends: Array, hit: NDArray[np.bool_], graze: int = 0) -> Look:
    """Return what a scan says of a map of ``shape`` (rows, columns), in its bounding window.

    Other arguments as for :func:`mark_beams`.

    Raises
    ------
    ValueError
        As :func:`walks`, or if a beam comes within a cell of the map's border.
    """
    if not (np.abs(ends - start) <= MAX_LENGTH).all():
        raise ValueError(TOO_LONG)
    low = np.floor(np.minimum(ends.min(axis=0), start)).astype(np.int64) - 1
    high = np.floor(np.maximum(ends.max(axis=0), start)).astype(np.int64) + 2
    if (low < 0).any() or high[0] > shape[1] or high[1] > shape[0]:
        raise ValueError(OUTSIDE)
    window = _marks(int(high[1] - low[1]), int(high[0] - low[0]), start - low, ends - low, hit, graze)
    return Look(slice(low[1], high[1]), slice(low[0], high[0]), window)
