"""FAST: a pixel is a corner if an arc of its circle is brighter, or darker, than itself.

The circle has 16 pixels and the radius 3.  FAST-N asks for N pixels in a row, all brighter than the centre by
more than a threshold, or all darker.  PTAM takes N = 10, OpenCV N = 9.  The answer is exact: no decision tree
was learned from pictures.

An arc is brighter than c + t if its *darkest* pixel is.  So take the darkest pixel of each arc, and of these
the brightest: it tells whether there is an arc, for every threshold at once, and how far it could be raised.
With NumPy this is a handful of minima and maxima of shifted images, without a branch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import IntArray
from vslam_ref.features.levels import Bytes, grey

Pixels = NDArray[np.int32]
Levels = NDArray[Any]
Combine = Callable[[Levels, Levels], Levels]

CIRCLE = np.array(
    [(0, 3), (1, 3), (2, 2), (3, 1), (3, 0), (3, -1), (2, -2), (1, -3)]
    + [(0, -3), (-1, -3), (-2, -2), (-3, -1), (-3, 0), (-3, 1), (-2, 2), (-1, 3)]
)
"""Offsets (x, y) of the 16 pixels, in order around the circle."""
BORDER = 3
"""Pixels nearer to the border than this have no whole circle, and are no corners."""
ARCS = (9, 10, 11, 12)
PORTION = 1 << 16
"""Pixels that are taken together: their minima and maxima stay in the processor's cache."""


def segment_test(image: ArrayLike, threshold: int, arc: int = 10) -> Pixels:
    """Find the corners of FAST-N, without suppression of neighbours.

    Implements :eq:`eq-segment-test`.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    threshold : int
        Grey levels, 0 to 254; a pixel of the arc must differ by *more* than this.
    arc : int
        N: pixels in a row, 9 to 12 of 16.

    Returns
    -------
    ndarray of int32, shape (n, 2)
        Pixels (x, y) of the corners, row by row and from the left.

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, the arc none of 9 to 12, or the threshold out of range.

    Examples
    --------
    >>> image = np.zeros((9, 9), np.uint8)
    >>> image[4, 4] = 100
    >>> segment_test(image, 20).tolist()
    [[4, 4]]
    """
    whole = grey("image", image)
    _check(arc)
    if not 0 <= threshold <= 254:
        raise ValueError(f"threshold is {threshold}: need 0 to 254 grey levels")
    if min(whole.shape) <= 2 * BORDER:
        return np.zeros((0, 2), np.int32)
    return _segment_test(whole.reshape(-1), whole.shape[1], int(threshold), arc)


def corner_score(image: ArrayLike, xy: ArrayLike, arc: int = 10) -> IntArray:
    """Largest threshold at which each pixel is still a corner; -1 where it is none at any.

    Implements :eq:`eq-corner-score`.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    xy : array_like of int, shape (n, 2)
        Pixels (x, y), at least 3 from the border.
    arc : int
        N: pixels in a row, 9 to 12 of 16.

    Returns
    -------
    ndarray of int64, shape (n,)
        -1 to 254.

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, the arc none of 9 to 12, or a pixel without its circle.

    Examples
    --------
    >>> image = np.zeros((9, 9), np.uint8)
    >>> image[4:, 4:] = 100
    >>> corner_score(image, [[4, 4], [5, 5]])
    array([99, -1])
    """
    whole = grey("image", image)
    _check(arc)
    at = pixels(xy, whole.shape, BORDER, BORDER)
    return _corner_score(whole.reshape(-1), whole.shape[1], at, arc)


def pixels(xy: ArrayLike, shape: tuple[int, int], before: int, after: int) -> Pixels:
    """Check whole pixels (n, 2) with ``before`` pixels to the left and above, ``after`` on the other sides.

    Raises
    ------
    ValueError
        If they are not whole, or one of them has less.
    """
    given = np.asarray(xy)
    at = given.astype(np.int32)
    if at.ndim != 2 or at.shape[1] != 2 or not np.array_equal(at, given):
        raise ValueError(f"xy is {given.dtype} of shape {given.shape}: need whole pixels of shape (n, 2)")
    inside = (at >= before).all(1) & (at < np.array(shape[::-1]) - after).all(1)
    if not inside.all():
        raise ValueError(
            f"pixel {tuple(at[~inside][0].tolist())} of an image of {shape[1]} x {shape[0]}: "
            f"need {before} pixels before it and {after} behind"
        )
    return np.ascontiguousarray(at)


def _check(arc: int) -> None:
    if arc not in ARCS:
        raise ValueError(f"arc is {arc}: need one of {', '.join(map(str, ARCS))} of 16")


def _best_arc(circle: Sequence[Levels], arc: int, near: Combine, far: Combine) -> Levels:
    """``far`` over all arcs of ``near`` over an arc's pixels; one is the minimum, the other the maximum.

    Two arcs that begin at s - 1 and s share the arc - 1 pixels from s on: eight such middles, for odd s, do.
    """
    p = [circle[k % 16] for k in range(32)]
    two = {s: near(p[s], p[s + 1]) for s in range(1, 16, 2)}
    four = {s: near(two[s], two[(s + 2) % 16]) for s in two}
    best = None
    for s in two:
        middle = near(four[s], four[(s + 4) % 16])  # 8 pixels
        if arc > 10:
            middle = near(middle, two[(s + 8) % 16])
        if arc in (10, 12):
            middle = near(middle, p[s + arc - 2])
        either = near(middle, far(p[s - 1], p[s + arc - 1]))
        best = either if best is None else far(best, either)
    assert best is not None
    return best


@accelerated("features:segment_test")
def _segment_test(flat: Bytes, width: int, threshold: int, arc: int) -> Pixels:
    """Corners (n, 2) of an image in rows (H * width,)."""
    corner = np.zeros(len(flat), np.bool_)
    first, end = BORDER * width + BORDER, len(flat) - BORDER * width - BORDER
    for low in range(first, end, PORTION):  # rows run on: what wraps around lies in the border
        part = slice(low, min(low + PORTION, end))
        circle = [flat[part.start + k : part.stop + k] for k in CIRCLE[:, 0] + CIRCLE[:, 1] * width]
        centre = flat[part]
        above = np.minimum(centre, 255 - threshold) + np.uint8(threshold)  # beyond 255 nothing is brighter
        below = np.maximum(centre, threshold) - np.uint8(threshold)
        bright = _best_arc(circle, arc, np.minimum, np.maximum) > above
        corner[part] = bright | (_best_arc(circle, arc, np.maximum, np.minimum) < below)  # eq-segment-test
    inner = corner.reshape(-1, width)[BORDER:-BORDER, BORDER:-BORDER]
    y, x = np.divmod(np.flatnonzero(inner), inner.shape[1])
    return np.stack([x + BORDER, y + BORDER], 1).astype(np.int32)


@accelerated("features:corner_score")
def _corner_score(flat: Bytes, width: int, xy: Pixels, arc: int) -> IntArray:
    """Scores (n,) of pixels of an image in rows (H * width,)."""
    at = xy[:, 1].astype(np.int64) * width + xy[:, 0]
    circle = flat[at + (CIRCLE[:, 0] + CIRCLE[:, 1] * width)[:, None]].astype(np.int64)
    brighter = _best_arc(circle, arc, np.minimum, np.maximum) - flat[at]
    darker = flat[at] - _best_arc(circle, arc, np.maximum, np.minimum)
    score: IntArray = np.maximum(np.maximum(brighter, darker), 0) - 1  # eq-corner-score
    return score
