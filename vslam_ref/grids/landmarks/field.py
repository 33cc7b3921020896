"""A map as a likelihood field: how far each place is from the nearest static cell.

A reading whose end lies at distance d from what is static has the likelihood exp(-d^2 / 2 sigma^2),
whatever the beam passed on its way (Thrun's "likelihood field").  Between the cells' middles the distance
is interpolated, bilinearly, so that it has a slope.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import se2, so2
from vslam_ref.grids.log_odds import OCCUPIED, LogOddsGrid


@dataclass(frozen=True)
class DistanceField:
    """Distances to the nearest static cell.

    Parameters
    ----------
    origin_xy : tuple of two floats
        Lower left corner of cell [0, 0], metres.
    resolution : float
        Side of a cell, metres.
    distance : ndarray, shape (rows, columns)
        At the cells' middles, metres, at most ``most``.
    most : float
        Value outside, and where nothing is near.
    """

    origin_xy: tuple[float, float]
    resolution: float
    distance: Array
    most: float


class Sampled(NamedTuple):
    """Value (...,) of a field at points, and its gradient (..., 2)."""

    value: Array
    slope: Array


class FieldResiduals(NamedTuple):
    """Value (..., 1) Jacobians in the pose's (x, y, theta) (..., 1, 3), in the scan point (..., 1, 2)."""

    value: Array
    J_pose: Array
    J_point: Array


def distance_field(grid: LogOddsGrid, most: float = 0.5) -> DistanceField:
    """Distances to the nearest cell that the map has decided to be occupied.

    Parameters
    ----------
    grid : LogOddsGrid
        S, or a plain grid.
    most : float
        Distances are cut here, metres.

    Raises
    ------
    ValueError
        If ``most`` is not positive and finite.
    """
    if not (np.isfinite(most) and most > 0):
        raise ValueError(f"most={most!r} m: must be positive and finite")
    occupied = grid.states == OCCUPIED
    if not occupied.any():
        return DistanceField(grid.origin_xy, grid.resolution, np.full(occupied.shape, most), most)
    from scipy.ndimage import distance_transform_edt

    distance = grid.resolution * distance_transform_edt(~occupied)
    return DistanceField(grid.origin_xy, grid.resolution, np.minimum(distance, most), most)


def sample(points: ArrayLike, field: DistanceField) -> Array:
    """Distances (...,) at points (..., 2) of the world, metres; ``field.most`` outside of the map.

    Examples
    --------
    >>> field = DistanceField((0.0, 0.0), 1.0, np.array([[0.0, 1.0], [1.0, 1.4]]), 5.0)
    >>> sample([[0.5, 0.5], [1.0, 0.5], [9.0, 0.5]], field)
    array([0. , 0.5, 5. ])
    """
    return sampled(points, field).value


def sampled(points: ArrayLike, field: DistanceField) -> Sampled:
    """:func:`sample` and its slope; same parameters.  Outside the slope is 0."""
    p = np.asarray(points, dtype=np.float64)
    rows, columns = field.distance.shape
    if rows < 2 or columns < 2:
        return Sampled(np.full(p.shape[:-1], field.most), np.zeros(p.shape))
    at = (p - field.origin_xy) / field.resolution - 0.5
    column, row = np.floor(at[..., 0]).astype(np.int64), np.floor(at[..., 1]).astype(np.int64)
    inside = (column >= 0) & (column < columns - 1) & (row >= 0) & (row < rows - 1)
    i, j = np.where(inside, row, 0), np.where(inside, column, 0)
    u, v = at[..., 0] - column, at[..., 1] - row
    d = field.distance
    d00, d01, d10, d11 = d[i, j], d[i, j + 1], d[i + 1, j], d[i + 1, j + 1]
    value = (1 - v) * ((1 - u) * d00 + u * d01) + v * ((1 - u) * d10 + u * d11)
    slope = np.stack([(1 - v) * (d01 - d00) + v * (d11 - d10), (1 - u) * (d10 - d00) + u * (d11 - d01)], -1)
    slope = np.where(inside[..., None], slope / field.resolution, 0.0)
    return Sampled(np.where(inside, value, field.most), slope)


def scan_residuals(T_world_laser: ArrayLike, points: ArrayLike, field: DistanceField) -> Array:
    """Distances (..., 1) of scan points from what is static.

    Implements :eq:`eq-field-residual`.

    Parameters
    ----------
    T_world_laser : array_like, shape (..., 3)
        ``T_world_laser`` as (x, y, theta).
    points : array_like, shape (..., 2)
        In the laser's frame, metres.
    field : DistanceField
    """
    return scan_residuals_with_jacobians(T_world_laser, points, field).value


def scan_residuals_with_jacobians(
    T_world_laser: ArrayLike, points: ArrayLike, field: DistanceField
) -> FieldResiduals:
    """:func:`scan_residuals` and its Jacobians, in the filter's (x, y, theta); same parameters.

    Implements the Jacobian of :eq:`eq-field-residual`.
    """
    T_world_laser, points = np.asarray(T_world_laser, dtype=np.float64), np.asarray(points, dtype=np.float64)
    world = se2.act(T_world_laser, points)
    at = sampled(world, field)
    lever = world - T_world_laser[..., :2]
    turn = at.slope[..., 1] * lever[..., 0] - at.slope[..., 0] * lever[..., 1]
    J_pose = np.concatenate([at.slope, turn[..., None]], -1)
    J_point = at.slope[..., None, :] @ so2.exp(T_world_laser[..., 2])
    return FieldResiduals(at.value[..., None], J_pose[..., None, :], J_point)


def pose_difference(a: ArrayLike, b: ArrayLike) -> Array:
    """Difference a - b (..., 3) of poses (x, y, theta), metres and radians, the angle in (-pi, pi]."""
    off = np.asarray(a, dtype=np.float64) - np.asarray(b, dtype=np.float64)
    off[..., 2] = so2.wrap(off[..., 2])
    return off
