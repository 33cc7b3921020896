"""Inputs for the twin of the pose graph's solution: matrices of blocks, in the order of elimination."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.estimation.posegraph.pattern import make_pattern

Rng = np.random.Generator


def _system(rng: Rng, k: int, tail: np.ndarray, head: np.ndarray, d: int) -> tuple[Any, ...]:
    """A matrix whose diagonal outweighs its rows, so that its condition is below 4, and a right-hand side."""
    pattern = make_pattern(k, tail, head, np.zeros(k, dtype=np.bool_), d)
    A = pattern.matrix(*rng.normal(0, 0.3, (2, len(tail), d, d)))
    A.data[pattern.diagonal] += 2.0 * np.abs(A).sum(axis=1) + 0.5
    A.data /= np.abs(A.data).max()
    return A.data, A.indices, A.indptr, pattern.ordering.fronts, rng.normal(size=len(A.indptr) - 1)


def for_loops(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Two chains with loops and a node alone; blocks of 3, 6, 7 or 1."""
    k, d = 12 * n, (1, 3, 6, 7)[(B + n) % 4]
    chain = np.setdiff1d(np.arange(k - 2), [k // 2])
    loops = rng.integers(0, k // 2, (2, 3 * n))
    loops = loops[:, loops[0] != loops[1]]
    return _system(rng, k, np.append(chain, loops[0]), np.append(chain + 1, loops[1]), d)


def for_wide_fronts(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Two groups of nodes that are all joined, and a few that both share: panels, stripes and products."""
    groups = np.arange(26), np.append(np.arange(26, 45), np.arange(6))
    pairs = np.array([(i, j) for group in groups for i in group for j in group if i < j])
    return _system(rng, 45, *pairs.T, 6 + B % 2)


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "fronts:solve_in_order": [for_loops, for_wide_fronts],
}
