"""S and D against the truth, cell by cell, with true poses: one run.

What is counted, fixed before the runs:

* *static*: at the end of the run, cells that beams without noise met in at least ``looks`` scans.  The truth
  of a cell is that of the last scan that met it: no map can know what changed unseen.  Recall asks for the
  cells in which such beams *ended* in at least ``looks`` scans.
* *moving*: at every scan after the first ``warm_up`` seconds, cells that beams meet in this scan.  Recall
  asks for the cells in which a beam ends now and which a moving thing covers now; precision, of the
  decided cells, for those that a moving thing covers now.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.grids import InverseSensor, LogOddsGrid, MapConfig, PlainMap, StaticDynamicMap
from vslam_ref.grids.log_odds import OCCUPIED
from vslam_ref.worlds.floor_plan import (
    Cells,
    FloorPlanConfig,
    LaserConfig,
    Recording,
    cell_truth,
    cover,
    seen_cells,
)

MAPS = ("separated", "plain")
JUDGED = 0.2
"""The crowd that the aims are stated for."""


@dataclass(frozen=True)
class SeparationConfig:
    """The runs and what is counted."""

    runs: int = field(default=6, metadata={"reason": "shares differ by a point or two between runs"})
    seed: int = field(default=19, metadata={"reason": "any; fixed for repeatability"})
    densities: tuple[float, ...] = field(
        default=(0.0, 0.1, 0.2, 0.3, 0.4), metadata={"reason": "0 to 40 % of the free floor; 20 % is judged"}
    )
    looks: int = field(
        default=5, metadata={"reason": "a second of looking; S decides with two hits or three misses"}
    )
    warm_up: float = field(
        default=5.0, metadata={"reason": "D needs floor that was seen free before", "unit": "s"}
    )
    turn: float = field(
        default=0.0,
        metadata={"reason": "walls on middle lines of cells: truth is no matter of rounding", "unit": "rad"},
    )
    world: FloorPlanConfig = field(
        default_factory=lambda: FloorPlanConfig(laser=LaserConfig(beams=541)),
        metadata={"reason": "an office; half a degree, as indoor scanners have"},
    )
    map: MapConfig = field(
        default_factory=lambda: MapConfig(
            sensor=InverseSensor(s_miss=0.15, s_graze=0.3),
            d_memory="text",
            explained_by=0,
            graze=3,
            settle_seconds=5.0,
            settle_in_line=0.3,
            s_most=0.9999,
        ),
        metadata={
            "reason": "true poses: a miss is sure but where beams graze, and a wall heals at the third hit"
        },
    )
    plain: MapConfig = field(
        default_factory=MapConfig,
        metadata={"reason": "as it is: with misses of 0.2 it gains in precision what it loses in recall"},
    )

    def __post_init__(self) -> None:
        """Refuse studies that mean nothing."""
        if self.runs < 2 or self.looks < 1 or self.warm_up < 0:
            raise ValueError(
                f"runs={self.runs}, looks={self.looks}, warm_up={self.warm_up}: need 2, 1 and 0 at least"
            )
        if JUDGED not in self.densities or 0.0 not in self.densities:
            raise ValueError(f"densities={self.densities}: must hold 0 and the judged crowd {JUDGED}")


class CellCounts(NamedTuple):
    """Counts of one run.

    Attributes
    ----------
    static : ndarray, shape (2, 4)
        For S and the plain grid: decided and right, decided, asked for, asked for and decided.
    moving : ndarray, shape (4,)
        The same for D.
    on_people : ndarray, shape ()
        Share of the beams that end on a person.
    """

    static: Array
    moving: Array
    on_people: Array


def decided(grid: LogOddsGrid, cells: Cells) -> BoolArray:
    """Raster ``cells`` of what a map calls occupied; both lattices are anchored at (0, 0)."""
    first = np.round(np.array(cells.origin_xy) / cells.resolution).astype(int)
    raster = np.zeros(cells.shape, dtype=bool)
    at = np.array(grid.lattice.corner) - first
    rows, columns = np.nonzero(grid.states == OCCUPIED)
    rows, columns = rows + at[1], columns + at[0]
    held = (rows >= 0) & (rows < cells.shape[0]) & (columns >= 0) & (columns < cells.shape[1])
    raster[rows[held], columns[held]] = True
    return raster


def counts(says: BoolArray, counted: BoolArray, truth: BoolArray, asked: BoolArray) -> Array:
    """Decided and right, decided, asked for, asked for and decided."""
    return np.array(
        [(says & counted & truth).sum(), (says & counted).sum(), asked.sum(), (asked & says).sum()],
        dtype=np.float64,
    )


def precision_recall(count: Array) -> Array:
    """(..., 2) from counts (..., 4); 1 where nothing was decided, or asked for."""
    right, said, asked, found = np.moveaxis(np.asarray(count, dtype=np.float64), -1, 0)
    precision = np.where(said > 0, right / np.maximum(said, 1.0), 1.0)
    recall = np.where(asked > 0, found / np.maximum(asked, 1.0), 1.0)
    return np.stack([precision, recall], -1)


def measure(recording: Recording, config: SeparationConfig) -> CellCounts:
    """Draw all maps of one recording from true poses, and count."""
    cells = cover(recording, resolution=config.map.resolution)
    separated, plain = StaticDynamicMap(config.map), PlainMap(config.plain)
    met, ended = np.zeros(cells.shape, dtype=int), np.zeros(cells.shape, dtype=int)
    last, moving = np.zeros(cells.shape, dtype=bool), np.zeros(4)
    for k in range(len(recording)):
        scan = recording.scan(k)
        separated.update(recording.T_world_robot[k], scan)
        plain.update(recording.T_world_robot[k], scan)
        truth, seen = cell_truth(recording, k, cells), seen_cells(recording, k, cells)
        now = seen.crossed | seen.ended
        met += now
        ended += seen.ended & truth.static
        last[now] = truth.static[now]
        if recording.times[k] >= config.warm_up:
            says = decided(separated.dynamic(), cells)
            moving += counts(says, now, truth.moving, seen.ended & truth.moving)
    counted, asked = met >= config.looks, last & (ended >= config.looks)
    static = [counts(decided(m, cells), counted, last, asked) for m in (separated.static(), plain.occupied())]
    return CellCounts(np.stack(static), moving, np.array(recording.share_on_people))
