"""Inputs for the twins of ORB and of binary descriptors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.features.orb.pair_table import PAIRS
from vslam_ref.features.orb.scales import _between

from .rows_features import Rng, image, read_only


def for_resampled(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Scales between 1 and 2, and one so small that the last pixels lie between the same two."""
    drawn, scale = read_only(image(rng, n)), rng.uniform(1.01, 2.0)
    y, wy = _between(int(drawn.shape[0] / scale), drawn.shape[0], scale)
    return drawn, y, wy, *_between(int(drawn.shape[1] / scale), drawn.shape[1], scale)


def for_smooth(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """All grey levels; for one row of cases, the smallest picture there may be."""
    shape = (4, 4 + n) if B == 1 else (5 + B, 20 + n)
    return (read_only(rng.choice(np.array([0, 1, 128, 254, 255], np.uint8), shape)),)


def _patches(rng: Rng, n: int) -> tuple[np.ndarray, int, np.ndarray]:
    drawn = rng.integers(0, 256, (60, 60 + 20 * n), dtype=np.uint8)
    xy = rng.integers(19, [drawn.shape[1] - 19, 41], (8 * n, 2)).astype(np.int32)
    return read_only(drawn.reshape(-1)), drawn.shape[1], read_only(xy)


def for_moments(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _patches(rng, n)


def for_describe(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    flat, width, xy = _patches(rng, n)
    angle = rng.uniform(-np.pi, np.pi, len(xy))
    return flat, width, xy, np.stack([np.cos(angle), np.sin(angle)], 1), PAIRS


def for_distances(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """32 bytes, and other numbers of them; one set may be empty."""
    size = 32 if B == 1 else 1 + int(rng.integers(0, 40))
    a, b = (rng.integers(0, 256, (k, size), dtype=np.uint8) for k in (3 * n, 5 * (n - 1)))
    return read_only(a), read_only(b)


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "orb:resampled": [for_resampled],
    "orb:smooth": [for_smooth],
    "orb:moments": [for_moments],
    "orb:describe": [for_describe],
    "hamming:distances": [for_distances],
}
