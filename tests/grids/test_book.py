"""The fast maps are those of the book, and the book's cells are those of exact fractions.

The book shares no code with the maps.  Both add the same 20 numbers of size up to 7 in the same order; angles
and ends are rounded differently, by 1e-15, which moves an end to another 1/4096 of a cell in one of 1e11
cases.
"""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vslam_ref import _kernels
from vslam_ref.grids import AS_PRINTED, Scan, StaticDynamicMap, book
from vslam_ref.grids.log_odds import OCCUPIED

from .test_rays import exact_cells

MOST = 1.7
"""Metres from which nothing comes back: such beams are cut there."""
TOLERANCE = 20 * 7 * float(np.finfo(float).eps)
READINGS = [(memory, where) for memory in ("text", "formula") for where in ("free", "unknown")]


def random_scans(seed: int, n: int = 20) -> list[tuple[np.ndarray, Scan]]:
    """Poses and scans: a round wall, something that comes and goes in front of it, and a door."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(n):
        pose = rng.uniform([-0.2, -0.2, -np.pi], [0.2, 0.2, np.pi])
        angles = np.linspace(-2.0, 2.0, 25)
        ranges = 1.5 + 0.1 * np.sin(3 * (angles + pose[2])) + rng.normal(0, 0.02, 25)
        ranges[3:6] = 0.8 if k % 5 > 2 else 9.0
        out.append((pose, Scan(angles, ranges, MOST, 0.1 * k)))
    return out


def of_the_book(scans: list[tuple[np.ndarray, Scan]], memory: str, where: str) -> book.Book:
    maps = book.Book(memory, where)
    for pose, scan in scans:
        maps.scan(
            tuple(pose), [(a, min(r, MOST), r < MOST) for a, r in zip(scan.angles, scan.ranges, strict=True)]
        )
    return maps


def difference(maps: book.Book, scans: list[tuple[np.ndarray, Scan]], memory: str, where: str) -> float:
    """Largest difference from the fast map; A's formula remembers D without end."""
    setting = {"d_memory": memory, "d_high_where": where, "d_lifetime": 1e9, "no_return": "free"}
    fast = StaticDynamicMap(dataclasses.replace(AS_PRINTED, **setting))
    for pose, scan in scans:
        fast.update(pose, scan)
    off = 0.0
    for found, expected in ((fast.static(), maps.L_S), (fast.dynamic(), maps.L_D)):
        full = np.zeros(fast.lattice.shape)
        for (x, y), value in expected.items():
            full[y - fast.lattice.corner[1], x - fast.lattice.corner[0]] = value
        off = max(off, float(np.abs(found.log_odds - full).max()))
    assert (fast.static().states == OCCUPIED).any()
    return off


@pytest.mark.parametrize("backend", ["numpy", "numba"])
@pytest.mark.parametrize(("memory", "where"), READINGS)
def test_the_fast_maps_are_the_books(memory: str, where: str, backend: str) -> None:
    if backend == "numba":
        pytest.importorskip("numba", reason="the twins need numba")
    with _kernels.use_backend(backend):
        for seed in range(5):
            scans = random_scans(seed)
            assert difference(of_the_book(scans, memory, where), scans, memory, where) <= TOLERANCE


@pytest.mark.parametrize(("memory", "where"), READINGS)
def test_a_flipped_sign_or_another_reading_shows(
    memory: str, where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The comparison has teeth: every other reading differs, and so does a sign of the log-odds."""
    scans = random_scans(7)
    for other in READINGS:
        if other != (memory, where):
            assert difference(of_the_book(scans, *other), scans, memory, where) > 1.0
    right = book.L
    monkeypatch.setattr(book, "L", lambda p: right(p) if p > 0.9 else -right(p))  # bounds stay as they are
    assert difference(of_the_book(scans, memory, where), scans, memory, where) > 1.0


coordinate = st.integers(-3 * 8, 3 * 8).map(lambda n: n / 8) | st.floats(-3, 3)


@given(st.tuples(coordinate, coordinate), st.tuples(coordinate, coordinate))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_the_books_beams_cross_the_exact_cells(start: tuple[float, float], end: tuple[float, float]) -> None:
    """Against a beam cut by all lines of the lattice, in fractions; each cell once."""
    found = book.cells_of_beam(start, end)
    quantised = [tuple(Fraction(round(v * book.Q), book.Q) for v in point) for point in (start, end)]
    assert len(set(found)) == len(found)
    assert {(y, x) for x, y in found} == exact_cells(*quantised)
