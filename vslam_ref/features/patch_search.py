r"""The corner near a predicted place that looks most like a template.

Two measures, both blind to a change of brightness, lowest best:

* ZMSSD, the sum of squared differences of both patches without their means,
  :math:`\sum (A - \bar A - B + \bar B)^2`, in squared grey levels;
* ZNCC, here one minus the correlation coefficient of both patches: also blind to a change of contrast.

Both come from five sums, :math:`\sum A, \sum B, \sum A^2, \sum B^2, \sum A B`; of the last alone there is one
for each pair.  All are integers below 2^24, so that single precision holds them exactly, and both backends
find the same corner, bit by bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray, as_array
from vslam_ref.features.corners import Corners
from vslam_ref.features.fast import Pixels
from vslam_ref.features.levels import Bytes, grey
from vslam_ref.features.templates import AFTER, BEFORE, SIDE

MEASURES = ("zmssd", "zncc")
AREA = SIDE * SIDE
LARGEST_RADIUS = 1e4
LIMIT = 0.5
"""Largest accepted cost, over the template's own variation: an absolute limit would depend on contrast."""


class Found(NamedTuple):
    """The best corner of each template.

    Attributes
    ----------
    corner : ndarray of int64, shape (N,)
        Number among the corners; -1 where none was within the radius, or none good enough.
    cost : ndarray, shape (N,)
        ZMSSD, or 1 - ZNCC, of the best corner within the radius, accepted or not; infinity where none was.
    """

    corner: IntArray
    cost: Array


def zmssd(a: ArrayLike, b: ArrayLike) -> Array:
    """Zero-mean sum of squared differences of patches.

    Implements :eq:`eq-zmssd`.

    Parameters
    ----------
    a, b : array_like, shape (..., n)
        Grey levels of n pixels, in the same order.

    Returns
    -------
    ndarray, shape (...)
        Squared grey levels, a sum over the pixels.

    Examples
    --------
    >>> float(zmssd([1, 2, 3], [11, 12, 16]))
    6.0
    """
    difference = np.asarray(a, np.float64) - np.asarray(b, np.float64)
    without_mean = difference - difference.mean(-1, keepdims=True)
    total: Array = np.sum(without_mean**2, -1)  # eq-zmssd
    return total


def zncc(a: ArrayLike, b: ArrayLike) -> Array:
    """Correlation coefficient of patches; 0 where one of them is flat.

    Implements :eq:`eq-zncc`.

    Parameters
    ----------
    a, b : array_like, shape (..., n)
        Grey levels of n pixels, in the same order.

    Returns
    -------
    ndarray, shape (...)
        -1 to 1.

    Examples
    --------
    >>> float(zncc([1, 2, 3], [10, 30, 50])), float(zncc([1, 2, 3], [7, 7, 7]))
    (1.0, 0.0)
    """
    p, q = np.broadcast_arrays(np.asarray(a, np.float64), np.asarray(b, np.float64))
    p, q = p - p.mean(-1, keepdims=True), q - q.mean(-1, keepdims=True)
    size = np.sqrt(np.sum(p * p, -1) * np.sum(q * q, -1))
    product = np.sum(p * q, -1)
    value: Array = np.divide(product, size, out=np.zeros_like(product), where=size > 0)  # eq-zncc
    return value


def search(
    image: ArrayLike,
    corners: Corners,
    patch: ArrayLike,
    uv: ArrayLike,
    radius: ArrayLike,
    *,
    limit: ArrayLike = LIMIT,
    measure: str = "zmssd",
) -> Found:
    """Find for each template the corner within a radius that looks most like it.

    Implements :eq:`eq-zmssd-sums`, and :eq:`eq-zncc` from the same sums: the patch search of A fig 2.1.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
        One level.
    corners : Corners
        Of this level; those without a whole patch are left out.
    patch : array_like of uint8, shape (N, 8, 8)
        Of :func:`~vslam_ref.features.templates.warp`.
    uv : array_like, shape (N, 2)
        Predicted places, in pixels of the level; near one that is not finite nothing is found.
    radius : array_like, shape () or (N,)
        Pixels of the level.
    limit : array_like, shape () or (N,)
        Largest cost that is accepted; of the ZMSSD, as a share of the template's own variation, the sum of
        (A - mean)^2.
    measure : str
        ``"zmssd"`` or ``"zncc"``.

    Returns
    -------
    Found
        Of equal corners, the first in row order.

    Raises
    ------
    ValueError
        If image, corners and templates do not fit, the measure is unknown, or a radius is out of range.

    Examples
    --------
    >>> from vslam_ref.features import corners, templates
    >>> image = np.random.default_rng(0).integers(0, 256, (40, 40), dtype=np.uint8)
    >>> found = corners.detect(image)
    >>> template = templates.cut(image, found.xy[50:51])
    >>> search(image, found, template.patch, found.xy[50:51] + [2.0, -1.0], 4.0)
    Found(corner=array([50]), cost=array([0.]))
    """
    whole = grey("image", image)
    if measure not in MEASURES:
        raise ValueError(f"measure is {measure!r}: need one of {', '.join(MEASURES)}")
    if corners.shape != whole.shape:
        raise ValueError(f"corners of an image {corners.shape} in one of {whole.shape}: need one shape")
    given = np.asarray(patch)
    at = as_array("uv", uv, 2)
    if given.dtype != np.uint8 or given.shape != (len(at), SIDE, SIDE) or at.ndim != 2:
        raise ValueError(
            f"templates are {given.dtype} of shape {given.shape}, uv {at.shape}: "
            f"need uint8 (N, {SIDE}, {SIDE}) and (N, 2)"
        )
    flat = np.ascontiguousarray(given).reshape(-1, AREA)
    reach = np.broadcast_to(np.asarray(radius, np.float64), len(at))
    if not ((reach >= 0) & (reach < LARGEST_RADIUS)).all():
        raise ValueError(f"radius is {radius!r}: need 0 to {LARGEST_RADIUS:g} pixels")
    somewhere = np.isfinite(at) & (np.abs(at) < 1e9)
    at = np.where(somewhere.all(-1, keepdims=True), at, -2 * LARGEST_RADIUS)  # where no corner can be
    index, cost = _search(
        whole.reshape(-1), whole.shape[1], corners.xy, corners.row_start, flat, at, reach, measure == "zncc"
    )
    scale = 1.0 if measure == "zncc" else variation(given)
    return Found(np.where(cost <= np.asarray(limit) * scale, index, -1), cost)


