"""Corners in one scan: the scan falls into straight runs, and two runs that meet make a corner.

::

      o o o o o o o          runs: broken where the ranges jump, then split where a run bends
                    o
                     o       each run gets a line by total least squares:
                      o          centroid c, direction t = (cos phi, sin phi), normal n = (-sin phi, cos phi)
                       o         var(offset along n) = sigma^2 / N,   var(phi) = sigma^2 / sum of s^2
                                 (s: places along the line from c; the two errors are independent)
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.geometry import so2
from vslam_ref.grids.scan import unit_vectors
from vslam_ref.support.config import assume


@dataclass(frozen=True)
class CornerConfig:
    """When two runs of a scan make a corner; every field says why it has its value."""

    sigma: float = assume(0.015, "m", "of a range, as the laser's data sheet has it")
    usable_range: float = assume(8.0, "m", "half a degree is 7 cm there")
    jump: float = assume(0.25, "m", "half a door leaf; more parts two things")
    bend: float = assume(0.05, "m", "three sigma: less is noise, no bend")
    least_points: int = assume(6, "", "a leg at 1.5 m gives five")
    least_length: float = assume(0.25, "m", "longer than a leg is wide")
    least_angle: float = assume(0.7, "rad", "40 degrees: flatter corners lie anywhere")
    reach: float = assume(0.15, "m", "runs end this near to the corner")
    floor: float = assume(0.01, "m", "walls are not straighter than that")

    def __post_init__(self) -> None:
        """Check the numbers."""
        lengths = (self.sigma, self.usable_range, self.jump, self.bend, self.least_length, self.reach)
        if not (np.isfinite(lengths).all() and min(*lengths, self.least_angle) > 0 and self.floor >= 0):
            raise ValueError("lengths and angles of a corner's config: need finite numbers > 0 (floor >= 0)")
        if self.least_points < 3:
            raise ValueError(f"least_points={self.least_points}: a line with an uncertainty needs at least 3")


class Lines(NamedTuple):
    """Straight runs of one scan.

    Attributes
    ----------
    centre : ndarray, shape (n, 2)
        Centroids in the laser's frame, metres.
    angle : ndarray, shape (n,)
        Direction of the line, the way in which the beams pass it, radians.
    var_offset, var_angle : ndarray, shape (n,)
        Variances of its place along the normal (m^2) and of its direction (rad^2).
    ends : ndarray of int, shape (n, 2)
        First and last beam.
    ends_xy : ndarray, shape (n, 2, 2)
        Points of these beams, metres.
    """

    centre: Array
    angle: Array
    var_offset: Array
    var_angle: Array
    ends: IntArray
    ends_xy: Array


class Crossing(NamedTuple):
    """Where two lines cross.

    Attributes
    ----------
    value : ndarray, shape (..., 2)
        Metres.
    J_offset, J_angle : ndarray, shape (..., 2, 2)
        Jacobians in both offsets, and in both angles (metres per radian).
    """

    value: Array
    J_offset: Array
    J_angle: Array


class ScanCorners(NamedTuple):
    """Corners of one scan, in the laser's frame.

    Attributes
    ----------
    xy : ndarray, shape (n, 2)
        Metres.
    cov : ndarray, shape (n, 2, 2)
        Their covariance, square metres.
    bisector : ndarray, shape (n,)
        Direction from the corner between its two arms, radians.
    opening : ndarray, shape (n,)
        Angle between the arms, radians.
    convex : ndarray of bool, shape (n,)
        Whether the laser sees the corner from outside, as the edge of a cupboard.
    arms : ndarray, shape (n, 2)
        Directions of the two arms, away from the corner, radians.
    """

    xy: Array
    cov: Array
    bisector: Array
    opening: Array
    convex: BoolArray
    arms: Array

    def __len__(self) -> int:
        return len(self.xy)


def cross(centre: ArrayLike, angle: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> Array:
    """Point where two lines cross.

    Implements :eq:`eq-corner-crossing`.

    Parameters
    ----------
    centre : array_like, shape (..., 2, 2)
        A point of each line, metres.
    angle : array_like, shape (..., 2)
        Their directions, radians.
    offset : array_like, shape (..., 2)
        Shift of each line along its normal (-sin, cos), metres.

    Returns
    -------
    ndarray, shape (..., 2)
        Metres; not finite for parallel lines.

    Examples
    --------
    >>> cross([[0.0, 1.0], [2.0, 0.0]], [0.0, np.pi / 2]).round(12)
    array([2., 1.])
    """
    return cross_with_jacobians(centre, angle, offset).value


def cross_with_jacobians(centre: ArrayLike, angle: ArrayLike, offset: ArrayLike = (0.0, 0.0)) -> Crossing:
    """:func:`cross` and its Jacobians; same parameters.

    Implements :eq:`eq-corner-crossing` and its derivatives.
    Differentiate n_i . (X - c_i) = offset_i.  A turn of line i moves its normal by -t_i, so that
    n_i . dX = d offset_i + (t_i . (X - c_i)) d angle_i: the lever is the distance from the line's middle.
    """
    c, phi = np.asarray(centre, dtype=np.float64), np.asarray(angle, dtype=np.float64)
    offset = np.broadcast_to(np.asarray(offset, dtype=np.float64), phi.shape)
    t = unit_vectors(phi)
    n = np.stack([-t[..., 1], t[..., 0]], -1)
    det = n[..., 0, 0] * n[..., 1, 1] - n[..., 0, 1] * n[..., 1, 0]
    inverse = np.stack(
        [np.stack([n[..., 1, 1], -n[..., 0, 1]], -1), np.stack([-n[..., 1, 0], n[..., 0, 0]], -1)], -2
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = inverse / det[..., None, None]
        right = (n * c).sum(-1) + offset
        value = (inverse @ right[..., None])[..., 0]
        lever = (t * (value[..., None, :] - c)).sum(-1)
        return Crossing(value, inverse, inverse * lever[..., None, :])


def fit_lines(points: Array, beams: IntArray, runs: list[tuple[int, int]], sigma: float) -> Lines:
    """Lines by total least squares through ``points[a:b]`` for each run (a, b).

    ``points (n, 2)``, metres, and the numbers of their ``beams (n,)``.

    Implements :eq:`eq-line-variances`.
    """
    n = len(runs)
    centre, angle, offset, turn = np.empty((n, 2)), np.empty(n), np.empty(n), np.empty(n)
    for i, (a, b) in enumerate(runs):
        p = points[a:b]
        centre[i] = p.mean(axis=0)
        d = p - centre[i]
        sxx, syy, sxy = d[:, 0] @ d[:, 0], d[:, 1] @ d[:, 1], d[:, 0] @ d[:, 1]
        phi = 0.5 * np.arctan2(2.0 * sxy, sxx - syy)
        along = unit_vectors(phi)
        if along @ (p[-1] - p[0]) < 0.0:
            phi += np.pi
        angle[i] = so2.wrap(phi)
        offset[i] = sigma**2 / len(p)
        turn[i] = sigma**2 / max(float(((d @ along) ** 2).sum()), 1e-300)
    ends = np.array([(a, b - 1) for a, b in runs], dtype=np.int64).reshape(-1, 2)
    return Lines(centre, angle, offset, turn, beams[ends], points[ends])


def straight_runs(points: Array, config: CornerConfig) -> list[tuple[int, int]]:
    """Runs (a, b) of points (n, 2) in the order of the beams: broken at jumps, then split at bends."""
    if len(points) < 2:
        return []
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    cuts = [0, *(np.flatnonzero(step > config.jump) + 1).tolist(), len(points)]
    runs: list[tuple[int, int]] = []
    stack = list(itertools.pairwise(cuts))[::-1]
    while stack:
        a, b = stack.pop()
        if b - a < 3:
            runs.append((a, b))
            continue
        chord = points[b - 1] - points[a]
        length = float(np.hypot(*chord))
        d = points[a:b] - points[a]
        area = np.abs(d[:, 0] * chord[1] - d[:, 1] * chord[0])
        off = area / length if length > 0 else np.hypot(d[:, 0], d[:, 1])
        k = int(np.argmax(off))
        if off[k] > config.bend and 0 < k < b - a - 1:
            stack += [(a + k, b), (a, a + k + 1)]
        else:
            runs.append((a, b))
    return runs


def scan_corners(angles: ArrayLike, ranges: ArrayLike, config: CornerConfig | None = None) -> ScanCorners:
    """Corners that one scan shows.

    Parameters
    ----------
    angles, ranges : array_like, shape (b,)
        Beams in the order of their angles, radians and metres.  Readings that are not finite, not positive
        or beyond ``config.usable_range`` are left out.
    config : CornerConfig, optional

    Returns
    -------
    ScanCorners
        With the covariance of both lines, :eq:`eq-corner-cov`; possibly none.

    Raises
    ------
    ValueError
        If angles and ranges do not have one shape (b,), or an angle is not finite.

    Examples
    --------
    >>> beams = np.deg2rad(np.arange(-45.0, 46.0))
    >>> ranges = np.sqrt(2.0) / np.cos(np.abs(beams) - np.pi / 4)  # two walls that meet ahead, at (2, 0)
    >>> found = scan_corners(beams, ranges)
    >>> found.xy.round(6), found.convex, np.rad2deg(found.opening).round(3)
    (array([[2., 0.]]), array([False]), array([90.]))
    """
    c = CornerConfig() if config is None else config
    angles, ranges = np.asarray(angles, dtype=np.float64), np.asarray(ranges, dtype=np.float64)
    if angles.ndim != 1 or angles.shape != ranges.shape or not np.isfinite(angles).all():
        raise ValueError(
            f"{ranges.shape} ranges for {angles.shape} angles: need one range per beam, angles finite"
        )
    used = np.isfinite(ranges) & (ranges > 0.0) & (ranges <= c.usable_range)
    beams = np.flatnonzero(used)
    points = ranges[used, None] * unit_vectors(angles[used])
    lines = fit_lines(points, beams, _long_runs(points, c), c.sigma)
    return _meet(lines, c)


def _long_runs(points: Array, c: CornerConfig) -> list[tuple[int, int]]:
    """Runs with enough points and length, less their ends: the point at a bend belongs to neither."""
    kept = []
    for a, b in straight_runs(points, c):
        if b - a >= c.least_points + 2 and np.linalg.norm(points[b - 1] - points[a]) >= c.least_length:
            kept.append((a + 1, b - 1))
    return kept


def _meet(lines: Lines, c: CornerConfig) -> ScanCorners:
    """Corners of neighbouring lines whose ends come near to where they cross."""
    n = len(lines.angle)
    pair = np.stack([np.arange(n - 1), np.arange(1, n)], 1) if n > 1 else np.zeros((0, 2), dtype=np.int64)
    turn = so2.wrap(np.diff(lines.angle)) if n > 1 else np.zeros(0)
    pair = pair[
        (np.abs(np.sin(turn)) > np.sin(c.least_angle)) & (np.abs(np.cos(turn)) < np.cos(c.least_angle))
    ]
    at = cross_with_jacobians(lines.centre[pair], lines.angle[pair])
    gap = np.linalg.norm(
        at.value[:, None] - np.stack([lines.ends_xy[pair[:, 0], 1], lines.ends_xy[pair[:, 1], 0]], 1), axis=2
    )
    near = (gap <= c.reach).all(axis=1)
    pair, xy, J_offset, J_angle = pair[near], at.value[near], at.J_offset[near], at.J_angle[near]
    # eq-corner-cov
    cov = (J_offset * lines.var_offset[pair][:, None]) @ J_offset.swapaxes(1, 2)
    cov = cov + (J_angle * lines.var_angle[pair][:, None]) @ J_angle.swapaxes(1, 2) + c.floor**2 * np.eye(2)
    back, on = so2.wrap(lines.angle[pair[:, 0]] + np.pi), lines.angle[pair[:, 1]]
    opening = np.abs(so2.wrap(on - back))
    bisector = so2.wrap(back + so2.wrap(on - back) / 2)
    towards = np.cos(bisector) * xy[:, 0] + np.sin(bisector) * xy[:, 1]
    return ScanCorners(xy, cov, bisector, opening, towards > 0.0, np.stack([back, on], 1))
