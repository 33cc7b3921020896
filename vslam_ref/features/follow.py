"""Patches followed from one image to the next, and back again as a check.

A patch is cut out of the first image around a point, looked for among the corners of the second, and refined
there.  Then the same is done backwards: the patch cut out of the second image is refined in the first one,
from the place where the point was.  A point that does not come home has followed something else.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.features.corners import Corners
from vslam_ref.features.refine import refine
from vslam_ref.features.search import LIMIT, search
from vslam_ref.features.templates import warp

HOME = 1.5
"""Pixels from where a point began to where the way back ends."""


class Followed(NamedTuple):
    """Where points went.

    Attributes
    ----------
    uv : ndarray, shape (N, 2)
        Pixels in the second image; where ``ok`` is False, the guess.
    ok : ndarray of bool, shape (N,)
        Found, refined, and found back.
    """

    uv: Array
    ok: BoolArray


def follow(
    first: ArrayLike,
    second: ArrayLike,
    corners: Corners,
    uv: ArrayLike,
    radius: float = 10.0,
    *,
    guess: ArrayLike | None = None,
    limit: float = LIMIT,
    home: float = HOME,
) -> Followed:
    """Follow points from one image into another, on one level.

    Implements :eq:`eq-home`.

    Parameters
    ----------
    first, second : array_like of uint8, shapes (H, W)
    corners : Corners
        Of the second image.
    uv : array_like, shape (N, 2)
        Points in the first image, pixels; need not be whole.
    radius : float
        Pixels around the guess.
    guess : array_like, shape (N, 2), optional
        Where to look in the second image; by default where the points were.
    limit : float
        As for :func:`~vslam_ref.features.search.search`.
    home : float
        Pixels; :data:`HOME` by default.

    Returns
    -------
    Followed

    Raises
    ------
    ValueError
        If images, corners and points do not fit.

    Examples
    --------
    >>> from vslam_ref.features import detect
    >>> image = np.kron(np.random.default_rng(0).integers(0, 256, (9, 9)), np.ones((8, 8))).astype(np.uint8)
    >>> moved = np.roll(image, (2, 3), (0, 1))
    >>> follow(image, moved, detect(moved), [[40.0, 32.0]], 6.0)
    Followed(uv=array([[43., 34.]]), ok=array([ True]))
    """
    start = as_array("uv", uv, 2)
    place = start.copy() if guess is None else as_array("guess", guess, 2).copy()
    same = np.broadcast_to(np.eye(2), (len(start), 2, 2))
    there = warp(first, start, same)
    found = search(second, corners, there.patch, place, radius, limit=limit)
    on = np.flatnonzero(there.inside & (found.corner >= 0))
    end = refine(second, there.patch[on], corners.xy[found.corner[on]].astype(np.float64))
    here = warp(second, end.uv, same[on])
    back = refine(first, here.patch, start[on])
    away = np.hypot(*(back.uv - start[on]).T)
    good = end.ok & here.inside & back.ok & (away <= home)  # eq-home
    place[on[good]] = end.uv[good]
    ok = np.zeros(len(start), np.bool_)
    ok[on[good]] = True
    return Followed(place, ok)
