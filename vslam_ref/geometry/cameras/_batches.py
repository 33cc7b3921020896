"""Lens parameters and positions as flat batches, so that an iteration can drop the points that are done."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray


class FlatPoints(NamedTuple):
    """Positions (N, 2), lens parameters (n,) for all or (N, n), and the shape that N stands for."""

    k: Array
    xd: Array
    shape: tuple[int, ...]


def flatten(k: Array, xd: Array) -> FlatPoints:
    """Broadcast k (..., n) against xd (..., 2); parameters that all points share are not copied."""
    shape = np.broadcast_shapes(xd.shape[:-1], k.shape[:-1])
    flat = np.broadcast_to(xd, (*shape, 2)).reshape(-1, 2)
    if k.ndim > 1:
        k = np.broadcast_to(k, (*shape, k.shape[-1])).reshape(-1, k.shape[-1])
    return FlatPoints(k, flat, shape)


def of(k: Array, at: IntArray) -> Array:
    """Parameters of the points ``at``."""
    return k if k.ndim == 1 else k[at]
