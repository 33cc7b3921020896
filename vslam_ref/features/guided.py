"""Descriptors matched near where they are predicted: a map says where each of its points should appear."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import IntArray, as_array
from vslam_ref.features.hamming import Matches, differing, two_sets

FAR = np.iinfo(np.int64).max


def match_near(
    place: ArrayLike,
    radius: ArrayLike,
    a: ArrayLike,
    uv: ArrayLike,
    b: ArrayLike,
    *,
    ratio: float | None = 0.8,
    mutual: bool = True,
    limit: int = 256,
) -> Matches:
    """Pair each descriptor of a map with its nearest one among the features in its window.

    Implements :eq:`eq-hamming-match`, each minimum taken over the features in a window alone.

    Parameters
    ----------
    place : array_like, shape (n, 2)
        Where the points are predicted, pixels.
    radius : array_like, shape () or (n,)
        Half side of each window, pixels; what lies at its edge belongs to it.
    a : array_like of uint8, shape (n, bytes)
    uv : array_like, shape (m, 2)
        Features, pixels.
    b : array_like of uint8, shape (m, bytes)
    ratio : float, optional
        The distance must be below so many times that of the second nearest in the window; a feature alone in
        its window has no rival.  None does not ask.
    mutual : bool
        Whether the point must be the nearest of the feature, too, of those whose windows hold it.
    limit : int
        Largest distance, bits.

    Returns
    -------
    Matches

    Raises
    ------
    ValueError
        If descriptors are not bytes or not as many, or there are not as many as places, features or radii, or
        one of these is not finite, or a radius is negative.

    Examples
    --------
    The feature most alike lies outside the window.

    >>> a, b = np.array([[0b0]], np.uint8), np.array([[0b0], [0b1]], np.uint8)
    >>> match_near([[10.0, 10.0]], 3.0, a, [[90.0, 10.0], [12.0, 11.0]], b)
    Matches(first=array([0]), second=array([1]), distance=array([1]))
    """
    p, q, first, second = as_array("place", place, 2), as_array("uv", uv, 2), *two_sets(a, b)
    wide = as_array("radius", radius)
    if wide.shape not in ((), (len(p),)):
        raise ValueError(f"radius is of shape {wide.shape}: need () or ({len(p)},), one for each place")
    wide = np.broadcast_to(wide, len(p))
    for name, at, rows in (("place", p, first), ("uv", q, second)):
        if at.shape != (len(rows), 2):
            raise ValueError(f"{name} is of shape {at.shape}: need ({len(rows)}, 2), one for each descriptor")
        if not np.isfinite(at).all():
            raise ValueError(f"{name} has a number that is not finite: need pixels")
    if not (wide >= 0).all():
        raise ValueError(f"radius is {wide.min()}: need 0 pixels or more")
    apart = np.abs(p[:, None] - q).max(-1, initial=0.0)
    row, column = np.nonzero(apart <= wide[:, None])
    bits = differing(first[row], second[column])
    order = np.lexsort((column, bits, row))
    row, column, bits = row[order], column[order], bits[order]
    start = np.flatnonzero(np.diff(row, prepend=-1))
    ok = bits[start] <= limit
    if mutual:
        ok &= _owner(row, column, bits, len(q))[column[start]] == row[start]
    if ratio is not None:
        after = np.append(bits, FAR)[start + 1]
        alone = np.append(row, -1)[start + 1] != row[start]
        ok &= alone | (bits[start] < ratio * after)
    return Matches(row[start][ok], column[start][ok], bits[start][ok])  # eq-hamming-match


def _owner(row: IntArray, column: IntArray, bits: IntArray, count: int) -> IntArray:
    """Nearest place of each feature (count,), the first of equals; -1 where no window holds it."""
    order = np.lexsort((row, bits, column))
    found = np.flatnonzero(np.diff(column[order], prepend=-1))
    owner = np.full(count, -1)
    owner[column[order][found]] = row[order][found]
    return owner
