"""A laser log with known poses, drawn into S, D and a plain grid; things in D are followed."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.carmen import CarmenLog
from vslam_ref.datasets.text import FormatError
from vslam_ref.grids import MapConfig, PlainMap, StaticDynamicMap
from vslam_ref.grids.clusters import Clusters, TrackConfig, Tracker, find_clusters
from vslam_ref.grids.lattice import Lattice
from vslam_ref.grids.log_odds import OCCUPIED, LogOddsGrid, entropy_bits
from vslam_ref.grids.scan import unit_vectors
from vslam_ref.support.config import assume


@dataclass(frozen=True)
class GridConfig:
    """Maps and tracks of a log."""

    map: MapConfig = field(default_factory=MapConfig)
    tracks: TrackConfig = field(default_factory=TrackConfig)
    video_frames: int = assume(300, "", "half a minute at ten a second; 0 for none")

    def __post_init__(self) -> None:
        """Check the number of frames."""
        if self.video_frames < 0:
            raise ValueError(f"video_frames={self.video_frames}: must not be negative")


class Moment(NamedTuple):
    """The state after one scan, for those who draw it: all of it changes with the next.

    ``window`` is the rows and columns that will have been looked at in the end.
    """

    number: int
    window: tuple[slice, slice]
    T_world_laser: Array
    static: LogOddsGrid
    plain: LogOddsGrid
    clusters: Clusters
    tracker: Tracker


class Mapped(NamedTuple):
    """The end of a log.

    ``dynamic_scans`` (rows, columns) counts in how many scans each cell was decided dynamic; ``last_dynamic``
    when it was last (NaN: never).  ``seconds`` is the time that S and D took, without reading and drawing.
    """

    log: CarmenLog
    config: GridConfig
    map: StaticDynamicMap
    plain: PlainMap
    tracker: Tracker
    dynamic_scans: IntArray
    last_dynamic: Array
    seconds: float

    def numbers(self) -> dict[str, Any]:
        """Return what the command prints and writes as JSON."""
        m, observed = self.map, self.map.observed()
        cells = int(np.count_nonzero(observed))
        bits = float(entropy_bits(m.static().log_odds[observed]).mean()) if cells else 0.0
        plain = float(entropy_bits(self.plain.occupied().log_odds[observed]).mean()) if cells else 0.0
        return {
            "log": self.log.path.name,
            "scans": m.scans,
            "backward_stamps": self.log.backward_stamps,
            "beams": m.beams.beams,
            "beams_hit": m.beams.hits,
            "beams_no_return": m.beams.no_return,
            "beams_not_a_number": m.beams.not_a_number,
            "beams_not_positive": m.beams.not_positive,
            "other_messages": self.log.others,
            "resolution": m.lattice.resolution,
            "cells": cells,
            "seconds": self.seconds,
            "scans_per_s": m.scans / self.seconds if self.seconds > 0 else 0.0,
            "entropy": bits,
            "entropy_plain": plain,
            "static_cells": int(np.count_nonzero(m.static().states == OCCUPIED)),
            "plain_cells": int(np.count_nonzero(self.plain.occupied().states == OCCUPIED)),
            "dynamic_cells": int(np.count_nonzero(self.dynamic_scans)),
            "dynamic_objects": len(self.tracker.moved),
        }


def bounds(log: CarmenLog, usable_range: float, resolution: float, no_return: str = "ignore") -> Array:
    """World points (2, 2), lower and upper, between which all that a log says lies.

    With ``no_return="free"`` beams that met nothing say something, too: up to ``usable_range``.

    Raises
    ------
    FormatError
        If a map between them would exceed its limit, with the line of the pose that is farthest off.
    """
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for T_world_laser, ranges in zip(log.poses, log.ranges, strict=True):
        used = (ranges > 0) & ((ranges < log.scanner.max_range) | (no_return == "free"))
        angles = T_world_laser[2] + log.scanner.angles[used]
        length = np.minimum(ranges[used], usable_range)[:, None]
        ends = T_world_laser[:2] + length * unit_vectors(angles)
        points = np.vstack([T_world_laser[:2], ends])
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    try:
        Lattice(resolution).grown(low, high)
    except ValueError as error:
        off = np.linalg.norm(log.poses[:, :2] - np.median(log.poses[:, :2], axis=0), axis=1)
        far = int(np.argmax(off))
        what = f"{error}; the pose farthest off, ({log.poses[far, 0]:g}, {log.poses[far, 1]:g}) m, is here"
        raise FormatError(log.path, int(log.lines[far]), what) from None
    return np.stack([low, high])


def map_log(
    log: CarmenLog,
    config: GridConfig,
    see: Callable[[Moment], None] | None = None,
    progress: Callable[[int], None] | None = None,
) -> Mapped:
    """Run over a log.

    Parameters
    ----------
    log : CarmenLog
    config : GridConfig
    see : callable, optional
        Is shown every moment.
    progress : callable, optional
        Called with the number of scans so far.
    """
    grid, plain, tracker = StaticDynamicMap(config.map), PlainMap(config.map), Tracker(config.tracks)
    corners = bounds(log, config.map.usable_range, config.map.resolution, config.map.no_return)
    for each in (grid, plain):
        each.reserve(corners)
    low, high = grid.lattice.cells_from_world(corners).tolist()
    window = slice(low[0], high[0] + 1), slice(low[1], high[1] + 1)
    warm_up(log, config)
    dynamic_scans = np.zeros(grid.lattice.shape, dtype=np.int64)
    last_dynamic = np.full(grid.lattice.shape, np.nan)
    seconds = 0.0
    for number, (T_world_laser, scan) in enumerate(log.scans()):
        began = time.perf_counter()
        grid.update(T_world_laser, scan)
        seconds += time.perf_counter() - began
        plain.update(T_world_laser, scan)
        clusters = find_clusters(grid.dynamic(), config.tracks.join)
        at = clusters.cells[:, 0], clusters.cells[:, 1]
        dynamic_scans[at] += 1
        last_dynamic[at] = scan.time
        large = keep_large(clusters, config.tracks.least_cells)
        tracker.update(grid.time, large)
        if see is not None:
            see(Moment(number, window, T_world_laser, grid.static(), plain.occupied(), large, tracker))
        if progress is not None:
            progress(number + 1)
    return Mapped(log, config, grid, plain, tracker, dynamic_scans, last_dynamic, seconds)


def warm_up(log: CarmenLog, config: GridConfig) -> None:
    """Draw the first scan into a map of its own, so that no compilation is timed."""
    for T_world_laser, scan in log.scans():
        StaticDynamicMap(config.map).update(T_world_laser, scan)
        return


def keep_large(clusters: Clusters, least_cells: int) -> Clusters:
    """Return the clusters of at least ``least_cells`` cells; ``cells`` and ``labels`` stay those of all."""
    large = clusters.counts >= least_cells
    return clusters._replace(
        centres=clusters.centres[large], sizes=clusters.sizes[large], counts=clusters.counts[large]
    )
