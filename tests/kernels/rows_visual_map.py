"""Inputs for the twins of the visual map: patches of a noisy picture, looked for around wrong places."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.features.corners import detect
from vslam_ref.features.templates import cut

from .rows_features import image, read_only

Rng = np.random.Generator


def _for_locate(rng: Rng, n: int, absolute: float, correlate: bool, first: bool) -> tuple[Any, ...]:
    """Places off by up to 3 pixels, half of them whole; templates of noise; flat ones; one at no place."""
    drawn = image(rng, n)
    found = detect(drawn, 12)
    xy = found.xy[rng.permutation(len(found.xy))[: 20 * n]]
    patch = cut(drawn, xy).patch.reshape(-1, 64)
    patch[::5] = rng.integers(0, 256, patch[::5].shape)
    patch[1::9] = 77
    uv = xy + rng.integers(-3, 4, xy.shape) * rng.choice([0.3, 1.0], (len(xy), 1))
    uv[2:4] = [[1e12, 3.0], [-50.0, 20.0]]
    picture, radius = read_only(drawn.reshape(-1)), rng.uniform(0, 9, len(xy))
    corners = read_only(found.xy), found.row_start
    return (picture, drawn.shape[1], *corners, read_only(patch), uv, radius, 0.5, absolute, correlate, first)


def for_locate(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_locate(rng, n, 0.0, False, True)


def for_locate_by_corners(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_locate(rng, n, 9000.0 * (n % 2), B % 2 == 0, False)


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "looking:locate": [for_locate, for_locate_by_corners],
}
