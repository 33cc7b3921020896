"""Direction and bits of key points of any place and scale."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray, as_array
from vslam_ref.features.freak.pair_table import PAIRS
from vslam_ref.features.freak.pattern import CENTRE, HALF, REACH, WEIGHT, WIDTH
from vslam_ref.features.freak.sampling import PARTS, field_means, sums
from vslam_ref.features.levels import Bytes, grey

Flags = NDArray[np.bool_]
FLAT = 1e-9
"""Grey levels: a direction this short is rounding, and is none.  Means are whole numbers over at least 4096
times the area of a box, and 90 of them below 256 are added: what rounding leaves is below 1e-11."""


class FreakFeatures(NamedTuple):
    """Descriptions of those key points whose pattern lies in the picture.

    Attributes
    ----------
    kept : ndarray of int64, shape (k,)
        Which of the given key points these are; the others are too near to the border.
    angle : ndarray, shape (k,)
        Radians, from x towards y, -pi to pi; 0 where a patch has no direction.
    descriptor : ndarray of uint8, shape (k, 64)
        Bit k of byte j is set if the first field of pair 8 j + k is brighter than the second.
    """

    kept: IntArray
    angle: Array
    descriptor: Bytes


def describe(
    image: ArrayLike, uv: ArrayLike, scale: ArrayLike = 1.0, pairs: IntArray = PAIRS
) -> FreakFeatures:
    """Describe key points of a picture by FREAK.

    Implements equations 1, 2 and 4 of the paper.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    uv : array_like, shape (n, 2)
        Pixels; (0, 0) is the centre of the top-left pixel, and fractions count.
    scale : array_like, shape () or (n,)
        Pixels of the picture in one of the pattern, from the detector; above 0 and not quantised.
    pairs : ndarray of int, shape (8 b, 2)
        Fields that are compared.

    Returns
    -------
    FreakFeatures
        None at all where the picture is smaller than the pattern: 45 x 45 pixels at scale 1.

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, a key point is not finite, or a scale not above 0.

    Examples
    --------
    >>> image = np.tile(np.arange(90, dtype=np.uint8), (60, 1))
    >>> found = describe(image, [[40.25, 30.0], [10.0, 30.0]])
    >>> found.kept, bool(abs(found.angle[0]) < 1e-9), found.descriptor.shape
    (array([0]), True, (1, 64))
    """
    whole = grey("image", image)
    at, wide = _key_points(uv, scale)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or len(pairs) % 8:
        raise ValueError(f"pairs {pairs.shape}: need (8 b, 2), whole bytes of comparisons")
    if pairs.size and (pairs.min() < 0 or pairs.max() >= len(CENTRE)):
        raise ValueError(f"pairs name fields {pairs.min()} to {pairs.max()}: need 0 to {len(CENTRE) - 1}")
    kept = np.flatnonzero(inside((whole.shape[0], whole.shape[1]), at, wide))
    table = sums(whole)
    at, wide = at[kept], wide[kept]
    unit, angle = directions(upright_means(table, at, wide))
    mean = field_means(table, at, wide, unit, CENTRE, HALF)
    return FreakFeatures(kept, angle, _bits(mean, np.ascontiguousarray(pairs, np.int64)))


def _key_points(uv: ArrayLike, scale: ArrayLike) -> tuple[Array, Array]:
    """Check key points (n, 2) and their scales, and give each one its own."""
    at = np.asarray(uv, np.float64)
    if at.size == 0:
        at = at.reshape(0, 2)
    if at.ndim != 2 or at.shape[1] != 2:
        raise ValueError(f"uv is of shape {at.shape}: need (n, 2)")
    if not np.isfinite(at).all():
        k = int(np.flatnonzero(~np.isfinite(at).all(1))[0])
        raise ValueError(f"key point {k} is ({at[k, 0]}, {at[k, 1]}): need finite pixels")
    wide = as_array("scale", scale)
    if wide.shape not in ((), (len(at),)):
        raise ValueError(f"scale is of shape {wide.shape}: need () or ({len(at)},), one for each key point")
    wide = np.array(np.broadcast_to(wide, len(at)))
    if not (np.isfinite(wide) & (wide > 0)).all():
        k = int(np.flatnonzero(~(np.isfinite(wide) & (wide > 0)))[0])
        raise ValueError(f"scale of key point {k} is {wide[k]}: need a finite number above 0")
    return np.ascontiguousarray(at), wide


def inside(shape: tuple[int, int], uv: Array, scale: Array) -> Flags:
    """Whether each pattern lies in a picture (H, W), however it turns; uv (n, 2) in pixels, scale (n,).

    Edges are rounded to 64ths of a pixel: one part of them is kept free.
    """
    ring = REACH / (1 + WIDTH)
    reach = scale * ring + np.maximum(WIDTH * ring * scale, 0.5) + 1 / PARTS
    last = np.array(shape[::-1]) - 0.5
    free = (uv - reach[:, None] >= -0.5) & (uv + reach[:, None] <= last)
    return np.asarray(free.all(1))


def upright_means(table: IntArray, uv: Array, scale: Array) -> Array:
    """Means (n, 43) of the fields, grey levels, before the pattern turns.

    In pixels: uv (n, 2); scale (n,) has no unit, and table is (H + 1, W + 1).
    """
    ahead = np.tile([1.0, 0.0], (len(uv), 1))
    return field_means(table, uv, scale, ahead, CENTRE, HALF)


def directions(mean: Array) -> tuple[Array, Array]:
    """Directions (n, 2), normalised, and angles (n,), radians, of means (n, 43); (1, 0) where there is none.

    Implements equation 4 of the paper.

    Examples
    --------
    >>> directions(np.full((1, 43), 90.0))
    (array([[1., 0.]]), array([0.]))
    """
    o = mean @ WEIGHT  # grey levels
    o[np.hypot(o[:, 0], o[:, 1]) < FLAT] = (1.0, 0.0)
    unit: Array = o / np.hypot(o[:, 0], o[:, 1])[:, None]
    return unit, np.arctan2(unit[:, 1], unit[:, 0])


@accelerated("freak:bits")
def _bits(mean: Array, pairs: IntArray) -> Bytes:
    """Descriptors (n, len(pairs) / 8) of means (n, 43)."""
    return np.packbits(mean[:, pairs[:, 0]] > mean[:, pairs[:, 1]], axis=1, bitorder="little")
