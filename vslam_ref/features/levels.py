r"""Image pyramids: every level is the 2 x 2 mean of the one below, and half a pixel must not get lost.

Pixel (0, 0) is the *centre* of the top-left pixel.  The centre of the first pixel of level 1 is that of a
block of four pixels of level 0: (1/2, 1/2) there.  Each further level repeats this, so

.. math:: x_0 = 2^l x_l + \frac{2^l - 1}{2} .

A pixel of level l is :math:`\sigma = 2^l` pixels of level 0 wide: the standard deviation that a position
found there is given.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, as_array

Bytes = NDArray[np.uint8]
LEVELS = 4
"""Levels of PTAM's pyramid: 640 x 480 down to 80 x 60."""


def grey(name: str, image: ArrayLike, least: int = 1) -> Bytes:
    """Check a grey image (H, W) of 8 bits, at least ``least`` pixels high and wide, and lay it out in rows.

    Raises
    ------
    ValueError
        If it is no such image.

    Examples
    --------
    >>> grey("image", np.zeros((2, 3)))
    Traceback (most recent call last):
    ValueError: image is float64 of shape (2, 3): need uint8 of shape (H, W)
    """
    array = np.asarray(image)
    if array.dtype != np.uint8 or array.ndim != 2:
        raise ValueError(f"{name} is {array.dtype} of shape {array.shape}: need uint8 of shape (H, W)")
    if min(array.shape) < least:
        height, width = array.shape
        raise ValueError(f"{name} is {width} x {height} pixels: need at least {least} x {least}")
    return np.ascontiguousarray(array)


def pyramid(image: ArrayLike, levels: int = LEVELS) -> tuple[Bytes, ...]:
    """All levels of an image, the finest first.

    Implements the scale space of A fig 2.1.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    levels : int
        At least 1; the coarsest one must have a pixel.

    Returns
    -------
    tuple of ndarray of uint8
        Level l has the shape (H >> l, W >> l).

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, or too small for so many levels.

    Examples
    --------
    >>> [level.shape for level in pyramid(np.zeros((480, 640), np.uint8))]
    [(480, 640), (240, 320), (120, 160), (60, 80)]
    """
    if levels < 1:
        raise ValueError(f"levels is {levels}: need at least 1")
    found = [grey("image", image, 2 ** (levels - 1))]
    for _ in range(levels - 1):
        found.append(halve(found[-1]))
    return tuple(found)


def halve(image: ArrayLike) -> Bytes:
    """Mean of every block of 2 x 2 pixels, rounded half up.

    Implements :eq:`eq-pyramid`.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
        H and W at least 2.  The last row or column of an odd number is left out.

    Returns
    -------
    ndarray of uint8, shape (H // 2, W // 2)

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, or smaller than 2 x 2.

    Examples
    --------
    >>> halve(np.array([[1, 2, 9], [3, 5, 9]], np.uint8))
    array([[3]], dtype=uint8)
    """
    whole = grey("image", image, 2)
    height, width = (n // 2 for n in whole.shape)
    half: Bytes = _halve(whole.reshape(-1), whole.shape[1]).reshape(height, width)
    return half


@accelerated("features:halve")
def _halve(flat: Bytes, width: int) -> Bytes:
    """Blocks' means of an image in rows (H * width,), as a flat array."""
    image = flat.reshape(-1, width)
    height, half = image.shape[0] // 2, width // 2
    rows = image[: 2 * height, : 2 * half].astype(np.uint16)
    pairs = rows[0::2] + rows[1::2]
    total = pairs[:, 0::2] + pairs[:, 1::2]
    mean: Bytes = ((total + 2) >> 2).astype(np.uint8).reshape(-1)  # eq-pyramid
    return mean


def finest_from_level(uv: ArrayLike, level: Any) -> Array:
    """Pixels of level 0 from pixels of a level.

    Implements :eq:`eq-level-position`.

    Parameters
    ----------
    uv : array_like, shape (..., 2)
        Pixels of the level.
    level : int or array_like of int, shape (...)

    Returns
    -------
    ndarray, shape (..., 2)

    Examples
    --------
    >>> finest_from_level([0.0, 10.0], 3)
    array([ 3.5, 83.5])
    """
    scale = level_sigma(level)[..., None]
    return as_array("uv", uv, 2) * scale + (scale - 1) / 2


def level_from_finest(uv: ArrayLike, level: Any) -> Array:
    """Pixels of a level from pixels of level 0, the inverse of :func:`finest_from_level`.

    Implements :eq:`eq-level-position`.

    Parameters
    ----------
    uv : array_like, shape (..., 2)
        Pixels of level 0.
    level : int or array_like of int, shape (...)

    Returns
    -------
    ndarray, shape (..., 2)

    Examples
    --------
    >>> level_from_finest([3.5, 83.5], 3)
    array([ 0., 10.])
    """
    scale = level_sigma(level)[..., None]
    return (as_array("uv", uv, 2) - (scale - 1) / 2) / scale


def level_sigma(level: Any) -> Array:
    """Width of a level's pixel, 2^level pixels of level 0: the standard deviation of what is found there.

    Implements :eq:`eq-level-sigma`.

    Examples
    --------
    >>> level_sigma([0, 1, 3])
    array([1., 2., 8.])
    """
    sigma: Array = np.exp2(np.asarray(level, dtype=np.float64))
    return sigma
