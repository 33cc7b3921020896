"""Descriptors: 256 comparisons of two pixels in the smoothed picture, turned with the patch."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray, as_array
from vslam_ref.features.fast import Pixels, pixels
from vslam_ref.features.levels import Bytes, grey
from vslam_ref.features.orb.candidates import BORDER
from vslam_ref.features.orb.pair_table import PAIRS

WEIGHTS = np.array([18, 34, 49, 54, 49, 34, 18])
"""A Gaussian of two pixels on seven, as 256ths; the middle one takes what rounding left over."""
UNIT = 1e-6
"""A direction's length may be so far from 1."""


def smooth(image: ArrayLike) -> Bytes:
    """Smooth a picture by a Gaussian of two pixels; beyond its border it goes on as its mirror image.

    Implements :eq:`eq-orb-smooth`.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
        H and W at least 4.

    Returns
    -------
    ndarray of uint8, shape (H, W)

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, or smaller.

    Examples
    --------
    >>> image = np.zeros((9, 9), np.uint8)
    >>> image[4, 4] = 255
    >>> smooth(image)[4]
    array([ 0,  4,  7, 10, 11, 10,  7,  4,  0], dtype=uint8)
    """
    return _smooth(grey("image", image, 4))


@accelerated("orb:smooth")
def _smooth(image: Bytes) -> Bytes:
    """Seven pixels along the rows, then down the columns: whole numbers, rounded half up."""
    height, width = image.shape
    wide = np.pad(image, 3, mode="reflect").astype(np.uint16)
    rows = np.zeros((height + 6, width), np.uint16)
    for k, w in enumerate(WEIGHTS):
        rows += wide[:, k : k + width] * np.uint16(w)
    total = np.full((height, width), 2**15, np.uint32)
    for k, w in enumerate(WEIGHTS):
        total += rows[k : k + height] * np.uint32(w)
    smoothed: Bytes = (total >> 16).astype(np.uint8)  # eq-orb-smooth
    return smoothed


def describe(smoothed: ArrayLike, xy: ArrayLike, direction: ArrayLike, pairs: IntArray = PAIRS) -> Bytes:
    """Describe patches of a smoothed picture by comparisons of pairs of pixels, 256 by default.

    Implements :eq:`eq-orb-test`.

    Parameters
    ----------
    smoothed : array_like of uint8, shape (H, W)
    xy : array_like of int, shape (n, 2)
        Pixels (x, y), at least 19 from the border.
    direction : array_like, shape (n, 2)
        Unit vectors (cos, sin) of the patches' angles.
    pairs : ndarray of int, shape (8 b, 4)
        Offsets x, y, x, y of both pixels, at most 19 from the centre.

    Returns
    -------
    ndarray of uint8, shape (n, b), by default (n, 32)
        Bit k of byte j is set if the first pixel of pair 8 j + k is darker than the second.

    Raises
    ------
    ValueError
        If the picture is not grey with 8 bits, a pixel is nearer to the border, a direction's length
        is not 1, or pairs are not as said.

    Examples
    --------
    >>> describe(np.zeros((39, 39), np.uint8), [[19, 19]], [[1.0, 0.0]]).any()
    np.False_
    """
    whole = grey("smoothed", smoothed)
    at = pixels(xy, whole.shape, BORDER, BORDER)
    unit = as_array("direction", direction, 2)
    if unit.shape != at.shape:
        raise ValueError(f"direction is of shape {unit.shape}: need {at.shape}, one for each pixel")
    off = ~(np.abs(np.hypot(unit[:, 0], unit[:, 1]) - 1) <= UNIT)
    if off.any():
        raise ValueError(f"direction {unit[off][0].tolist()}: need (cos, sin) of an angle, of length 1")
    if pairs.ndim != 2 or pairs.shape[1] != 4 or len(pairs) % 8:
        raise ValueError(f"pairs {pairs.shape}: need (8 b, 4), whole bytes of comparisons")
    if (np.hypot(pairs[:, ::2], pairs[:, 1::2]) > BORDER).any():
        raise ValueError(f"a pair has a pixel more than {BORDER} from the centre")
    return _describe(whole.reshape(-1), whole.shape[1], at, unit, pairs)


@accelerated("orb:describe")
def _describe(flat: Bytes, width: int, xy: Pixels, direction: Array, pairs: IntArray) -> Bytes:
    """Descriptors (n, len(pairs) / 8) in a picture in rows (H * width,); pairs (m, 4) are x, y, x, y."""
    value = _turned(flat, width, xy, direction, pairs.reshape(-1, 2)).reshape(len(xy), len(pairs), 2)
    return np.packbits(value[..., 0] < value[..., 1], axis=1, bitorder="little")  # eq-orb-test


def turned_pixels(smoothed: Bytes, xy: Pixels, direction: Array, offset: IntArray) -> Bytes:
    """Grey levels (n, m) around each pixel (n, 2), at offsets (m, 2) in pixels that turn with the directions.

    Implements :eq:`eq-orb-steer`.
    """
    return _turned(smoothed.reshape(-1), smoothed.shape[1], xy, direction, offset)


def _turned(flat: Bytes, width: int, xy: Pixels, direction: Array, offset: IntArray) -> Bytes:
    c, s = direction[:, 0, None], direction[:, 1, None]
    dx = np.rint(c * offset[:, 0] - s * offset[:, 1]).astype(np.int64)  # (n, m) eq-orb-steer
    dy = np.rint(s * offset[:, 0] + c * offset[:, 1]).astype(np.int64)
    grey_level: Bytes = flat[(xy[:, 1].astype(np.int64) * width + xy[:, 0])[:, None] + dy * width + dx]
    return grey_level
