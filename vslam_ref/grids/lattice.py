"""The cells of the plane: a square lattice that grows, anchored at the world's origin.

Cell (i, j) of the infinite lattice is the half-open square [i, i+1) x [j, j+1) times the resolution, so every
point lies in exactly one cell.  A :class:`Lattice` is a rectangle of it.  It grows by whole blocks of cells,
so that cells never move and growing is rare.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, IntArray

BLOCK = 64
"""Cells by whose multiples a rectangle grows."""
MAX_CELLS = 16_000_000
"""Cells that a rectangle may have: 400 m x 400 m at 0.1 m.  Five numbers a cell then fill 640 MB."""


@dataclass(frozen=True)
class Lattice:
    """A rectangle of cells.

    Parameters
    ----------
    resolution : float
        Side of a cell, in metres.
    corner : tuple of two ints
        (column, row) of the rectangle's first cell on the infinite lattice.
    shape : tuple of two ints
        (rows, columns); (0, 0) holds nothing.

    Raises
    ------
    ValueError
        If the resolution is not positive and finite, or the rectangle has more than ``MAX_CELLS`` cells.

    Examples
    --------
    >>> lattice = Lattice(0.5).grown([0.2, 0.2], [1.4, 0.2])
    >>> lattice.shape, lattice.origin_xy
    ((64, 64), (0.0, 0.0))
    >>> lattice.cells_from_world([[1.4, 0.2]])
    array([[0, 2]])
    >>> lattice.world_from_cells([[0, 2]])
    array([[1.25, 0.25]])
    """

    resolution: float
    corner: tuple[int, int] = (0, 0)
    shape: tuple[int, int] = (0, 0)

    def __post_init__(self) -> None:
        """Refuse rectangles that cannot be."""
        if not (math.isfinite(self.resolution) and self.resolution > 0):
            raise ValueError(f"resolution {self.resolution!r} m: must be positive and finite")
        rows, columns = self.shape
        if rows < 0 or columns < 0:
            raise ValueError(f"shape {self.shape!r}: must not be negative")
        if rows * columns > MAX_CELLS:
            size = f"{columns * self.resolution:g} m x {rows * self.resolution:g} m"
            raise ValueError(
                f"a map of {size} at {self.resolution:g} m needs {rows * columns} cells, more than the limit "
                f"of {MAX_CELLS}; take a coarser resolution or a smaller range"
            )

    @property
    def origin_xy(self) -> tuple[float, float]:
        """World coordinates of the lower left corner of cell [0, 0], in metres."""
        return self.corner[0] * self.resolution, self.corner[1] * self.resolution

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.shape[0] * self.shape[1]

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """(left, right, bottom, top) in metres, as pictures want it."""
        x, y = self.origin_xy
        return x, x + self.shape[1] * self.resolution, y, y + self.shape[0] * self.resolution

    def lattice_from_world(self, xy_world: ArrayLike) -> Array:
        """World points (..., 2) in cells, x first, measured from the rectangle's corner."""
        return np.asarray(xy_world, dtype=np.float64) / self.resolution - np.asarray(self.corner, np.float64)

    def cells_from_world(self, xy_world: ArrayLike) -> IntArray:
        """(row, column) of the cells (N, 2) that hold world points (N, 2); they may lie outside.

        Raises
        ------
        ValueError
            If a point is not finite.
        """
        # whole cells first, then the corner: a point just below a line must not be rounded across it
        at = np.floor(np.asarray(xy_world, np.float64) / self.resolution) - np.asarray(
            self.corner, np.float64
        )
        if not np.isfinite(at).all():
            raise ValueError("points must be finite to lie in a cell")
        cells: IntArray = at[..., ::-1].astype(np.int64)
        return cells

    def world_from_cells(self, cells: ArrayLike) -> Array:
        """World coordinates (N, 2) of the centres of cells (N, 2), given as (row, column)."""
        centre = np.asarray(cells, dtype=np.float64)[..., ::-1] + 0.5
        xy: Array = (centre + np.asarray(self.corner, np.float64)) * self.resolution
        return xy

    def inside(self, cells: ArrayLike) -> NDArray[np.bool_]:
        """Whether (row, column) pairs (N, 2) lie in the rectangle."""
        rc = np.asarray(cells)
        held = (rc >= 0) & (rc < np.asarray(self.shape))
        return held[..., 0] & held[..., 1]

    def grown(self, lower_xy: ArrayLike, upper_xy: ArrayLike) -> Lattice:
        """Return the rectangle, grown by whole blocks to hold two world points (2,), m, and all between.

        Returns itself where it holds them already.

        Raises
        ------
        ValueError
            If a point is not finite, or the rectangle would exceed ``MAX_CELLS``.
        """
        points = np.array([lower_xy, upper_xy], dtype=np.float64) / self.resolution
        if not (np.isfinite(points).all() and np.abs(points).max() < 2**52):
            raise ValueError(f"points {lower_xy!r} and {upper_xy!r}: must be finite and within reach")
        # whole cells as Python integers: they cannot overflow
        low = [BLOCK * math.floor(v / BLOCK) for v in points[0].tolist()]
        high = [BLOCK * (math.floor(v / BLOCK) + 1) for v in points[1].tolist()]
        if self.size:
            last = (self.corner[0] + self.shape[1], self.corner[1] + self.shape[0])
            low = [min(a, b) for a, b in zip(low, self.corner, strict=True)]
            high = [max(a, b) for a, b in zip(high, last, strict=True)]
        shape = (high[1] - low[1], high[0] - low[0])
        if shape == self.shape and (low[0], low[1]) == self.corner:
            return self
        return Lattice(self.resolution, (low[0], low[1]), shape)

    def moved(self, layer: Array, old: Lattice, fill: float) -> Array:
        """Return ``layer`` (rows, columns) of ``old`` on this larger lattice; new cells hold ``fill``."""
        new = np.full(self.shape, fill)
        row, column = old.corner[1] - self.corner[1], old.corner[0] - self.corner[0]
        new[row : row + old.shape[0], column : column + old.shape[1]] = layer
        return new

    def part(self, rows: slice, columns: slice) -> Lattice:
        """Return the rectangle of some rows and columns of this one."""
        first_row, last_row, _ = rows.indices(self.shape[0])
        first_column, last_column, _ = columns.indices(self.shape[1])
        corner = (self.corner[0] + first_column, self.corner[1] + first_row)
        shape = (max(0, last_row - first_row), max(0, last_column - first_column))
        return Lattice(self.resolution, corner, shape)
