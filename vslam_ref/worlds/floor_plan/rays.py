"""Exact ray casting against line segments and discs.

::

                     b
        o ---- d --> |        segment:  o + t d = a + u (b - a),   0 <= u <= 1,   t >= 0
                     a
                    ___
        o ---- d -> (   )     disc:     |o + t d - c| = r, the smaller t >= 0

Both are closed forms; nothing is stepped along the ray, so that the ranges are the truth to rounding.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray

CORNER = 1e-12
"""Relative slack of u: two segments that share an end let no ray through between them.

The rounding of u is a few times 2^-53 of it for segments of metres seen across a floor; a slack of 1e-12
closes the gap and makes a segment of 10 m longer by 10 pm.
"""


class Hits(NamedTuple):
    """What the rays meet first.

    Attributes
    ----------
    range : ndarray, shape (n,)
        Distance, metres; ``inf`` where nothing is met.
    which : ndarray of int, shape (n,)
        Index of the primitive: segments first, then discs; -1 where nothing is met.
    """

    range: Array
    which: IntArray


def segment_ranges(origin: ArrayLike, angles: ArrayLike, segments: ArrayLike) -> Array:
    """Distances at which rays meet line segments.

    Parameters
    ----------
    origin : array_like, shape (2,)
        Start of all rays, metres.
    angles : array_like, shape (n,)
        Directions in the same frame, radians.
    segments : array_like, shape (m, 4)
        ``(ax, ay, bx, by)``, metres.

    Returns
    -------
    ndarray, shape (n, m)
        Metres; ``inf`` where they do not meet.  A ray that runs along a segment meets its nearer end.

    Examples
    --------
    >>> segment_ranges([0.0, 0.0], [0.0, 1.0], [[2.0, -1.0, 2.0, 1.0]])
    array([[ 2.],
           [inf]])
    """
    o, s = np.asarray(origin, dtype=np.float64), np.asarray(segments, dtype=np.float64).reshape(-1, 4)
    angles = np.asarray(angles, dtype=np.float64)
    dx, dy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    ax, ay = s[:, 0] - o[0], s[:, 1] - o[1]
    ex, ey = s[:, 2] - s[:, 0], s[:, 3] - s[:, 1]
    det = dx * ey - dy * ex
    across = ax * dy - ay * dx  # cross(a - o, d)
    crossing = det != 0.0
    safe = np.where(crossing, det, 1.0)
    t, u = (ax * ey - ay * ex) / safe, across / safe
    met = crossing & (t >= 0.0) & (u >= -CORNER) & (u <= 1.0 + CORNER)
    ranges: Array = np.where(met, t, np.inf)
    along = ~crossing & (across == 0.0)
    if along.any():
        ends = np.stack([ax * dx + ay * dy, (ax + ex) * dx + (ay + ey) * dy])
        nearer = np.where(ends >= 0.0, ends, np.inf).min(axis=0)
        inside = (ends.min(axis=0) < 0.0) & (ends.max(axis=0) >= 0.0)
        ranges = np.where(along, np.where(inside, 0.0, nearer), ranges)
    return ranges


def disc_ranges(origin: ArrayLike, angles: ArrayLike, discs: ArrayLike) -> Array:
    """Distances at which rays meet discs; 0 from inside.

    The root is taken as (|f|^2 - r^2)/(b + sqrt(b^2 - |f|^2 + r^2)) with f = c - o and b = f.d, which
    subtracts no two near numbers.

    Parameters
    ----------
    origin : array_like, shape (2,)
    angles : array_like, shape (n,)
    discs : array_like, shape (m, 3)
        ``(x, y, radius)``, metres.

    Returns
    -------
    ndarray, shape (n, m)
        Metres; ``inf`` where they do not meet.

    Examples
    --------
    >>> disc_ranges([0.0, 0.0], [0.0], [[3.0, 0.0, 1.0], [-3.0, 0.0, 1.0]])
    array([[ 2., inf]])
    """
    o, c = np.asarray(origin, dtype=np.float64), np.asarray(discs, dtype=np.float64).reshape(-1, 3)
    angles = np.asarray(angles, dtype=np.float64)
    fx, fy = c[:, 0] - o[0], c[:, 1] - o[1]
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    ahead, aside = fx * cos + fy * sin, fx * sin - fy * cos
    half = c[:, 2] ** 2 - aside**2
    outside = fx**2 + fy**2 - c[:, 2] ** 2
    met = (half >= 0.0) & (ahead > 0.0)
    root = np.sqrt(np.where(met, half, 0.0))
    t = np.where(met, outside / np.where(met, ahead + root, 1.0), np.inf)
    inside: Array = np.where(outside <= 0.0, 0.0, t)
    return inside


def cast(origin: ArrayLike, angles: ArrayLike, segments: ArrayLike, discs: ArrayLike) -> Hits:
    """First thing that each ray meets, among segments and discs.

    ``origin (2,)``, ``angles (n,)``, ``segments (m, 4)``, ``discs (k, 3)`` as for :func:`segment_ranges` and
    :func:`disc_ranges`; metres and radians.

    Examples
    --------
    >>> hits = cast([0.0, 0.0], [0.0, 3.0], [[2.0, -1.0, 2.0, 1.0]], [[1.5, 0.0, 0.5]])
    >>> hits.range, hits.which
    (array([ 1., inf]), array([ 1, -1]))
    """
    all_ranges = np.concatenate(
        [segment_ranges(origin, angles, segments), disc_ranges(origin, angles, discs)], axis=1
    )
    if all_ranges.shape[1] == 0:
        empty = np.full(len(all_ranges), np.inf)
        return Hits(empty, np.full(len(empty), -1))
    which = np.argmin(all_ranges, axis=1)
    ranges = all_ranges[np.arange(len(which)), which]
    return Hits(ranges, np.where(np.isfinite(ranges), which, -1))
