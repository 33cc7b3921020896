"""Array types that every room uses, the check of an input's shape, and products over batch axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def as_array(name: str, value: ArrayLike, *tail: int) -> Array:
    """Return float64 array of shape ``(..., *tail)``, or raise a ValueError that names what was given.

    >>> as_array("t", [1, 2, 3], 3)
    array([1., 2., 3.])
    >>> as_array("t", [1, 2], 3)
    Traceback (most recent call last):
    ValueError: t has shape (2,): need (..., 3)
    """
    array = np.asarray(value, dtype=np.float64)
    if tail and array.shape[-len(tail) :] != tail:
        wanted = ", ".join(map(str, tail))
        raise ValueError(f"{name} has shape {array.shape}: need (..., {wanted})")
    return array


def transpose(M: Array) -> Array:
    """Swap the last two axes."""
    return np.swapaxes(M, -1, -2)


def times(M: Array, x: Array) -> Array:
    """Matrix times vector over all batch axes, shapes (..., m, n) and (..., n)."""
    product: Array = np.einsum("...ij,...j->...i", M, x)
    return product


def blocks(rows: Sequence[Sequence[Any]]) -> Array:
    """Join blocks whose batch axes broadcast; a number stands for a block filled with it.

    Block sizes come from the first block of the row or column that is not a number.
    """
    arrays = [[np.asarray(block, dtype=np.float64) for block in row] for row in rows]
    heights = [next(block.shape[-2] for block in row if block.ndim) for row in arrays]
    columns = list(zip(*arrays, strict=True))
    widths = [next(block.shape[-1] for block in column if block.ndim) for column in columns]
    batch = np.broadcast_shapes(*[block.shape[:-2] for row in arrays for block in row if block.ndim])
    out = np.empty((*batch, sum(heights), sum(widths)))
    top = 0
    for height, row in zip(heights, arrays, strict=True):
        left = 0
        for width, block in zip(widths, row, strict=True):
            out[..., top : top + height, left : left + width] = block
            left += width
        top += height
    return out
