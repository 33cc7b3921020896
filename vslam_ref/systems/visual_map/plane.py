r"""The plane that fills most of a map: a floor, a table, a wall.

With :math:`d_j = n^T X_j - h` the distance of a point from a plane, samples of three points compete for the
least

.. math:: \sum_j w_j \min(d_j^2,\; c^2)

(MSAC), and the winner is fitted by weighted least squares to the points within c, anew until these stay the
same.  Neither step can raise the sum: the best plane of the points within c lowers their part, and a point
that then leaves or comes in lowers its own.

A plane is wide; a textured thing is a clump of points, and through any three clumps there is a plane.  So
points share a vote with all others of their cell, a cube with side 2 c: :math:`w_j` is one over their number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray, as_array
from vslam_ref.geometry.drawing import different_numbers

SHARE = 0.075
"""Of the points' median distance from their middle: how far from a plane a point may lie by default."""
CELL = 2.0
"""Side of a cell over c."""
LEAST_SHARE = 0.2
"""Of the votes, that a plane must hold.  Through the middle of a round cloud any plane holds 10 %."""
FEW = 12
"""Points that a plane must hold."""
DRAWS = 1000
"""Samples: a plane that holds 20 % of the points is hit with probability 1 - (1 - 1/125)^1000 = 0.9997."""
REFITS = 20
AT_ONCE = 2_000_000
"""Distances that are held in memory at once."""
ALONG = 0.9
"""Cosine from which on the world's x axis is no good direction for that of the plane."""


class Plane(NamedTuple):
    """A plane, as a frame that lies in it.

    Attributes
    ----------
    T_plane_world : ndarray, shape (4, 4)
        The plane is z = 0, its origin the (weighted) mean of the points in it.  The z axis points to the
        side of the world's origin (of the first camera, in a map); the x axis is the world's x axis laid into
        the plane, or its z axis where the plane stands across x.
    inliers : ndarray of bool, shape (N,)
        Points in it.
    reason : str
        Empty, or why there is no plane: then the frame is the world's, and no point is in it.
    """

    T_plane_world: Array
    inliers: BoolArray
    reason: str


def dominant_plane(
    X_world: ArrayLike, rng: np.random.Generator, *, tolerance: float | None = None, draws: int = DRAWS
) -> Plane:
    """Find the plane that fills most of a map.

    Parameters
    ----------
    X_world : array_like, shape (N, 3)
        Points, any unit.
    rng : numpy.random.Generator
        Draws the samples.
    tolerance : float, optional
        The distance c from which on a point is off the plane, in the unit of the points; by default
        ``SHARE`` of their median distance from their middle.
    draws : int
        Samples of three points.

    Returns
    -------
    Plane

    Raises
    ------
    ValueError
        If the shape does not fit, a number is not finite, or ``tolerance`` or ``draws`` is not positive.

    Examples
    --------
    >>> floor = [[x, 2.0, z] for x in range(5) for z in range(5)]
    >>> found = dominant_plane([*floor, [1.0, 0.5, 2.0]], np.random.default_rng(0))
    >>> int(found.inliers.sum()), (found.T_plane_world @ [2.0, 1.5, 2.0, 1.0]).round(6).tolist()
    (25, [0.0, 0.0, 0.5, 1.0])
    """
    X = as_array("X_world", X_world, 3)
    if X.ndim != 2 or not np.isfinite(X).all():
        raise ValueError(f"X_world {X.shape}: need finite points (N, 3)")
    if draws < 1:
        raise ValueError(f"draws={draws}: must be 1 or more")
    if tolerance is not None and not 0 < tolerance < np.inf:
        raise ValueError(f"tolerance={tolerance}: must be positive and finite")
    if len(X) < FEW:
        return _none(len(X), f"the map has {len(X)} points: need {FEW}")
    c = SHARE * _extent(X) if tolerance is None else tolerance
    if c == 0:
        return _none(len(X), "most points lie at one place")
    vote = _votes(X, CELL * c)
    n, h = _best_sample(X, vote, c, different_numbers(rng, draws, len(X), 3))
    if not n.any():
        return _none(len(X), "all samples of three points lie on a line")
    inside = _within(X, n, h, c)
    for _ in range(REFITS):
        if inside.sum() < 3:
            break
        n, h = _fitted(X[inside], vote[inside])
        before, inside = inside, _within(X, n, h, c)
        if (before == inside).all():
            break
    return _judged(X, vote, n, inside)


def _judged(X: Array, vote: Array, n: Array, inside: BoolArray) -> Plane:
    """The plane as a frame, or why it is none."""
    count, share = int(inside.sum()), float(vote[inside].sum() / vote.sum())
    if count < FEW or share < LEAST_SHARE:
        need = f"need {LEAST_SHARE:.0%}, and {FEW} points"
        return _none(
            len(X), f"the best plane holds {share:.1%} of the space with points, {count} points: {need}"
        )
    spread = np.linalg.svd(X[inside] - X[inside].mean(0), compute_uv=False)
    if spread[1] <= 1e-6 * spread[0]:
        return _none(len(X), "the points lie on a line")
    return Plane(_frame(np.average(X[inside], 0, vote[inside]), n), inside, "")


def _none(count: int, reason: str) -> Plane:
    return Plane(np.eye(4), np.zeros(count, np.bool_), reason)


def _extent(X: Array) -> float:
    """Median distance of the points from their middle."""
    return float(np.median(np.linalg.norm(X - np.median(X, axis=0), axis=1)))


def _votes(X: Array, side: float) -> Array:
    """One over the number of points in the same cell, (N,)."""
    _, cell, count = np.unique(np.floor(X / side), axis=0, return_inverse=True, return_counts=True)
    return 1.0 / count[cell.ravel()]


def _best_sample(X: Array, vote: Array, c: float, samples: IntArray) -> tuple[Array, float]:
    """Normal and distance of the plane through three points with the least sum; zeros if all lie on lines."""
    a, b, d = (X[samples[:, k]] for k in range(3))
    across = np.cross(b - a, d - a)
    area = np.linalg.norm(across, axis=1)
    proper = area > 1e-9 * np.linalg.norm(b - a, axis=1) * np.linalg.norm(d - a, axis=1)
    if not proper.any():
        return np.zeros(3), 0.0
    n = across[proper] / area[proper, None]
    h = np.einsum("ki,ki->k", n, a[proper])
    parts = np.array_split(np.arange(len(n)), -(-len(n) * len(X) // AT_ONCE))
    cost = [vote @ np.minimum((X @ n[k].T - h[k]) ** 2, c**2) for k in parts]
    best = int(np.argmin(np.concatenate(cost)))
    return n[best], float(h[best])


def _within(X: Array, n: Array, h: float, c: float) -> BoolArray:
    return np.asarray(np.abs(X @ n - h) < c)


def _fitted(X: Array, vote: Array) -> tuple[Array, float]:
    """Plane with the least weighted sum of squares: through the mean, across the least direction."""
    middle = np.average(X, 0, vote)
    n = np.linalg.svd(np.sqrt(vote)[:, None] * (X - middle), full_matrices=False)[2][2]
    return n, float(n @ middle)


def _frame(middle: Array, n: Array) -> Array:
    """T_plane_world (4, 4) with the z axis along n, to the side of the origin."""
    z = n if n @ middle <= 0 else -n
    towards = np.array([1.0, 0, 0]) if abs(z[0]) < ALONG else np.array([0, 0, 1.0])
    x = towards - (towards @ z) * z
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z])
    T[:3, 3] = -T[:3, :3] @ middle
    return T
