"""The direction of a patch: from its centre to the centroid of its grey levels."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.fast import Pixels, pixels
from vslam_ref.features.levels import Bytes, grey

RADIUS = 15
_SIDE = np.arange(-RADIUS, RADIUS + 1)
DISC = np.array([(x, y) for y in _SIDE for x in _SIDE if x * x + y * y <= (RADIUS + 0.5) ** 2])
"""Offsets (749, 2) of the pixels (x, y) whose distance from the centre rounds to 15 or less."""


def moments(image: ArrayLike, xy: ArrayLike) -> IntArray:
    """First moments of the grey levels in a disc around each pixel.

    Implements :eq:`eq-orb-moments`.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    xy : array_like of int, shape (n, 2)
        Pixels (x, y), at least 15 from the border.

    Returns
    -------
    ndarray of int64, shape (n, 2)
        (m10, m01), grey levels times pixels.

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, or a pixel is nearer to the border.

    Examples
    --------
    A single bright pixel, 10 to the right of the centre and 4 below.

    >>> image = np.zeros((31, 31), np.uint8)
    >>> image[19, 25] = 7
    >>> moments(image, [[15, 15]])
    array([[70, 28]])
    """
    whole = grey("image", image)
    at = pixels(xy, whole.shape, RADIUS, RADIUS)
    return _moments(whole.reshape(-1), whole.shape[1], at)


@accelerated("orb:moments")
def _moments(flat: Bytes, width: int, xy: Pixels) -> IntArray:
    """Moments (n, 2) in an image in rows (H * width,)."""
    at = (xy[:, 1].astype(np.int64) * width + xy[:, 0])[:, None] + DISC[:, 1] * width + DISC[:, 0]
    found: IntArray = np.rint(flat[at].astype(np.float64) @ DISC).astype(np.int64)  # eq-orb-moments
    return found


def towards(moment: IntArray) -> Array:
    """Directions (n, 2), normalised, of moments (n, 2); (1, 0) where a patch has no direction.

    Implements :eq:`eq-orb-angle`.

    Examples
    --------
    >>> towards(np.array([[30, 40], [0, 0]]))
    array([[0.6, 0.8],
           [1. , 0. ]])
    """
    length = np.hypot(moment[:, 0], moment[:, 1])
    flat = length == 0
    unit: Array = (moment + np.outer(flat, [1, 0])) / (length + flat)[:, None]  # eq-orb-angle
    return unit
