r"""Pictures on surfaces, at every size: mip levels, and the mean of a pixel's footprint.

A pixel sees a patch of its surface, which the map from pixels to texels :math:`J` (2 x 2) makes of the
pixel's square.  If the patch is larger than a texel, looking up one texel would alias, and corners would
dance from image to image.  So each texture has levels, each the 2 x 2 mean of the one below, and the level is
chosen by the patch's shorter side; along its longer side up to ``PROBES`` samples are taken::

    J = U diag(long, short) V^T       probes = long / short rounded, 1 to PROBES
    level = log2(max(long / probes, short, 1))       between two levels: linear, and in each: bilinear

Texel (0, 0) covers the square from 0 to 1 in both texture coordinates; its centre is (1/2, 1/2).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.levels import pyramid

Bytes = NDArray[np.uint8]
LEVELS = 7
MULTIPLE = 2 ** (LEVELS - 1)
"""Sides of textures are multiples of this many texels, so that every level covers the same surface."""
PROBES = 4


class Textures(NamedTuple):
    """Textures with all their levels, one behind the other.

    Attributes
    ----------
    texels : ndarray of uint8, shape (n,)
        Grey values.
    table : ndarray of int, shape (T, LEVELS, 3)
        For each texture and level: where it begins in ``texels``, its height and its width.
    """

    texels: Bytes
    table: IntArray

    @property
    def extent(self) -> Array:
        """Width and height of each texture, texels, shape (T, 2)."""
        return self.table[:, 0, [2, 1]].astype(np.float64)


def pack(images: Sequence[Bytes]) -> Textures:
    """Compute the levels of textures (H, W), whose sides are multiples of ``MULTIPLE`` texels.

    Raises
    ------
    ValueError
        If a side is not.
    """
    parts, table, begin = [], np.zeros((len(images), LEVELS, 3), np.int64), 0
    for t, image in enumerate(images):
        if image.shape[0] % MULTIPLE or image.shape[1] % MULTIPLE:
            raise ValueError(f"texture {t} is {image.shape}: need multiples of {MULTIPLE} texels")
        for level, small in enumerate(pyramid(image, LEVELS)):
            table[t, level] = begin, *small.shape
            parts.append(small.reshape(-1))
            begin += small.size
    return Textures(np.concatenate(parts), table)


class Footprint(NamedTuple):
    """What pixels see of their surfaces.

    Attributes
    ----------
    level : ndarray, shape (N,)
        0 is the finest.
    probes : ndarray of int, shape (N,)
        How many samples to take.
    axis : ndarray, shape (2, N)
        The longer side of the patch, texels.
    """

    level: Array
    probes: IntArray
    axis: Array


def footprint(J: Array) -> Footprint:
    """Find the level, and the samples along the longer side, of patches J (2, 2, N), texels per pixel."""
    (p_u, p_v), (q_u, q_v) = J
    p, r, q = p_u * p_u + p_v * p_v, q_u * q_u + q_v * q_v, p_u * q_u + p_v * q_v  # J J^T
    long2 = 0.5 * (p + r + np.sqrt((p - r) * (p - r) + 4.0 * q * q))
    small = long2 <= 1.0  # a patch smaller than a texel: one sample of the finest level
    long = np.sqrt(np.where(small, 1.0, long2))
    short = np.where(small, 1.0, np.abs(p_u * q_v - p_v * q_u) / long)
    probes = np.clip(np.floor(long / np.maximum(short, 1e-12) + 0.5), 1, PROBES).astype(np.int64)
    level = np.minimum(np.log2(np.maximum(np.maximum(long / probes, short), 1.0)), LEVELS - 1.0)
    x, y = np.where(p >= r, (long2 - r, q), (q, long2 - p))
    several = probes > 1
    scale = np.where(several, long / np.where(several, np.sqrt(x * x + y * y), 1.0), 0.0)
    return Footprint(level, probes, np.stack([x * scale, y * scale]))


def sample(textures: Textures, which: IntArray, a: Array, b: Array, level: Array) -> Array:
    """Grey values (N,) of textures ``which (N,)`` at columns ``a (N,)``, rows ``b (N,)``, ``level (N,)``."""
    low = np.floor(level).astype(np.int64)
    high = np.minimum(low + 1, LEVELS - 1)
    share = level - low
    fine, coarse = (_bilinear(textures, which, a, b, at) for at in (low, high))
    return fine + share * (coarse - fine)


def _bilinear(textures: Textures, which: IntArray, a: Array, b: Array, level: IntArray) -> Array:
    begin, height, width = np.moveaxis(textures.table[which, level], -1, 0)
    scale = 0.5**level
    u = np.clip(a * scale - 0.5, 0.0, width - 1.0)
    v = np.clip(b * scale - 0.5, 0.0, height - 1.0)
    left, top = u.astype(np.int64), v.astype(np.int64)
    u, v = u - left, v - top
    right = np.minimum(left + 1, width - 1)
    row, next_row = begin + top * width, begin + np.minimum(top + 1, height - 1) * width
    grey = textures.texels
    upper = grey[row + left] + u * (grey[row + right].astype(np.float64) - grey[row + left])
    lower = grey[next_row + left] + u * (grey[next_row + right].astype(np.float64) - grey[next_row + left])
    return np.asarray(upper + v * (lower - upper))
