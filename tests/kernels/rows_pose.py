"""Inputs for the twin of pose tracking: points before a pinhole, some matched wrongly, one behind it."""

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


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "pose:pinhole_steps": [for_steps, for_too_few]
}
