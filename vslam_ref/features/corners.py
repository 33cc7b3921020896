r"""Corners of one image: found, thinned out, weighed, and kept in row order.

The *structure tensor* of a window is the mean of :math:`g g^T` over its pixels, g the grey image's gradient.
Its smaller eigenvalue says how much the window changes when it moves into the direction in which it changes
least: large for a corner, near zero on an edge (Shi and Tomasi).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.features.fast import Pixels, corner_score, pixels, segment_test
from vslam_ref.features.levels import Bytes, grey

HALF = 3
"""The window of the structure tensor reaches so far to each side: 7 x 7 pixels, as in PTAM."""


class Corners(NamedTuple):
    """Pixels in row order, with the place where each row begins.

    Attributes
    ----------
    xy : ndarray of int32, shape (n, 2)
        Row by row, from the left.
    row_start : ndarray of int64, shape (H + 1,)
        ``xy[row_start[y] : row_start[y + 1]]`` are the corners of row y.
    width : int
        Pixels in a row of the image.
    """

    xy: Pixels
    row_start: IntArray
    width: int

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the image."""
        return len(self.row_start) - 1, self.width

    def only(self, keep: BoolArray) -> Corners:
        """Return those of a mask (n,)."""
        return _with_rows(self.xy[keep], self.shape)


def in_rows(xy: Pixels, shape: tuple[int, int]) -> Corners:
    """Give pixels (n, 2) in row order the places where rows begin, for an image of ``shape`` (H, W).

    Raises
    ------
    ValueError
        If they are not in row order, or one of them is outside.

    Examples
    --------
    >>> in_rows(np.array([[3, 0], [1, 2], [4, 2]]), (3, 5)).row_start.tolist()
    [0, 1, 1, 3]
    """
    at = pixels(xy, shape, 0, 0)
    if (np.diff(at[:, 1].astype(np.int64) * shape[1] + at[:, 0]) <= 0).any():
        raise ValueError("corners are not in row order, or one of them stands there twice")
    return _with_rows(at, shape)


def _with_rows(xy: Pixels, shape: tuple[int, int]) -> Corners:
    row_start = np.zeros(shape[0] + 1, np.int64)
    np.cumsum(np.bincount(xy[:, 1], minlength=shape[0]), out=row_start[1:])
    return Corners(xy, row_start, shape[1])


def detect(image: ArrayLike, threshold: int = 10, arc: int = 10, *, suppress: bool = False) -> Corners:
    """FAST corners of an image, all of them or the best of each neighbourhood.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    threshold : int
        Grey levels.
    arc : int
        Pixels in a row of 16, 9 to 12.
    suppress : bool
        Whether :func:`is_peak` is asked.

    Returns
    -------
    Corners

    Raises
    ------
    ValueError
        As :func:`~vslam_ref.features.fast.segment_test`.

    Examples
    --------
    >>> image = np.zeros((9, 9), np.uint8)
    >>> image[4:, 4:] = 100
    >>> detect(image, 20).xy.tolist(), detect(image, 20, arc=11).xy.tolist()
    ([[4, 4], [5, 4], [4, 5]], [[4, 4]])
    """
    whole = grey("image", image)
    found = _with_rows(segment_test(whole, threshold, arc), (whole.shape[0], whole.shape[1]))
    return found.only(is_peak(found, corner_score(whole, found.xy, arc))) if suppress else found


def is_peak(corners: Corners, score: ArrayLike) -> BoolArray:
    """Whether a corner's score is above those of all corners among its eight neighbours.

    Implements :eq:`eq-peak`.  Of two neighbours with the same score neither is a peak, as in OpenCV.

    Parameters
    ----------
    corners : Corners
        n of them.
    score : array_like, shape (n,)
        Not negative.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    return _is_peak(corners.xy, corners.row_start, corners.width, np.asarray(score, dtype=np.int64))


@accelerated("features:is_peak")
def _is_peak(xy: Pixels, row_start: IntArray, width: int, score: IntArray) -> BoolArray:
    """Which corners (n,) stand above their neighbours."""
    values, height = score.astype(np.int16), len(row_start) - 1
    map_of_scores = np.full((height + 2, width + 2), -1, np.int16)
    x, y = xy.T + 1
    map_of_scores[y, x] = values
    around = [map_of_scores[y + i, x + j] for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    return np.asarray(values > np.max(around, axis=0))  # eq-peak


def shi_tomasi(image: ArrayLike, xy: ArrayLike) -> Array:
    """Smaller eigenvalue of the structure tensor around each pixel.

    Implements :eq:`eq-shi-tomasi`.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    xy : array_like of int, shape (n, 2)
        Pixels (x, y), at least 4 from the border.

    Returns
    -------
    ndarray, shape (n,)
        Squared grey levels per squared pixel: the square of the root mean square slope in the direction
        with the least.  PTAM's number, of whole differences and half a sum, is twice this.

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, or a pixel is nearer to the border.

    Examples
    --------
    A plane has slopes in one direction only; a saddle I = x y has gradients (y, x), and the mean of their
    squares over -3 to 3 is 4.

    >>> x, y = np.meshgrid(np.arange(-4, 5), np.arange(-4, 5))
    >>> [float(shi_tomasi((100 + f).astype(np.uint8), [[4, 4]])[0]) for f in (3 * x, x * y)]
    [0.0, 4.0]
    """
    whole = grey("image", image)
    at = pixels(xy, whole.shape, HALF + 1, HALF + 1)
    return _shi_tomasi(whole.reshape(-1), whole.shape[1], at)


@accelerated("features:shi_tomasi")
def _shi_tomasi(flat: Bytes, width: int, xy: Pixels) -> Array:
    """Eigenvalues (n,) at pixels of an image in rows (H * width,)."""
    window = np.arange(-HALF, HALF + 1)
    at = (xy[:, 1].astype(np.int64) * width + xy[:, 0])[:, None] + (window[:, None] * width + window).ravel()
    grey_level = flat.astype(np.int64)
    gx = grey_level[at + 1] - grey_level[at - 1]  # twice the slope
    gy = grey_level[at + width] - grey_level[at - width]
    a, b, c = (np.einsum("nk,nk->n", p, q) for p, q in ((gx, gx), (gx, gy), (gy, gy)))
    root = np.sqrt(((a - c) ** 2 + 4 * b * b).astype(np.float64))
    smaller: Array = (a + c - root) / (8 * len(window) ** 2)  # eq-shi-tomasi: whole differences, mean
    return np.maximum(smaller, 0.0)
