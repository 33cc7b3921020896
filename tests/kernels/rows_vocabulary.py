"""Inputs for the twin of the vocabulary: few bits in a random tree: many children are equally near."""

from __future__ import annotations

from typing import Any

import numpy as np

from .rows_features import Rng, read_only

FEATURES = 300


def for_descend(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Three levels of B + 1 to B + 3 children, some of which are words; few bytes, so that some are equal."""
    children, ahead = [B + 1], B + 1
    for low in (0, 0, -1):
        below = (
            rng.integers(1, B + 4, ahead) * (rng.random(ahead) < 0.8) if low == 0 else np.zeros(ahead, int)
        )
        children += below.tolist()
        ahead = int(below.sum())
    count = np.array(children)
    first = 1 + np.concatenate([[0], np.cumsum(count)[:-1]])
    features, nodes = (
        rng.choice(np.array([0, 1, 2**40, 2**64 - 1], np.uint64), (rows, 4))
        for rows in (FEATURES, len(count))
    )
    return read_only(features), read_only(nodes), first, count


ROWS = {"vocabulary:descend": [for_descend]}
