"""Inputs for the twins of the image features: a noisy picture, as flat bytes that are only read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.features.corners import detect
from vslam_ref.features.templates import cut
from vslam_ref.worlds.pictures import painted_wall, picture

Rng = np.random.Generator


def image(rng: Rng, n: int) -> np.ndarray:
    """60 + 20 n columns and 60 rows."""
    size = (60 + 20 * n, 60)
    return picture(painted_wall(rng, 60 + 20 * n, size), size=size, noise=4.0, rng=rng)


def read_only(a: np.ndarray) -> np.ndarray:
    a = a.copy()
    a.setflags(write=False)
    return a


def flat(rng: Rng, n: int) -> tuple[np.ndarray, int]:
    drawn = image(rng, n)
    return read_only(drawn.reshape(-1)), drawn.shape[1]


def for_halve(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return flat(rng, n)


def for_segment_test(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return *flat(rng, n), int(rng.integers(0, 30)), 9 + B % 4


def inner(rng: Rng, width: int, n: int) -> np.ndarray:
    return read_only(rng.integers(8, [width - 8, 52], (8 * n, 2)).astype(np.int32))


def for_corner_score(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    pixels, width = flat(rng, n)
    return pixels, width, inner(rng, width, n), 9 + B % 4


def for_is_peak(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Corners side by side, of few different scores, so that some neighbours are equal."""
    found = detect(image(rng, n), 8)
    return read_only(found.xy), found.row_start, found.width, rng.integers(0, 4 + B, len(found.xy))


def for_shi_tomasi(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    pixels, width = flat(rng, n)
    return pixels, width, inner(rng, width, n)


def for_warp(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Some patches leave the image."""
    pixels, width = flat(rng, n)
    uv = rng.uniform(0, [width, 60], (8 * n, 2))
    return pixels, width, uv, np.eye(2) + rng.normal(0, 0.3, (8 * n, 2, 2))


def _for_search(rng: Rng, n: int, correlate: bool) -> tuple[Any, ...]:
    drawn = image(rng, n)
    found = detect(drawn, 15)
    xy = found.xy[rng.permutation(len(found.xy))[: 8 * n]]
    patch = read_only(cut(drawn, xy).patch.reshape(-1, 64))
    uv = xy + rng.integers(-3, 4, xy.shape) * rng.choice([0.5, 1.0])
    pixels, radius = read_only(drawn.reshape(-1)), rng.uniform(0, 9, len(xy))
    return pixels, drawn.shape[1], read_only(found.xy), found.row_start, patch, uv, radius, correlate


def for_zmssd(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_search(rng, n, False)


def for_zncc(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_search(rng, n, True)


def for_refine(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Corners, so that S can be inverted, and some templates without slopes, from the border, or wrong."""
    drawn = image(rng, n)
    xy = detect(drawn, 25).xy[:: 60 // (n + 1)][: 8 * n]
    patch = cut(drawn, xy).patch.reshape(-1, 64)
    patch[: len(xy) // 4] = patch[len(xy) // 4 : 2 * (len(xy) // 4)][::-1]
    patch[:1] = 77
    return (
        read_only(drawn.reshape(-1)),
        drawn.shape[1],
        read_only(patch),
        xy + rng.uniform(-0.7, 0.7, xy.shape),
    )


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "features:halve": [for_halve],
    "features:segment_test": [for_segment_test],
    "features:corner_score": [for_corner_score],
    "features:is_peak": [for_is_peak],
    "features:shi_tomasi": [for_shi_tomasi],
    "patches:warp": [for_warp],
    "patches:search": [for_zmssd, for_zncc],
    "patches:refine": [for_refine],
}
