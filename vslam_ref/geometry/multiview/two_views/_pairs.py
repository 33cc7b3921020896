"""Pairs of image positions, checked once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array


def checked_pairs(
    xn_a: ArrayLike, xn_b: ArrayLike, least: int = 0, exact: bool = False
) -> tuple[Array, Array]:
    """Both as arrays (..., N, 2) of finite numbers.

    Raises
    ------
    ValueError
        If shapes differ, a number is not finite, or there are fewer pairs than ``least`` (or not just as
        many).
    """
    a, b = as_array("xn_a", xn_a, 2), as_array("xn_b", xn_b, 2)
    if a.ndim < 2 or a.shape != b.shape:
        raise ValueError(f"xn_a {a.shape} and xn_b {b.shape}: need (..., N, 2) twice")
    if a.shape[-2] < least or (exact and a.shape[-2] != least):
        raise ValueError(f"{a.shape[-2]} pairs: need {'exactly' if exact else 'at least'} {least}")
    bad = np.argwhere(~(np.isfinite(a) & np.isfinite(b)).all(axis=-1))
    if len(bad):
        at = tuple(bad[0])
        raise ValueError(f"pair {bad[0].tolist()} is {a[at].tolist()}, {b[at].tolist()}: must be finite")
    return a, b


def checked_sigma(sigma: float) -> float:
    """Return the standard deviation of one coordinate, in the unit of the positions.

    Raises
    ------
    ValueError
        If it is not finite and positive.
    """
    if not 0.0 < sigma < np.inf:
        raise ValueError(f"sigma={sigma}: must be finite and more than 0 (sigma_px over the focal length)")
    return float(sigma)


def homogeneous(x: Array) -> Array:
    """(x, y, 1) of positions (..., 2)."""
    return np.concatenate([x, np.ones((*x.shape[:-1], 1))], axis=-1)


def conditioner(x: Array) -> Array:
    """Similarity (..., 3, 3) that moves points (..., N, 2) to centre 0 and mean distance sqrt(2)."""
    centre = x.mean(axis=-2)
    distance = np.linalg.norm(x - centre[..., None, :], axis=-1).mean(axis=-1)
    scale = np.sqrt(2.0) / np.where(distance > 0, distance, 1.0)
    T = np.zeros((*centre.shape[:-1], 3, 3))
    T[..., 0, 0] = T[..., 1, 1] = scale
    T[..., :2, 2] = -scale[..., None] * centre
    T[..., 2, 2] = 1.0
    return T


def moved(T: Array, x: Array) -> Array:
    """Points (..., N, 2) under a scaling and shift T (..., 3, 3)."""
    return np.asarray(x * T[..., None, [0, 1], [0, 1]] + T[..., None, :2, 2])
