"""Patches followed from one image to the next, and back again as a check.

A patch is cut out of the first image around a point, looked for among the corners of the second, and refined
there.  Then the same is done backwards: the patch cut out of the second image is looked for among the corners
of the first.  If another corner of the first image looks more like it than the one where the point was, the
match is refused.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.features.corners import Corners
from vslam_ref.features.levels import Bytes
from vslam_ref.features.patch_search import LIMIT, search
from vslam_ref.features.refinement import refine
from vslam_ref.features.templates import warp

HOME = 1.5
"""Pixels from where a point began to the corner at which the way back ends."""


class View(NamedTuple):
    """One level of an image, and its corners without suppression."""

    image: Bytes
    corners: Corners


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
    first: View,
    second: View,
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
    first, second : View
    uv : array_like, shape (N, 2)
        Points in the first image, pixels; need not be whole, but within ``home`` of a corner.
    radius : float
        Pixels around the guess, and around the point on the way back.
    guess : array_like, shape (N, 2), optional
        Where to look in the second image; by default where the points were.
    limit : float
        As for :func:`~vslam_ref.features.patch_search.search`.
    home : float
        Pixels; infinity leaves out the way back.

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
    >>> follow(View(image, detect(image)), View(moved, detect(moved)), [[40.0, 32.0]], 6.0)
    Followed(uv=array([[43., 34.]]), ok=array([ True]))
    """
    start = as_array("uv", uv, 2)
    place = start.copy() if guess is None else as_array("guess", guess, 2).copy()
    same = np.broadcast_to(np.eye(2), (len(start), 2, 2))
    there = warp(first.image, start, same)
    found = search(second.image, second.corners, there.patch, place, radius, limit=limit)
    on = np.flatnonzero(there.inside & (found.corner >= 0))
    end = refine(second.image, there.patch[on], second.corners.xy[found.corner[on]])
    here = warp(second.image, end.uv, same[on])
    good = end.ok & here.inside
    if np.isfinite(home):
        back = search(first.image, first.corners, here.patch, start[on], radius, limit=limit)
        nearest = first.corners.xy[back.corner] if len(first.corners.xy) else start[on]
        away = np.hypot(*(nearest - start[on]).T)
        good = good & (back.corner >= 0) & (away <= home)  # eq-home
    place[on[good]] = end.uv[good]
    ok = np.zeros(len(start), np.bool_)
    ok[on[good]] = True
    return Followed(place, ok)
