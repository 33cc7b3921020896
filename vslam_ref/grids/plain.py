"""One occupancy grid that knows nothing of motion: the baseline.

    L_t = L(occupied | o_t) + L_{t-1}

This is A§4.2 with a table that does not look at the past.  Evidence and bound are those of S, so that the
two maps differ in one thing only.
"""

from __future__ import annotations

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array
from vslam_ref.grids.beam_marks import HIT, MISS, BeamsInCells, look
from vslam_ref.grids.canvas import Canvas
from vslam_ref.grids.log_odds import LogOddsGrid, log_odds
from vslam_ref.grids.map_config import MapConfig


class PlainMap(Canvas):
    """An occupancy grid; of the :class:`MapConfig` it takes what is not about D.

    Examples
    --------
    >>> from vslam_ref.grids import Scan
    >>> grid = PlainMap()
    >>> _ = grid.update([0, 0, 0], Scan(np.zeros(1), np.array([0.35]), 80.0, 0.0))
    >>> grid.occupied().at([[0.05, 0.05], [0.35, 0.05], [0.45, 0.05]]).round(2)
    array([-0.85,  1.39,  0.  ])
    """

    def __init__(self, config: MapConfig | None = None) -> None:
        self.config = c = MapConfig() if config is None else config
        super().__init__(c.resolution, c.usable_range, c.no_return, {"occupied": 0.0})
        self._evidence = log_odds([c.sensor.s_miss, c.sensor.s_high])
        self._bound = float(log_odds(c.s_most))

    def _draw(self, beams: BeamsInCells) -> None:
        layer, columns = self.layers["occupied"].reshape(-1), self.lattice.shape[1]
        apply_plain(layer, columns, beams, self._evidence, self._bound)

    def occupied(self) -> LogOddsGrid:
        """Return the map, a view that later scans change."""
        return LogOddsGrid(self.lattice, self.layers["occupied"])


@accelerated("grids:apply_plain")
def apply_plain(log_odds: Array, columns: int, beams: BeamsInCells, evidence: Array, bound: float) -> None:
    """Add one scan to a plain grid, in place.

    Parameters
    ----------
    log_odds : ndarray, shape (rows * columns,)
        The map, row by row.
    columns : int
        Cells in a row.
    beams : BeamsInCells
        All inside the map.
    evidence : ndarray, shape (2,)
        Log-odds that a miss and a hit add.
    bound : float
        Largest log-odds.

    Raises
    ------
    ValueError
        As :func:`vslam_ref.grids.beam_marks.look`; nothing is changed then.

    Notes
    -----
    The plain form is ``np.clip(part + table[window], -bound, bound)``.  It takes twice as long, and OG-1
    would be missed (17 times as fast as loops, where 30 are asked).  So the sum is built in an array of
    its own, as work within the map's rows is slower, and by a product instead of a look-up.
    """
    whole = log_odds.reshape(-1, columns)
    rows, columns_seen, window = look(whole.shape, beams)
    part = whole[rows, columns_seen]
    new = (window == MISS).astype(np.float64)
    new *= evidence[0]
    new.reshape(-1)[np.flatnonzero(window == HIT)] = evidence[1]
    new += part
    np.clip(new, -bound, bound, out=part)
