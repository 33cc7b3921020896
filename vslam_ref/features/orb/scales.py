r"""Octaves: each picture is the one before, resampled so that its pixels are s times as wide.

Pixel (0, 0) is the *centre* of the top-left pixel, so the pictures' common corner is (-1/2, -1/2), and

.. math:: x_0 + \tfrac{1}{2} = s^l \left( x_l + \tfrac{1}{2} \right) .

Without the halves, a feature of octave 7 is found 1.3 pixels from where it is.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray, as_array
from vslam_ref.features.levels import Bytes, grey

ONE = 11
"""Bits of the weights between pixels: whole numbers give the same grey levels everywhere."""


def octave_images(image: ArrayLike, octaves: int, scale: float) -> tuple[Bytes, ...]:
    """Pictures of all octaves, the finest first; it ends early where a picture would have no pixel.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    octaves : int
    scale : float
        Above 1, at most 2: between two pixels, no more than four are mixed.

    Returns
    -------
    tuple of ndarray of uint8

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits.

    Examples
    --------
    >>> [o.shape for o in octave_images(np.zeros((480, 640), np.uint8), 4, 1.2)]
    [(480, 640), (400, 533), (333, 444), (277, 370)]
    """
    found = [grey("image", image)]
    while len(found) < octaves and min(found[-1].shape) >= scale:
        found.append(shrink(found[-1], scale))
    return tuple(found)


def shrink(image: Bytes, scale: float) -> Bytes:
    """Resample a picture (H, W) to pixels that are ``scale`` times as wide, between four pixels.

    Implements :eq:`eq-orb-octave`.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W)
    scale : float

    Returns
    -------
    ndarray of uint8, shape (floor(H / scale), floor(W / scale))

    Examples
    --------
    >>> shrink(np.array([[0, 60, 120, 180, 240, 100]] * 2, np.uint8), 1.2).tolist()
    [[6, 78, 150, 222, 114]]
    """
    height, width = (int(n / scale) for n in image.shape)
    y, wy = _between(height, image.shape[0], scale)
    x, wx = _between(width, image.shape[1], scale)
    return _resampled(image, y, wy, x, wx)


def _between(count: int, of: int, scale: float) -> tuple[IntArray, IntArray]:
    """First of the two pixels between which each new one lies, and the second one's weight."""
    at = scale * (np.arange(count) + 0.5) - 0.5  # eq-orb-octave
    first = np.clip(np.floor(at).astype(np.int64), 0, max(of - 2, 0))
    return first, np.rint((at - first) * 2**ONE).astype(np.int64)


@accelerated("orb:resampled")
def _resampled(image: Bytes, y: IntArray, wy: IntArray, x: IntArray, wx: IntArray) -> Bytes:
    """Bilinear grey levels (h, w), rounded half up."""
    one = np.int32(2**ONE)
    right = np.minimum(x + 1, image.shape[1] - 1)
    low = np.minimum(y + 1, image.shape[0] - 1)
    after, below = wx.astype(np.int32), wy.astype(np.int32)[:, None]
    rows = image[:, x] * (one - after) + image[:, right] * after
    total = rows[y] * (one - below) + rows[low] * below
    mixed: Bytes = ((total + np.int32(2 ** (2 * ONE - 1))) >> (2 * ONE)).astype(np.uint8)
    return mixed


def finest_from_octave(uv: ArrayLike, octave: Any, scale: float) -> Array:
    """Pixels of octave 0 from pixels of an octave.

    Implements :eq:`eq-orb-octave`.

    Parameters
    ----------
    uv : array_like, shape (..., 2)
        Pixels of the octave.
    octave : int or array_like of int, shape (...)
    scale : float

    Returns
    -------
    ndarray, shape (..., 2)

    Examples
    --------
    >>> finest_from_octave([0.0, 9.5], 1, 1.2).round(12)
    array([ 0.1, 11.5])
    """
    wide = np.power(float(scale), np.asarray(octave))[..., None]
    finest: Array = (as_array("uv", uv, 2) + 0.5) * wide - 0.5
    return finest
