"""Corners of the static map itself, weighted by its probabilities.

With q = max(2 P(S) - 1, 0) a cell counts from 0 (unknown or free) to 1 (surely static).  The gradient g of
q stands across walls.  Summed over a window,

    M = sum w g g^T,        x* = M^-1 sum w g g^T x        (Foerstner's point)

M has two large eigenvalues only where walls of two directions meet, and x* is the point that lies, in the
sense of least squares, on all walls of the window: the corner, to a fraction of a cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.grids.log_odds import DECIDED_LOG_ODDS, LogOddsGrid
from vslam_ref.grids.scan import unit_vectors
from vslam_ref.support.config import assume


@dataclass(frozen=True)
class MapCornerConfig:
    """When the static map has a corner; every field says why it has its value."""

    smooth: float = assume(0.8, "cells", "hides the raster's steps")
    window: float = assume(2.0, "cells", "both arms, and not the next corner")
    least: float = assume(0.075, "", "a clean L has 0.095, the end of a wall 0.06, a wall 0")
    decided: float = assume(0.9, "", "A: S and D are determined above 0.9")
    near: float = assume(0.3, "m", "two maxima of one corner")

    def __post_init__(self) -> None:
        """Check the numbers."""
        lengths = (self.smooth, self.window, self.least)
        if not (min(lengths) > 0 and 0.5 < self.decided < 1 and self.near >= 0):
            raise ValueError("need smooth, window, least > 0, 0.5 < decided < 1 and near >= 0")


class MapCorners(NamedTuple):
    """Corners of a map: places (n, 2), world, metres; strengths (n,), root of M's smaller eigenvalue."""

    xy: Array
    strength: Array


def certainty(grid: LogOddsGrid) -> Array:
    """Q = max(2 P - 1, 0) of every cell (rows, columns): how sure it is that the cell is occupied."""
    return np.maximum(2.0 * grid.probability - 1.0, 0.0)


def map_corners(grid: LogOddsGrid, config: MapCornerConfig | None = None) -> MapCorners:
    """Corners of S, the strongest first.

    Implements :eq:`eq-foerstner`.

    Parameters
    ----------
    grid : LogOddsGrid
        S, from :meth:`.StaticDynamicMap.static`.
    config : MapCornerConfig, optional

    Returns
    -------
    MapCorners
        Only corners within 1.5 cells of a decided static cell; of two that are nearer than ``config.near``
        the stronger.
    """
    from scipy.ndimage import gaussian_filter, maximum_filter

    c = MapCornerConfig() if config is None else config
    none = MapCorners(np.zeros((0, 2)), np.zeros(0))
    if min(grid.log_odds.shape, default=0) < 3:
        return none
    q = gaussian_filter(certainty(grid), c.smooth, mode="constant")
    gy, gx = np.gradient(q)
    rows, columns = np.indices(q.shape, dtype=np.float64)
    products = {"xx": gx * gx, "xy": gx * gy, "yy": gy * gy}
    m = {k: gaussian_filter(v, c.window, mode="constant") for k, v in products.items()}
    half_trace, half_difference = (m["xx"] + m["yy"]) / 2, (m["xx"] - m["yy"]) / 2
    smaller = half_trace - np.hypot(half_difference, m["xy"])
    strength = np.sqrt(np.maximum(smaller, 0.0))
    peak = (strength == maximum_filter(strength, size=3)) & (strength > c.least)
    # a place at which something is surely there, or a neighbour of one
    peak &= maximum_filter(grid.probability, size=3) > c.decided
    i, j = np.nonzero(peak)
    if len(i) == 0:
        return none
    b = [
        gaussian_filter(products["xx"] * columns + products["xy"] * rows, c.window, mode="constant")[i, j],
        gaussian_filter(products["xy"] * columns + products["yy"] * rows, c.window, mode="constant")[i, j],
    ]
    det = m["xx"][i, j] * m["yy"][i, j] - m["xy"][i, j] ** 2
    column = (m["yy"][i, j] * b[0] - m["xy"][i, j] * b[1]) / det
    row = (m["xx"][i, j] * b[1] - m["xy"][i, j] * b[0]) / det
    near = np.hypot(column - j, row - i) < 3.0 * c.window  # else the window holds no single point
    xy = np.array(grid.origin_xy) + grid.resolution * (np.stack([column, row], 1) + 0.5)
    return _strongest(MapCorners(xy[near], strength[i, j][near]), c.near)


def _strongest(corners: MapCorners, near: float) -> MapCorners:
    """Drop corners that lie nearer than ``near`` to a stronger one."""
    kept: list[int] = []
    for i in np.argsort(-corners.strength, kind="stable"):
        if all(np.hypot(*(corners.xy[i] - corners.xy[k])) >= near for k in kept):
            kept.append(int(i))
    return MapCorners(corners.xy[kept], corners.strength[kept])


def static_along_arms(grid: LogOddsGrid, xy: ArrayLike, arms: ArrayLike, length: float = 0.3) -> Array:
    """Share (n,) of the places along both arms of corners that S calls static.

    Parameters
    ----------
    grid : LogOddsGrid
        S.
    xy : array_like, shape (n, 2)
        Corners in the world, metres.
    arms : array_like, shape (n, 2)
        Directions of their arms in the world, radians.
    length : float
        How far along each arm, metres; sampled every half cell, each place with the best of its 3 x 3
        cells, as the pose is off by a part of a cell.

    Returns
    -------
    ndarray, shape (n,)
        In [0, 1]; of the two arms the smaller one.
    """
    from scipy.ndimage import maximum_filter

    xy, arms = (np.asarray(a, dtype=np.float64).reshape(-1, 2) for a in (xy, arms))
    if len(xy) == 0 or grid.log_odds.size == 0:
        return np.zeros(len(xy))
    s = np.arange(grid.resolution, length + 1e-9, grid.resolution / 2)
    way = unit_vectors(arms)
    places = xy[:, None, None] + s[:, None] * way[:, :, None]
    best = LogOddsGrid(grid.lattice, maximum_filter(grid.log_odds, size=3))
    static = (best.at(places.reshape(-1, 2)) > DECIDED_LOG_ODDS).reshape(len(xy), 2, len(s))
    share: Array = static.mean(axis=2).min(axis=1)
    return share
