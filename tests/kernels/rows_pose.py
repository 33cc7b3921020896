"""Inputs for the twins of poses and points: pinholes, some matches wrong, one point behind the camera."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole

Rng = np.random.Generator
CAMERA = Pinhole(500.0, 490.0, 320.0, 240.0)


def for_steps(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Five points for each landmark, and eight more; noise, a fifth wrong, one behind the camera."""
    count = 8 + 5 * n
    X = rng.uniform([-2, -2, 3], [2, 2, 8], (count, 3))
    level = rng.integers(0, 4, count)
    uv = CAMERA.project(X).uv + 2.0 ** level[:, None] * rng.normal(0, 0.5, (count, 2))
    wrong = rng.random(count) < 0.2
    uv[wrong] += rng.uniform(-60, 60, (int(wrong.sum()), 2))
    X[0, 2] = -4.0
    T = se3.exp(rng.normal(0, 0.01, 6))
    return CAMERA.params, T, X, uv, 0.5**level, 5.122986089952371, 10, 0.4


def for_too_few(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Three points: no pose is computed."""
    K, T, X, uv, root, c, steps, least = for_steps(rng, B, n)
    return K, T, X[1:4], uv[1:4], root[1:4], c, steps, least


def for_points(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Points seen by two to four pinholes, some not by all; starts off by a tenth of the depth."""
    count, V = 2 * n, 2 + B % 3
    K = CAMERA.params + rng.normal(0, 5, (V, 4))
    T = se3.exp(rng.normal(0, 0.1, (V, 6)) - np.arange(V)[:, None] * [0.5, 0, 0, 0, 0, 0])
    X = rng.uniform([-2, -2, 3], [2, 2, 8], (count, 3))
    uv = np.stack([Pinhole(*k).pixel_from_world(t, X).uv for k, t in zip(K, T, strict=True)], 1)
    root = rng.choice([1.0, 0.5], (count, V))
    root[0, 2:] = 0.0
    return K, T, uv + rng.normal(0, 0.5, uv.shape), root, X * rng.uniform(0.9, 1.1, (count, 1)), 20


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "points:pinhole_descent": [for_points],
    "pose:pinhole_steps": [for_steps, for_too_few],
}
