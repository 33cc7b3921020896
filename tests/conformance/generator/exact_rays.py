"""Cells of a grid that a segment crosses, by exact fractions."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from math import floor
from typing import Any

import numpy as np

from generator.building import Topic, tolerance
from vslam_ref.arrays import Array

Cell = tuple[int, int]
Ray = tuple[Array, Array]
GRAIN = 64
"""Ends of rays are multiples of 1/64 of a cell: exact in single precision, too."""


def rays(topic: Topic, rng: np.random.Generator) -> None:
    """Groups of rays."""
    exact = tolerance(0.0, "whole numbers")
    regimes: dict[str, tuple[int, Callable[[], Ray]]] = {
        "": (20, lambda: (_point(rng, 12), _point(rng, 12))),
        "steep": (12, lambda: _steep(rng)),
        "long": (
            6,
            lambda: (_point(rng, 2), _point(rng, 2) + rng.integers(25, 40, 2) * rng.choice([-1, 1], 2)),
        ),
        "along_axis": (12, lambda: _along(rng, on_edge=False)),
        "along_edge": (12, lambda: _along(rng, on_edge=True)),
        "corners": (12, lambda: _diagonal(rng)),
        "in_one_cell": (5, lambda: _inside(rng)),
        "ends_on_edge": (12, lambda: (_point(rng, 6), rng.integers(-6, 7, 2).astype(float))),
    }
    for flag, (count, draw) in regimes.items():
        cases = [_ray(*draw()) for _ in range(count)]
        flags = (flag,) if flag else ()
        oracle = "crossings as fractions, without rounding"
        topic.group("grid.ray_cells", "eq-a4-2", oracle, exact, cases, flags=flags)
    still = [np.array(p) for p in ([0.25, 0.5], [-3.5, 2.75], [1.0, -2.0])]
    cases = [
        {
            "inputs": {"start": p, "end": p},
            "expected": {"cells": [np.floor(p).astype(int).tolist()]},
            "accept": [{"cells": []}],
        }
        for p in still
    ]
    topic.group("grid.ray_cells", "eq-a4-2", "the cell that holds it", exact, cases, flags=("no_length",))


def _point(rng: np.random.Generator, reach: int) -> Array:
    return np.asarray(rng.integers(-reach * GRAIN, reach * GRAIN, 2) / GRAIN)


def _steep(rng: np.random.Generator) -> Ray:
    a = _point(rng, 4)
    return a, a + np.array([rng.integers(-GRAIN, GRAIN) / GRAIN, rng.choice([-1, 1]) * rng.integers(5, 12)])


def _along(rng: np.random.Generator, *, on_edge: bool) -> Ray:
    a = _point(rng, 5)
    b = a.copy()
    axis = int(rng.integers(2))
    if on_edge:
        a[1 - axis] = b[1 - axis] = np.floor(a[1 - axis])
    elif a[1 - axis] == np.floor(a[1 - axis]):
        a[1 - axis] = b[1 - axis] = a[1 - axis] + 0.25
    b[axis] += rng.choice([-1, 1]) * rng.integers(2 * GRAIN, 8 * GRAIN) / GRAIN
    return a, b


def _diagonal(rng: np.random.Generator) -> Ray:
    """Through corners: the start lies on a line through grid points, of slope 1, 2 or 1/2."""
    corner, step = rng.integers(-4, 5, 2), np.array([(1, 1), (1, 2), (2, 1)][int(rng.integers(3))])
    step = step * rng.choice([-1, 1], 2)
    a = corner - step * float(rng.integers(1, 4)) / 4
    return a, a + step * float(rng.integers(2, 5))


def _inside(rng: np.random.Generator) -> Ray:
    cell = rng.integers(-4, 5, 2)
    ends = rng.integers(1, GRAIN, (2, 2)) / GRAIN
    return cell + ends[0], cell + ends[1]


def cells_of(start: Array, end: Array) -> list[Cell]:
    """Cells in which a part of positive length lies: cut the segment at all lines, look between the cuts."""
    a = [Fraction(v) for v in start.tolist()]
    step = [Fraction(v) - w for v, w in zip(end.tolist(), a, strict=True)]
    cuts = {Fraction(0), Fraction(1)}
    for origin, length in zip(a, step, strict=True):
        if length:
            low, high = sorted((origin, origin + length))
            cuts |= {(line - origin) / length for line in range(floor(low), floor(high) + 2)}
    inner = sorted(t for t in cuts if 0 <= t <= 1)
    middles = [(t + u) / 2 for t, u in pairwise(inner)]
    found = [(floor(a[0] + m * step[0]), floor(a[1] + m * step[1])) for m in middles]
    return [cell for k, cell in enumerate(found) if k == 0 or cell != found[k - 1]]


def bresenham(start: Array, end: Array) -> list[Cell]:
    """One cell for each column, or row where the ray is steep."""
    a, b = np.floor(start).astype(int), np.floor(end).astype(int)
    n = int(np.abs(b - a).max())
    return [tuple(int(v) for v in np.floor(a + (b - a) * k / max(n, 1) + 0.5)) for k in range(n + 1)]  # type: ignore[misc]


def touched(cells: list[Cell]) -> list[Cell]:
    """With the two neighbours of every corner that is passed."""
    out = cells[:1]
    for (i, j), (k, m) in pairwise(cells):
        if i != k and j != m:
            out += [(k, j), (i, m)]
        out.append((k, m))
    return out


def _ray(start: Array, end: Array) -> dict[str, Any]:
    right = cells_of(start, end)
    wrong = {
        "bresenham": bresenham(start, end),
        "columns-for-rows": [(j, i) for i, j in right],
        "end-cell-missing": right[:-1],
        "corners-count": touched(right),
        "backwards": right[::-1],
    }
    mistakes: dict[str, Any] = {}
    for name, cells in wrong.items():
        answer = {"cells": [list(cell) for cell in cells]}
        if cells != right and cells and answer not in mistakes.values():
            mistakes[name] = answer
    case: dict[str, Any] = {
        "inputs": {"start": start, "end": end},
        "expected": {"cells": [list(c) for c in right]},
    }
    return {**case, "mistakes": mistakes} if mistakes else case
