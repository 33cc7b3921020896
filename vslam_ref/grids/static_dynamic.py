"""Two maps of a world in which things move: S, what stays, and D, what is moving now.

Each scan changes both, by A's chapter 4: the table of :mod:`inverse_sensor` is looked up with what S said of
a cell *before* the scan, and its log-odds are added.

    L(S_t) = L(S | o_t, S_{t-1}) + L(S_{t-1})                                                   (A§4.2)
    L(D_t) = L(D | o_t, S_{t-1}) + L(D_{t-1})        d_memory = "formula"                       (A§4.3)
    L(D_t) = L(D | o_t, S_{t-1})                     d_memory = "text"

These two recursions are the whole algorithm of :mod:`vslam_ref.grids.book`.  Four rules are added here, each
with a switch; they change what goes into the recursions, S_{t-1} and D_{t-1}:

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
* *grazing*: in the last ``graze`` cells before its own end a beam leaves weaker evidence than a miss (see
  :mod:`inverse_sensor`).  0 is the table with two observations.

:data:`~vslam_ref.grids.map_config.AS_PRINTED` has none of the last three.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.grids import beam_marks
from vslam_ref.grids.canvas import Canvas
from vslam_ref.grids.log_odds import DECIDED_LOG_ODDS, FREE, OCCUPIED, UNKNOWN, LogOddsGrid, log_odds, states
from vslam_ref.grids.map_config import MapConfig

EIGHT = np.array([(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)])
"""Directions to the neighbours of a cell."""
KIND = np.array([-1, 2, 0, 1])
"""Column of the table for :data:`~vslam_ref.grids.beam_marks.GRAZE`, ``MISS`` and ``HIT``."""


class Layers(NamedTuple):
    """What is kept of every cell, row by row: n = rows * columns.

    Attributes
    ----------
    static, dynamic : ndarray, shape (n,)
        Log-odds L(S) and L(D).
    seen, last_hit, since : ndarray, shape (n,)
        Times, s: of the last look, of the last hit of the present visit (-inf: none), and of its first hit,
        shifted by the time at which nobody looked.
    """

    static: Array
    dynamic: Array
    seen: Array
    last_hit: Array
    since: Array


class Rules(NamedTuple):
    """The numbers of a :class:`MapConfig` as :func:`apply_scan` needs them.

    Attributes
    ----------
    steps_s, steps_d : ndarray, shape (3, 3)
        The table, from :meth:`InverseSensor.steps`.
    s_bound, d_bound : float
        Largest log-odds of S and D.
    lifetime : float
        Of D, s; negative without memory: nothing is young enough.
    settle, in_line : float
        Seconds after which a hit cell of free floor settles, anywhere and in a line; inf: never.
    hit_gap : float
        Seconds.
    reach, graze : int
        Cells by which a hit is explained, and which a beam grazes before its own end.
    """

    steps_s: Array
    steps_d: Array
    s_bound: float
    d_bound: float
    lifetime: float
    settle: float
    in_line: float
    hit_gap: float
    reach: int
    graze: int


def rules_of(config: MapConfig) -> Rules:
    """Return the numbers of a config, its switches turned into numbers that need no case."""
    settle = math.inf if config.settle_seconds is None else config.settle_seconds
    in_line = settle if config.settle_in_line is None else min(config.settle_in_line, settle)
    steps = config.sensor.steps(config.d_high_where)
    s_bound, d_bound = log_odds([config.s_most, config.d_most]).tolist()
    lifetime = config.d_lifetime if config.d_memory == "formula" else -1.0
    reach, graze = config.explained_by, config.graze
    return Rules(
        steps.static, steps.dynamic, s_bound, d_bound, lifetime, settle, in_line, config.hit_gap, reach, graze
    )


class StaticDynamicMap(Canvas):
    """S and D, from one scan to the next.

    Implements A§4.1: of every cell, the probability that something static or something moving is there.

    Parameters
    ----------
    config : MapConfig

    Notes
    -----
    Five numbers a cell, see :class:`Layers`.

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
        fills = Layers(static=0.0, dynamic=0.0, seen=-math.inf, last_hit=-math.inf, since=0.0)  # type: ignore[arg-type]
        super().__init__(c.resolution, c.usable_range, c.no_return, fills._asdict())
        self._rules = rules_of(c)

    def _draw(self, beams: beam_marks.BeamsInCells) -> None:
        flat = Layers(*(layer.reshape(-1) for layer in self.layers.values()))
        apply_scan(flat, self.lattice.shape[1], beams, self._rules, self.time)

    def static(self) -> LogOddsGrid:
        """Return S, a view that later scans change."""
        return LogOddsGrid(self.lattice, self.layers["static"])

    def dynamic(self) -> LogOddsGrid:
        """Return D as it is now: cells that were not looked at for ``d_lifetime`` are unknown.

        With ``d_memory="text"``, all cells but those of the last scan are.
        """
        age = self.time - self.layers["seen"]
        young = age <= max(self._rules.lifetime, 0.0)
        return LogOddsGrid(self.lattice, np.where(young, self.layers["dynamic"], 0.0))

    def observed(self) -> BoolArray:
        """Return which cells (rows, columns) were ever looked at."""
        return np.asarray(self.layers["seen"] > -math.inf)


