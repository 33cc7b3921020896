"""Inputs for the twins of ORB-SLAM: few places and features, so that windows are full and distances tie."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .rows_features import read_only

Rng = np.random.Generator


def descriptors(rng: Rng, count: int) -> np.ndarray:
    """Half of them twice."""
    some = rng.integers(0, 256, (max(count // 2, 1), 32), dtype=np.uint8)
    return read_only(some[rng.integers(0, len(some), count)])


def for_search(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Places on and between the features; one window holds none, one has no width, one holds all."""
    places, features = 12 * n, 20 * n
    uv, feature_uv = (np.round(rng.uniform(0, 30, (count, 2)), 1) for count in (places, features))
    radius, octave = rng.uniform(0, 9, places), rng.integers(0, 4, features)
    uv[0], radius[1:3] = [1e6, -1e6], [0.0, 1e9]
    uv[1] = feature_uv[0]
    low = rng.integers(-1, 3, places)
    found = descriptors(rng, places + features)
    return (
        *(uv, radius, low, low + 2, read_only(found[:places].copy())),
        *(feature_uv, octave, read_only(found[places:].copy())),
    )


def for_search_lines(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Lines through the bearings of some features, and others."""
    lines, features = 12 * n, 20 * n
    bearing = rng.normal(size=(features, 3)) + [0, 0, 4]
    bearing /= np.linalg.norm(bearing, axis=1)[:, None]
    line = np.cross(bearing[rng.integers(0, features, lines)], rng.normal(size=(lines, 3)))
    line[0] = 0.0
    J_pixel, width = rng.normal(0, 0.01, (features, 3, 2)), 1.2 ** rng.integers(0, 4, features)
    found = descriptors(rng, lines + features)
    a, b = read_only(found[:lines].copy()), read_only(found[lines:].copy())
    return line, a, bearing, J_pixel, width, b, [0.5, 3.0][B % 2]


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "windows:search": [for_search],
    "windows:search_lines": [for_search_lines],
}