def variation(patch: ArrayLike) -> Array:
    """Sum of the squared deviations of patches (..., 8, 8) from their mean: the ZMSSD to a flat patch."""
    grey_levels = np.asarray(patch)
    return zmssd(grey_levels.reshape(*grey_levels.shape[:-2], AREA), 0.0)


class _Pairs(NamedTuple):
    """Templates (P,) and corners (P,) that meet, sorted by the template, then in row order."""

    template: IntArray
    corner: IntArray


def _within(width: int, xy: Pixels, uv: Array, radius: Array) -> _Pairs:
    """Corners within a radius of each place: two look-ups for each row that its circle meets."""
    key = xy[:, 1].astype(np.int64) * width + xy[:, 0]
    most = int(np.ceil(radius.max(initial=0.0)))
    y = np.rint(uv[:, 1:]) + np.arange(-most, most + 1)
    square = radius[:, None] ** 2 - (y - uv[:, 1:]) ** 2
    half = np.sqrt(np.maximum(square, 0.0))
    first, last = (np.clip(e, 0, width) for e in (np.ceil(uv[:, :1] - half), np.floor(uv[:, :1] + half) + 1))
    low, high = (np.searchsorted(key, y * width + x) for x in (first, last))
    count = np.where(square >= 0, high - low, 0)
    start = np.repeat(low.ravel() - np.cumsum(count) + count.ravel(), count.ravel())
    return _Pairs(np.repeat(np.arange(len(uv)), count.sum(1)), start + np.arange(len(start)))


@accelerated("patches:search")
def _search(
    flat: Bytes,
    width: int,
    xy: Pixels,
    row_start: IntArray,
    patch: Bytes,
    uv: Array,
    radius: Array,
    correlate: bool,
) -> tuple[IntArray, Array]:
    """Best corner (N,) of each template (N, 64) and its cost (N,); -1 and infinity without one."""
    index, cost = np.full(len(uv), -1), np.full(len(uv), np.inf)
    height = len(row_start) - 1
    whole = (xy >= BEFORE).all(1) & (xy < np.array([width, height]) - AFTER).all(1)
    number = np.flatnonzero(whole)
    pairs = _within(width, xy[number], uv, radius)
    if not len(pairs.corner):
        return index, cost
    used, of = np.unique(pairs.corner, return_inverse=True)
    each = _costs(patch, _patches(flat, width, xy[number[used]]), _Pairs(pairs.template, of), correlate)
    have, begin = np.unique(pairs.template, return_index=True)
    cost[have] = np.minimum.reduceat(each, begin)
    best = np.flatnonzero(each == cost[pairs.template])
    have, first = np.unique(pairs.template[best], return_index=True)
    index[have] = number[pairs.corner[best[first]]]
    return index, cost


def _patches(flat: Bytes, width: int, xy: Pixels) -> Bytes:
    """Patches (n, 64) around whole pixels."""
    step = np.arange(-BEFORE, AFTER + 1)
    offset = (step[:, None] * width + step).ravel()
    found: Bytes = flat[(xy[:, 1].astype(np.int64) * width + xy[:, 0])[:, None] + offset]
    return found


def _costs(a: Bytes, b: Bytes, pairs: _Pairs, correlate: bool) -> Array:
    """Cost of each pair, from sums that single precision holds exactly."""
    p, q = a.astype(np.float32), b.astype(np.float32)
    of_a, of_b = pairs
    cross = _as_integers(np.einsum("pk,pk->p", p[of_a], q[of_b]))
    sum_a, sum_b = (_as_integers(v.sum(1)) for v in (p, q))
    square_a, square_b = (_as_integers(np.einsum("pk,pk->p", v, v)) for v in (p, q))
    if correlate:
        size_a, size_b = (
            (AREA * square - total**2).astype(np.float64)
            for square, total in ((square_a, sum_a), (square_b, sum_b))
        )
        size = np.sqrt(size_a[of_a] * size_b[of_b])
        product = (AREA * cross - sum_a[of_a] * sum_b[of_b]).astype(np.float64)
        return 1.0 - np.divide(product, size, out=np.zeros(len(size)), where=size > 0)  # eq-zncc
    squares = square_a[of_a] + square_b[of_b] - 2 * cross
    of_means = (sum_a[of_a] - sum_b[of_b]) ** 2
    cost: Array = (AREA * squares - of_means) / AREA  # eq-zmssd-sums
    return cost


def _as_integers(x: NDArray[np.float32]) -> IntArray:
    return x.astype(np.int64)