@accelerated("grids:apply_scan")
def apply_scan(
    layers: Layers, columns: int, beams: beam_marks.BeamsInCells, rules: Rules, now: float
) -> None:
    """Change S and D, in place, by one scan.

    Implements :eq:`eq-static-recursion` (A§4.2), :eq:`eq-dynamic-recursion` (A§4.3) and
    :eq:`eq-dynamic-text` in log-odds.

    Parameters
    ----------
    layers : Layers
        Changed in place, in the cells that the scan looks at.
    columns : int
        Cells in a row.
    beams : BeamsInCells
        All inside the map.
    rules : Rules
    now : float
        Time, s, later than before.

    Raises
    ------
    ValueError
        As :func:`vslam_ref.grids.beam_marks.look`; nothing is changed then.
    """
    rows = len(layers.static) // columns
    row, column, what = beam_marks.looked_at((rows, columns), beams, rules.graze)
    at = row * columns + column
    S, D, seen, last_hit, since = (layer[at] for layer in layers)
    state = states(S)  # S_{t-1} chooses the row of the table
    hits = np.flatnonzero(what == beam_marks.HIT)
    around = layers.static.reshape(rows, columns), row[hits], column[hits]

    unseen = np.where(now - seen > rules.hit_gap, now - seen, 0.0)  # when nobody looked, nothing stayed
    began = np.where(last_hit == -np.inf, now, since + unseen)
    wait = np.where(_continues_line(*around), rules.in_line, rules.settle)
    settled = hits[(state[hits] == FREE) & (now - began[hits] >= wait)]
    S[settled], state[settled] = 0.0, UNKNOWN
    state[hits[_near_static(*around, rules.reach)]] = OCCUPIED
    D[now - seen > rules.lifetime] = 0.0

    L_S = rules.steps_s[state, KIND[what]] + S  # eq-static-recursion
    L_D = rules.steps_d[state, KIND[what]] + D  # eq-dynamic-recursion, and eq-dynamic-text where D is 0
    layers.static[at] = np.clip(L_S, -rules.s_bound, rules.s_bound)
    layers.dynamic[at] = np.clip(L_D, -rules.d_bound, rules.d_bound)

    layers.seen[at] = now
    last_hit[now - last_hit > rules.hit_gap] = -np.inf  # the visit is over
    last_hit[hits], since[hits] = now, began[hits]
    layers.last_hit[at], layers.since[at] = last_hit, since


def _continues_line(S: Array, row: IntArray, column: IntArray) -> BoolArray:
    """Whether the next two cells in one of eight directions are decided static.

    Beams keep a cell off the map's border: the next cell is there, the one behind it need not be.
    """
    i, j = EIGHT.T
    behind_row, behind_column = row[:, None] + 2 * i, column[:, None] + 2 * j
    there = (behind_row >= 0) & (behind_row < S.shape[0])
    there &= (behind_column >= 0) & (behind_column < S.shape[1])
    next_one = S[row[:, None] + i, column[:, None] + j]
    behind = S[np.where(there, behind_row, 0), np.where(there, behind_column, 0)]
    line = there & (next_one > DECIDED_LOG_ODDS) & (behind > DECIDED_LOG_ODDS)
    return np.asarray(line.any(axis=1))


def _near_static(S: Array, row: IntArray, column: IntArray, reach: int) -> BoolArray:
    """Whether a decided static cell lies within ``reach`` cells, diagonals included; never if 0."""
    if reach == 0:
        return np.zeros(len(row), dtype=np.bool_)
    near = np.arange(-reach, reach + 1)
    rows = np.clip(row[:, None] + near, 0, S.shape[0] - 1)
    columns = np.clip(column[:, None] + near, 0, S.shape[1] - 1)
    return np.asarray((S[rows[:, :, None], columns[:, None, :]] > DECIDED_LOG_ODDS).any(axis=(1, 2)))
