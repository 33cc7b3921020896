"""Which cells of a grid a segment or a disc covers: exact, and independent of the maps that are judged by it.

A cell (row, column) is the square ``origin + resolution * [column, column + 1) x [row, row + 1)``: rows
grow with y, columns with x.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray


class Cells(NamedTuple):
    """A raster.

    Attributes
    ----------
    origin_xy : tuple of two floats
        Lower left corner of cell (0, 0), metres.
    resolution : float
        Side of a cell, metres.
    shape : tuple of two ints
        Rows, columns.
    """

    origin_xy: tuple[float, float]
    resolution: float
    shape: tuple[int, int]


class Covered(NamedTuple):
    """Cells met by segments: number ``segment (k,)``, ``row (k,)``, ``column (k,)``; no unit.  In order."""

    segment: IntArray
    row: IntArray
    column: IntArray


def checked_cells(cells: Cells) -> Cells:
    """Return the raster; ``ValueError`` if it is not a valid one."""
    (x, y), r, shape = cells
    if not (np.isfinite([x, y, r]).all() and r > 0 and len(shape) == 2 and min(shape) >= 1):
        raise ValueError(
            f"cells {tuple(cells)}: need a finite origin, a resolution > 0 and a shape of at least 1 x 1"
        )
    return cells


def cells_on_segments(cells: Cells, start: ArrayLike, end: ArrayLike) -> Covered:
    """Cells whose inside each segment crosses, once each, in order.

    A segment crosses the lines of the raster at known parameters.  Sorted, these cut it into pieces, each
    of which lies in one cell: that of its middle.  Pieces shorter than 1e-12 of the segment (it passes
    through a corner) count as none.

    Parameters
    ----------
    cells : Cells
    start, end : array_like, shape (n, 2)
        Metres.

    Returns
    -------
    Covered
        Cells outside of the raster are left out.

    Examples
    --------
    >>> met = cells_on_segments(Cells((0.0, 0.0), 1.0, (2, 3)), [[0.5, 0.5]], [[2.5, 1.0]])
    >>> met.row, met.column
    (array([0, 0, 0]), array([0, 1, 2]))
    """
    cells = checked_cells(cells)
    a = (np.asarray(start, dtype=np.float64).reshape(-1, 2) - cells.origin_xy) / cells.resolution
    b = (np.asarray(end, dtype=np.float64).reshape(-1, 2) - cells.origin_xy) / cells.resolution
    if a.shape != b.shape or not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError(f"segments from {a.shape} to {b.shape}: need finite (n, 2) and (n, 2)")
    if len(a) == 0:
        return Covered(*(np.zeros(0, dtype=np.int64) for _ in range(3)))
    d = b - a
    t = np.concatenate([_crossings(a[:, 0], d[:, 0]), _crossings(a[:, 1], d[:, 1])], axis=1)
    t = np.sort(np.concatenate([np.zeros((len(a), 1)), t, np.ones((len(a), 1))], axis=1), axis=1)
    middle, length = (t[:, 1:] + t[:, :-1]) / 2, np.diff(t, axis=1)
    segment, piece = np.nonzero(length > 1e-12)
    at = a[segment] + middle[segment, piece][:, None] * d[segment]
    column, row = np.floor(at).astype(np.int64).T
    within = (row >= 0) & (row < cells.shape[0]) & (column >= 0) & (column < cells.shape[1])
    return Covered(segment[within], row[within], column[within])


def _crossings(a: Array, d: Array) -> Array:
    """Parameters in (0, 1) at which a + t d is a whole number, padded with 1; (n, most)."""
    low, high = np.minimum(a, a + d), np.maximum(a, a + d)
    first = np.floor(low) + 1.0
    number = np.maximum(np.ceil(high) - first, 0.0)
    lines = first[:, None] + np.arange(int(number.max(initial=0.0)))
    t = (lines - a[:, None]) / np.where(d == 0.0, 1.0, d)[:, None]
    inside = (lines < high[:, None]) & (d != 0.0)[:, None]
    clipped: Array = np.where(inside, np.clip(t, 0.0, 1.0), 1.0)
    return clipped


def segment_cells(cells: Cells, segments: ArrayLike) -> BoolArray:
    """Raster of the cells that any of the segments (m, 4), metres, crosses."""
    s = np.asarray(segments, dtype=np.float64).reshape(-1, 4)
    raster = np.zeros(cells.shape, dtype=bool)
    met = cells_on_segments(cells, s[:, :2], s[:, 2:])
    raster[met.row, met.column] = True
    return raster


def disc_cells(cells: Cells, discs: ArrayLike) -> BoolArray:
    """Raster of the cells that share more than a point with any of the discs (m, 3).

    The point of the cell that is nearest to the centre decides.

    Examples
    --------
    >>> disc_cells(Cells((0.0, 0.0), 1.0, (1, 4)), [[1.5, 0.5, 0.6]]).astype(int)
    array([[1, 1, 1, 0]])
    """
    cells = checked_cells(cells)
    raster = np.zeros(cells.shape, dtype=bool)
    if not np.isfinite(np.asarray(discs, dtype=np.float64)).all():
        raise ValueError("discs: need finite places and radii")
    for x, y, r in (
        np.asarray(discs, dtype=np.float64).reshape(-1, 3) - [*cells.origin_xy, 0.0]
    ) / cells.resolution:
        rows = np.arange(max(int(np.floor(y - r)), 0), min(int(np.floor(y + r)) + 1, cells.shape[0]))
        columns = np.arange(max(int(np.floor(x - r)), 0), min(int(np.floor(x + r)) + 1, cells.shape[1]))
        dy = np.clip(y, rows, rows + 1.0) - y
        dx = np.clip(x, columns, columns + 1.0) - x
        near = dy[:, None] ** 2 + dx[None, :] ** 2 < r * r
        raster[np.ix_(rows, columns)] |= near
    return raster
