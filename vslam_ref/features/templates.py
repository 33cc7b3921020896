r"""Patches: what a point looks like, read from the image in which it was found, as another view sees it.

A small piece of a surface is seen through an affine map.  With

.. math:: A = \frac{\partial u_{target}}{\partial u_{source}}

in pixels of level 0, one pixel of level t in the target is :math:`M = 2^{t - s} A^{-1}` pixels of level s in
the source.  A template is read there, by bilinear interpolation, at the offsets M d with d the 64 pixels
-4 ... 3 in x and y.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, IntArray, as_array
from vslam_ref.features.levels import LEVELS, Bytes, grey

BEFORE, AFTER = 4, 3
"""A patch reaches from ``BEFORE`` pixels left of and above its pixel to ``AFTER`` on the other sides."""
SIDE = BEFORE + AFTER + 1
LARGEST_STRETCH = 3.0
"""Area in the target, over that in the source, at which a coarser level is searched: PTAM's number."""


class Templates(NamedTuple):
    """Patches (N, 8, 8) of 8 bits, and whether they lay inside their image (N,); zeros where not."""

    patch: Bytes
    inside: BoolArray


def search_level(A: ArrayLike, levels: int = LEVELS) -> IntArray:
    """Level of the target on which a patch has nearly its own size; -1 where there is none.

    Implements :eq:`eq-search-level`.

    Parameters
    ----------
    A : array_like, shape (..., 2, 2)
        d target pixel of level 0 / d source pixel of the source's level s: 2^s times A of the whole images.
    levels : int
        Levels of the target's pyramid.

    Returns
    -------
    ndarray of int64, shape (...)
        -1 if the patch is mirrored, shrunk to less than a quarter of its area, or larger than the coarsest
        level can show.

    Examples
    --------
    >>> search_level([1.0 * np.eye(2), 2.0 * np.eye(2), 0.4 * np.eye(2), 40.0 * np.eye(2)]).tolist()
    [0, 1, -1, -1]
    """
    area = np.linalg.det(as_array("A", A, 2, 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.ceil(np.log2(area / LARGEST_STRETCH) / 2)  # eq-search-level
    fits = (area >= 0.25) & (steps < levels)
    return np.where(fits, np.maximum(steps, 0), -1).astype(np.int64)


def sampling(A: ArrayLike, target_level: Any = 0, source_level: Any = 0) -> Array:
    """Pixels in the source's level for one pixel in the target's level.

    Implements :eq:`eq-sampling`.

    Parameters
    ----------
    A : array_like, shape (..., 2, 2)
        d target pixel / d source pixel, in pixels of level 0.
    target_level, source_level : int or array_like of int, shape (...)

    Returns
    -------
    ndarray, shape (..., 2, 2)

    Raises
    ------
    numpy.linalg.LinAlgError
        If an A is singular: the surface is seen from its edge.

    Examples
    --------
    >>> sampling([[2.0, 0.0], [0.0, 1.0]], 1, 0)
    array([[1., 0.],
           [0., 2.]])
    """
    octaves = np.asarray(target_level, dtype=np.float64) - np.asarray(source_level)
    M: Array = np.exp2(octaves)[..., None, None] * np.linalg.inv(as_array("A", A, 2, 2))
    return M


def warp(image: ArrayLike, uv: ArrayLike, M: ArrayLike) -> Templates:
    """Read templates from an image through affine maps.

    Implements :eq:`eq-warp`.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
        The source's level.
    uv : array_like, shape (N, 2)
        Centres, in pixels of that level; need not be whole.
    M : array_like, shape (N, 2, 2)
        Of :func:`sampling`.

    Returns
    -------
    Templates
        Entry [i, j] of a patch lies at ``uv + M @ (j - 4, i - 4)``, interpolated and rounded half up.

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, or shapes do not fit.

    Examples
    --------
    >>> image = np.arange(0, 200, 2, dtype=np.uint8)[:, None] + np.arange(20, dtype=np.uint8)
    >>> warp(image, [[10.0, 10.0]], [np.eye(2)]).patch[0, 4]
    array([26, 27, 28, 29, 30, 31, 32, 33], dtype=uint8)
    """
    whole = grey("image", image, 2)
    at, maps = as_array("uv", uv, 2), as_array("M", M, 2, 2)
    if at.ndim != 2 or maps.shape[:-2] != at.shape[:-1]:
        raise ValueError(f"uv is {at.shape} and M {maps.shape}: need (N, 2) and (N, 2, 2)")
    patch, inside = _warp(whole.reshape(-1), whole.shape[1], at, maps)
    return Templates(patch.reshape(-1, SIDE, SIDE), inside)


def cut(image: ArrayLike, xy: ArrayLike) -> Templates:
    """Templates around whole pixels, as they are: :func:`warp` with the identity.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    xy : array_like of int, shape (N, 2)

    Returns
    -------
    Templates
    """
    at = as_array("xy", xy, 2)
    return warp(image, at, np.broadcast_to(np.eye(2), (len(at), 2, 2)))


def bilinear(flat: NDArray[Any], width: int, x: Array, y: Array) -> Array:
    """Grey levels (...) between pixels x, y (...) inside an image ``flat`` (H * width,) in rows."""
    height = len(flat) // width
    i, j = np.minimum(y.astype(np.int64), height - 2), np.minimum(x.astype(np.int64), width - 2)
    fx, fy = x - j, y - i
    at = i * width + j
    a, b, c, d = (flat[at + k].astype(np.float64) for k in (0, 1, width, width + 1))
    top = a + fx * (b - a)
    bottom = c + fx * (d - c)
    level: Array = top + fy * (bottom - top)  # eq-bilinear
    return level


@accelerated("patches:warp")
def _warp(flat: Bytes, width: int, uv: Array, M: Array) -> tuple[Bytes, BoolArray]:
    """Patches (N, 64) of an image in rows (H * width,), and whether they were inside."""
    height = len(flat) // width
    step = np.arange(-BEFORE, AFTER + 1.0)
    dx, dy = np.tile(step, SIDE), np.repeat(step, SIDE)
    x = uv[:, 0, None] + (M[:, 0, 0, None] * dx + M[:, 0, 1, None] * dy)  # eq-warp
    y = uv[:, 1, None] + (M[:, 1, 0, None] * dx + M[:, 1, 1, None] * dy)
    inside = np.asarray(((x >= 0) & (x <= width - 1) & (y >= 0) & (y <= height - 1)).all(1))
    patch = np.zeros((len(uv), SIDE * SIDE), np.uint8)
    patch[inside] = np.floor(bilinear(flat, width, x[inside], y[inside]) + 0.5)
    return patch, inside
