"""Truth for cells: who covers each one at a scan, and which the laser could see.  Lengths are in metres."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import BoolArray
from vslam_ref.geometry import so2
from vslam_ref.worlds.floor_plan.cells import Cells, cells_on_segments, disc_cells, segment_cells
from vslam_ref.worlds.floor_plan.recording import Recording


class CellTruth(NamedTuple):
    """Rasters of one scan; a cell that is neither is free, and one may be both.

    Attributes
    ----------
    static : ndarray of bool, shape (rows, columns)
        Covered by the outline of something whose pose did not change within the last T seconds.
    moving : ndarray of bool, shape (rows, columns)
        Covered now by something whose pose did change within the last T seconds.
    """

    static: BoolArray
    moving: BoolArray


class Seen(NamedTuple):
    """Rasters of one scan, by beams without noise and dropouts from the true pose.

    Attributes
    ----------
    crossed : ndarray of bool, shape (rows, columns)
        A beam went through the cell and ended in another one, or at the maximum range.
    ended : ndarray of bool, shape (rows, columns)
        A beam ended in the cell, on something.
    """

    crossed: BoolArray
    ended: BoolArray


def cover(recording: Recording, margin: float = 0.5, resolution: float = 0.1) -> Cells:
    """Raster that covers the whole floor with a margin; its origin is a whole number of cells from (0, 0)."""
    if not (np.isfinite([margin, resolution]).all() and margin >= 0 and resolution > 0):
        raise ValueError(f"margin={margin}, resolution={resolution}: need finite metres, >= 0 and > 0")
    ends = recording.segments.reshape(-1, 2)
    low = np.floor((ends.min(axis=0) - margin) / resolution) * resolution
    high = np.ceil((ends.max(axis=0) + margin) / resolution) * resolution
    columns, rows = np.round((high - low) / resolution).astype(int)
    return Cells((float(low[0]), float(low[1])), resolution, (int(rows), int(columns)))


def cell_truth(recording: Recording, k: int, cells: Cells) -> CellTruth:
    """Who covers each cell at scan k.

    Walls, doors and boxes cover the cells that their outline crosses; people those that their discs overlap.
    """
    s = recording.surfaces(k)
    moving_segment = recording.moving[k, s.segment_owner]
    moving_disc = recording.moving[k, s.disc_owner]
    static, moving = (
        segment_cells(cells, s.segments[is_it]) | disc_cells(cells, s.discs[disc_is_it])
        for is_it, disc_is_it in ((~moving_segment, ~moving_disc), (moving_segment, moving_disc))
    )
    return CellTruth(static, moving)


def seen_cells(recording: Recording, k: int, cells: Cells) -> Seen:
    """Which cells the laser could see at scan k."""
    T_world_robot, exact = recording.T_world_robot[k], recording.exact_ranges[k]
    met = np.isfinite(exact)
    reach = np.where(met, exact, recording.config.laser.max_range)
    angle = so2.wrap(T_world_robot[2] + recording.angles)
    ends = T_world_robot[:2] + reach[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    way = cells_on_segments(cells, np.broadcast_to(T_world_robot[:2], ends.shape), ends)
    last = np.append(way.segment[1:] != way.segment[:-1], True)
    crossed, ended = np.zeros(cells.shape, dtype=bool), np.zeros(cells.shape, dtype=bool)
    through = ~(last & met[way.segment])
    crossed[way.row[through], way.column[through]] = True
    at = np.floor((ends[met] - cells.origin_xy) / cells.resolution).astype(np.int64)
    inside = ((at >= 0) & (at < np.array(cells.shape[::-1]))).all(axis=1)
    ended[at[inside, 1], at[inside, 0]] = True
    return Seen(crossed, ended)
