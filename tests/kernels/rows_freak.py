"""Inputs for the twins of FREAK."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.features.freak.pair_table import PAIRS
from vslam_ref.features.freak.pattern import CENTRE, HALF
from vslam_ref.features.freak.sampling import sums

from .rows_features import Rng, image, read_only


def for_sums(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return (read_only(image(rng, n)),)


def for_field_means(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Scales with boxes below and above one pixel; key points anywhere between pixels."""
    shape = (90, 95 + n)
    table = sums(rng.integers(0, 256, shape, dtype=np.uint8))
    scale = rng.uniform(0.1, 1.8, 4 * n)
    uv = rng.uniform(41, [shape[1] - 42, shape[0] - 42], (4 * n, 2))
    angle = rng.uniform(-np.pi, np.pi, 4 * n)
    return read_only(table), uv, scale, np.stack([np.cos(angle), np.sin(angle)], 1), CENTRE, HALF


def for_bits(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Whole numbers: many ties."""
    return rng.integers(0, 6, (3 * n, 43)).astype(float), PAIRS if B == 1 else PAIRS[: 8 * B]


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "freak:sums": [for_sums],
    "freak:field_means": [for_field_means],
    "freak:bits": [for_bits],
}
