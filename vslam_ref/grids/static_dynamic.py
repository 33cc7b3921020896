"""Two maps of a world in which things move: S, what stays, and D, what is moving now.

Each scan changes both, by A's chapter 4: the table of :mod:`inverse_sensor` is looked up with what S said of
a cell *before* the scan, and its log-odds are added.

    L(S_t) = L(S | o_t, S_{t-1}) + L(S_{t-1})                                                   (A§4.2)
    L(D_t) = L(D | o_t, S_{t-1}) + L(D_{t-1})        d_memory = "formula"                       (A§4.3)
    L(D_t) = L(D | o_t, S_{t-1})                     d_memory = "text"

Four rules are added, each with a switch:

* *lifetime*: a cell of D that was not looked at for ``d_lifetime`` seconds is unknown again.  D holds what is
  there now.
* *explained hits*: a hit within ``explained_by`` cells of a decided static cell is taken for that cell's, in
  both tables: noise of the range and of the pose makes walls no movers, and a wall that lost a cell gets
  it back.  0 is the table as it stands: a cell of a wall that was free once is lost for ever.
* *settling* (the ageing variant): what was hit on free floor for ``settle_seconds``, and never missed later
  than ``hit_gap`` seconds after a hit, has come to stay.  Longer times without a look do not count.  S
  forgets there that the floor was free, and takes it in.  ``None`` is the table as it stands: a chair put
  down on once-free floor is dynamic for ever.  ``settle_in_line`` is a shorter time for cells that continue
  a line: the next cell and the one behind it, in one of eight directions, are decided static.  What comes to
  stay there is mostly a wall that beams along it had freed; who leans on a wall continues no line.
* *grazing*: in the last ``graze`` cells before its own end a beam leaves a weaker word than a miss (see
  :mod:`inverse_sensor`).  0 is the table with two observations.

:data:`~vslam_ref.grids.map_config.AS_PRINTED` has none of the last three.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray
from vslam_ref.grids import rays
from vslam_ref.grids.canvas import Canvas
from vslam_ref.grids.log_odds import DECIDED_LOG_ODDS, FREE, OCCUPIED, UNKNOWN, LogOddsGrid, log_odds, states
from vslam_ref.grids.map_config import MapConfig

EIGHT = np.array([(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)])
"""Directions to the neighbours of a cell."""


class StaticDynamicMap(Canvas):
    """S and D, from one scan to the next.

    Implements A§4.1: of every cell, the probability that something static or something moving is there.

    Parameters
    ----------
    config : MapConfig

    Notes
    -----
    Five numbers a cell: the log-odds of S and D, and three times.

    Examples
    --------
    >>> from vslam_ref.grids import Scan
    >>> grid = StaticDynamicMap()
    >>> def look(time, wall):
    ...     return grid.update([0, 0, 0], Scan(np.zeros(1), np.array([wall]), 80.0, time))
    >>> for k in range(4):
    ...     _ = look(0.1 * k, 3.05)
    >>> _ = look(0.4, 2.05)  # something stands in the beam
    >>> grid.static().at([[3.05, 0.05], [2.05, 0.05]]).round(1)
    array([ 5.5, -4.2])
    >>> grid.dynamic().at([[3.05, 0.05], [2.05, 0.05]]).round(1)
    array([0. , 2.9])
    """

    def __init__(self, config: MapConfig | None = None) -> None:
        self.config = c = MapConfig() if config is None else config
        fills = {"static": 0.0, "dynamic": 0.0, "seen": -math.inf, "last_hit": -math.inf, "since": 0.0}
        super().__init__(c.resolution, c.usable_range, c.no_return, fills)
        self._steps = c.sensor.steps(c.d_high_where)
        self._limits = limits(c)

    def _draw(self, start: Array, ends: Array, hit: NDArray[np.bool_]) -> None:
        s, d, seen, last_hit, since = (layer.reshape(-1) for layer in self.layers.values())
        steps = self._steps
        columns = self.lattice.shape[1]
        apply_scan(
            s,
            d,
            seen,
            last_hit,
            since,
            columns,
            start,
            ends,
            hit,
            steps.static,
            steps.dynamic,
            self._limits,
            self.time,
        )

    def static(self) -> LogOddsGrid:
        """Return S, a view that later scans change."""
        return LogOddsGrid(self.lattice, self.layers["static"])

    def dynamic(self) -> LogOddsGrid:
        """Return D as it is now: cells that were not looked at for ``d_lifetime`` are unknown.

        With ``d_memory="text"``, all cells but those of the last scan are.
        """
        age = self.time - self.layers["seen"]
        oldest = max(self._limits[2], 0.0)
        return LogOddsGrid(self.lattice, np.where(age <= oldest, self.layers["dynamic"], 0.0))

    def observed(self) -> NDArray[np.bool_]:
        """Return which cells (rows, columns) were ever looked at."""
        seen: NDArray[np.bool_] = self.layers["seen"] > -math.inf
        return seen


def limits(config: MapConfig) -> Array:
    """Return what :func:`apply_scan` needs (8,).

    Bounds of S and D, lifetime, settling, gap of hits, reach of a wall, settling in a line, grazing.

    Without memory of D, its lifetime is negative: nothing is young enough.
    """
    bounds = log_odds([config.s_most, config.d_most])
    lifetime = config.d_lifetime if config.d_memory == "formula" else -1.0
    settle = math.inf if config.settle_seconds is None else config.settle_seconds
    in_line = settle if config.settle_in_line is None else min(config.settle_in_line, settle)
    return np.array(
        [*bounds, lifetime, settle, config.hit_gap, float(config.explained_by), in_line, float(config.graze)]
    )


@accelerated("grids:apply_scan")
def apply_scan(
    s: Array,
    d: Array,
    seen: Array,
    last_hit: Array,
    since: Array,
    columns: int,
    start: Array,
    ends: Array,
    hit: NDArray[np.bool_],
    steps_s: Array,
    steps_d: Array,
    limits: Array,
    now: float,
) -> None:
    """Change S and D, in place, by one scan.

    Implements :eq:`eq-static-recursion` (A§4.2) and :eq:`eq-dynamic-recursion` (A§4.3) in log-odds.

    Parameters
    ----------
    s, d : ndarray, shape (rows * columns,)
        Log-odds, row by row.
    seen, last_hit, since : ndarray, shape (rows * columns,)
        Times: of the last look, of the last hit of the present visit (-inf: none), and of its first hit,
        shifted by the time at which nobody looked.
    columns : int
        Cells in a row.
    start : ndarray, shape (2,)
        Where the laser is: (x, y) in cells from the map's corner.
    ends : ndarray, shape (B, 2)
        Where beams end, likewise; all inside.
    hit : ndarray of bool, shape (B,)
        Whether something is there.
    steps_s, steps_d : ndarray, shape (3, 3)
        From :meth:`InverseSensor.steps`.
    limits : ndarray, shape (8,)
        From :func:`limits`.
    now : float
        Time, later than before.
    """
    s_bound, d_bound, lifetime, settle, gap, reach, in_line, graze = limits.tolist()
    whole = [layer.reshape(-1, columns) for layer in (s, d, seen, last_hit, since)]
    look = rays.look(whole[0].shape, start, ends, hit, int(graze))
    rows, places, window = look
    missed, grazed, hits = window == rays.MISS, window == rays.GRAZE, look.hits
    at = hits[0] + rows.start, hits[1] + places.start
    explained = _near_static(whole[0], *at, int(reach))
    wait = np.where(_continues_line(whole[0], *at), in_line, settle) if in_line < settle else settle
    s, d, seen, last_hit, since = (layer[rows, places] for layer in whole)  # views

    # S_{t-1} in the cells that were hit
    s_hit = s[hits]
    unseen = now - seen[hits]
    unseen[unseen <= gap] = 0.0  # time at which nobody looked does not count
    began = np.where(last_hit[hits] == -np.inf, now, since[hits] + unseen)
    settled = (states(s_hit) == FREE) & (now - began >= wait)
    s_hit[settled] = 0.0
    state = np.where(explained, OCCUPIED, states(s_hit))

    stale = (now - seen > lifetime) & (window != rays.UNSEEN)
    d[stale] = 0.0
    d_hit = d[hits] + steps_d[state, 1]

    added = [missed * _of_state(s, steps[:, 0]) for steps in (steps_d, steps_s)]
    if graze > 0:
        added[0] += grazed * _of_state(s, steps_d[:, 2])
        added[1] += grazed * _of_state(s, steps_s[:, 2])
    d += added[0]
    s += added[1]
    d[hits], s[hits] = d_hit, s_hit + steps_s[state, 1]
    np.clip(s, -s_bound, s_bound, out=s)
    np.clip(d, -d_bound, d_bound, out=d)
    seen[window != rays.UNSEEN] = now
    last_hit[(missed | grazed) & (now - last_hit > gap)] = -np.inf  # the visit is over
    since[hits], last_hit[hits] = began, now


def _of_state(s: Array, values: Array) -> Array:
    """Pick one of three values by the state of every cell."""
    undecided = np.where(s < -DECIDED_LOG_ODDS, values[FREE], values[UNKNOWN])
    picked: Array = np.where(s > DECIDED_LOG_ODDS, values[OCCUPIED], undecided)
    return picked


def _continues_line(s: Array, row: IntArray, column: IntArray) -> NDArray[np.bool_]:
    """Whether the next two cells in one of eight directions are decided static.

    Beams keep a cell off the map's border: the next cell is there, the one behind it need not be.
    """
    i, j = EIGHT.T
    behind_row, behind_column = row[:, None] + 2 * i, column[:, None] + 2 * j
    there = (behind_row >= 0) & (behind_row < s.shape[0])
    there &= (behind_column >= 0) & (behind_column < s.shape[1])
    next_one = s[row[:, None] + i, column[:, None] + j]
    behind = s[np.where(there, behind_row, 0), np.where(there, behind_column, 0)]
    line = there & (next_one > DECIDED_LOG_ODDS) & (behind > DECIDED_LOG_ODDS)
    return np.asarray(line.any(axis=1))


def _near_static(s: Array, row: IntArray, column: IntArray, reach: int) -> NDArray[np.bool_]:
    """Whether a decided static cell lies within ``reach`` cells, diagonals included; never if 0."""
    if reach == 0:
        return np.zeros(len(row), dtype=np.bool_)
    offsets = np.arange(-reach, reach + 1)
    rows = np.clip(row[:, None] + offsets, 0, s.shape[0] - 1)
    columns = np.clip(column[:, None] + offsets, 0, s.shape[1] - 1)
    near: NDArray[np.bool_] = (s[rows[:, :, None], columns[:, None, :]] > DECIDED_LOG_ODDS).any(axis=(1, 2))
    return near
