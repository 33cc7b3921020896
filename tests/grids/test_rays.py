"""Beam traversal against exact rational geometry.

The oracle clips each beam, with fractions, to every cell of its bounding box: a cell is crossed when the
part of the beam inside the half-open square has positive length.  No tolerance: sets of cells are equal or
not.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vslam_ref import _kernels
from vslam_ref.grids import beam_marks, log_odds, rays
from vslam_ref.grids.plain import apply_plain

BACKENDS = ["numpy", "numba"]


def exact_cells(start: tuple[Fraction, ...], end: tuple[Fraction, ...]) -> set[tuple[int, int]]:
    """(row, column) of all cells in which the beam has positive length, by clipping it to each."""
    found = set()
    low = [math.floor(min(a, b)) for a, b in zip(start, end, strict=True)]
    high = [math.floor(max(a, b)) for a, b in zip(start, end, strict=True)]
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            first, last = Fraction(0), Fraction(1)
            for a, b, c in ((start[0], end[0], i), (start[1], end[1], j)):
                if a == b:  # along a line: the cell that owns it, [c, c + 1)
                    if not c <= a < c + 1:
                        first = Fraction(2)
                    continue
                t = sorted([(c - a) / (b - a), (c + 1 - a) / (b - a)])
                first, last = max(first, t[0]), min(last, t[1])
            if first < last:
                found.add((j, i))
    return found


def check(start: tuple[float, float], end: tuple[float, float]) -> None:
    found = rays.crossed_cells(start, [end])
    cells = [tuple(c) for c in found.cells.tolist()]
    assert len(cells) == len(set(cells)), "a cell twice"
    exact = exact_cells(tuple(map(Fraction, start)), tuple(map(Fraction, end)))
    assert set(cells) == exact, (start, end)


EIGHTHS = st.integers(-60, 60).map(lambda n: n / 8)
FINE = st.integers(-9 * rays.QUANTA, 9 * rays.QUANTA).map(lambda n: n / rays.QUANTA)


@settings(max_examples=400, deadline=None)
@given(start=st.tuples(EIGHTHS, EIGHTHS), end=st.tuples(EIGHTHS, EIGHTHS))
def test_cells_are_those_of_exact_geometry_on_lines_and_corners(start: tuple, end: tuple) -> None:
    """Multiples of 1/8: corners, edges, axis-parallel beams and ends on lines are common here."""
    if start != end:
        check(start, end)


@settings(max_examples=200, deadline=None)
@given(start=st.tuples(FINE, FINE), end=st.tuples(FINE, FINE))
def test_cells_are_those_of_exact_geometry_anywhere(start: tuple, end: tuple) -> None:
    if start != end:
        check(start, end)


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ((0.5, 0.5), (5.5, 5.5)),  # through corners
        ((0.5, 5.5), (5.5, 0.5)),
        ((0.0, 0.0), (4.0, 4.0)),  # from corner to corner
        ((4.0, 4.0), (0.0, 0.0)),
        ((0.0, 4.0), (4.0, 0.0)),
        ((2.0, 0.5), (2.0, 7.5)),  # along a line
        ((2.0, 7.5), (2.0, 0.5)),
        ((0.5, 3.0), (-6.5, 3.0)),
        ((-0.5, -0.5), (-3.0, -2.0)),  # ends on a line
        ((0.5, 0.5), (3.0, 0.5)),
        ((3.0, 0.5), (0.5, 0.5)),
        ((1.0, 1.0), (1.0 + 1 / 4096, 1.0)),  # as short as can be
        ((0.25, 0.75), (8.25, 4.75)),  # corners now and then: slope 1/2
        ((1 / 4096, 0.0), (8.0, 1.0)),  # misses a corner by 1/8192
    ],
)
def test_corners_edges_and_ends(start: tuple[float, float], end: tuple[float, float]) -> None:
    check(start, end)
    check(end, start)


def test_a_missed_corner_at_the_largest_length() -> None:
    """The quotient n/d is the nearest to an integer that can be: the floor must not be rounded up.

    From (0, 0), slope (2^26 - 1)/2^26: at column line k the height is k - k/2^26, a little below k.  The beam
    crosses exactly one cell above the diagonal's lower neighbours: 2 per column but for the first.
    """
    n = rays.MAX_LENGTH
    found = rays.crossed_cells([0.0, 0.0], [[float(n), n - 1 / rays.QUANTA]])
    k = np.arange(n)
    expected = {(a, a) for a in k.tolist()} | {(a, a + 1) for a in k[:-1].tolist()}
    assert {tuple(c) for c in found.cells.tolist()} == expected


def test_length_of_the_beam_is_the_sum_over_its_cells() -> None:
    """An oracle of another kind: lengths of the beam in the found cells add up to its length."""
    rng = np.random.default_rng(0)
    start, ends = rng.uniform(-30, 30, 2), rng.uniform(-30, 30, (40, 2))
    start, ends = (np.rint(a * rays.QUANTA) / rays.QUANTA for a in (start, ends))
    found = rays.crossed_cells(start, ends)
    d = ends[found.beam] - start
    low = (found.cells[:, ::-1] - start) / d
    high = (found.cells[:, ::-1] + 1 - start) / d
    first = np.maximum(np.minimum(low, high).max(axis=1), 0.0)
    last = np.minimum(np.maximum(low, high).min(axis=1), 1.0)
    assert (last > first).all()
    # 60 terms of size up to 1, each known to 60 cells' coordinates times eps, over d >= 1e-4
    np.testing.assert_allclose(np.bincount(found.beam, last - first), 1.0, atol=1e-9)


def beams(rng: np.random.Generator, n: int) -> beam_marks.BeamsInCells:
    start = np.round(rng.uniform(18, 22, 2) * 2) / 2
    ends = rng.uniform(3, 37, (n, 2))
    ends[::3] = np.round(ends[::3] * 2) / 2
    return beam_marks.BeamsInCells(start, ends, rng.random(n) < 0.6)


@pytest.mark.parametrize("graze", [0, 1, 3, 50])
@pytest.mark.parametrize("seed", range(5))
def test_marks_are_the_crossed_cells_and_hits_win(
    seed: int, graze: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Grazed are the cells within ``graze`` of the last crossed one, along the beam's longer axis."""
    monkeypatch.setattr(beam_marks, "GROUP", 7 if seed % 2 else beam_marks.GROUP)  # more than one group
    start, ends, hit = beams(np.random.default_rng(seed), 150)
    window = beam_marks.mark_beams((40, 40), beam_marks.BeamsInCells(start, ends, hit), graze)
    expected = np.zeros((40, 40), np.uint8)
    for e, h in zip(ends, hit, strict=True):
        quantised = tuple(Fraction(int(np.rint(v * rays.QUANTA)), rays.QUANTA) for v in e)
        d = [quantised[a] - Fraction(start[a]) for a in range(2)]
        axis = 0 if abs(d[0]) >= abs(d[1]) else 1
        crossed = exact_cells(tuple(map(Fraction, start)), quantised)
        last = (max if d[axis] >= 0 else min)((c[1 - axis] for c in crossed), default=0)
        for cell in crossed:
            near = h and graze > 0 and abs(cell[1 - axis] - last) <= graze
            expected[cell] = max(expected[cell], beam_marks.GRAZE if near else beam_marks.MISS)
    for x, y in beam_marks.end_cells(ends[hit]).tolist():
        expected[y, x] = beam_marks.HIT
    np.testing.assert_array_equal(window, expected)


@pytest.mark.parametrize("seed", range(40))
def test_a_beam_within_its_first_column_beside_a_long_one(seed: int) -> None:
    """Beams are walked together, as many columns as the longest has."""
    rng = np.random.default_rng(seed)
    start = np.rint(rng.uniform(18, 22, 2) * rays.QUANTA) / rays.QUANTA
    ends = np.rint(np.stack([start + rng.uniform(-0.9, 0.9, 2), [33.0, 4.0]]) * rays.QUANTA) / rays.QUANTA
    window = beam_marks.mark_beams((40, 40), beam_marks.BeamsInCells(start, ends, np.zeros(2, dtype=bool)))
    crossed = [exact_cells(tuple(map(Fraction, start)), tuple(map(Fraction, e))) for e in ends]
    assert {tuple(c) for c in np.argwhere(window).tolist()} == crossed[0] | crossed[1]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("seed", range(5))
def test_both_backends_visit_the_exact_cells(seed: int, backend: str) -> None:
    """A map of zeros, with the marks themselves as evidence, is the picture of the scan."""
    if backend == "numba":
        pytest.importorskip("numba", reason="the twin needs numba")
    seen = beams(np.random.default_rng(seed), 70)
    window = beam_marks.mark_beams((40, 40), seen)
    picture = np.zeros(1600)
    with _kernels.use_backend(backend):
        apply_plain(picture, 40, seen, np.array([beam_marks.MISS, beam_marks.HIT], float), 9.0)
    np.testing.assert_array_equal(picture.reshape(40, 40), window)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300, rays.MAX_LENGTH + 30.0])
def test_beams_that_cannot_be_walked_are_refused(backend: str, bad: float) -> None:
    if backend == "numba":
        pytest.importorskip("numba", reason="the twin needs numba")
    picture = np.zeros(100)
    seen = beam_marks.BeamsInCells(np.full(2, 5.0), np.array([[bad, 5.0]]), np.ones(1, bool))
    with _kernels.use_backend(backend), pytest.raises(ValueError, match="beam is not finite or spans"):
        apply_plain(picture, 10, seen, np.array([1.0, 2.0]), 9.0)
    assert not picture.any()


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("end", [(9.5, 5.0), (5.0, 0.5), (-3.0, 5.0), (5.0, 4000.0)])
def test_beams_that_leave_the_map_are_refused(backend: str, end: tuple[float, float]) -> None:
    if backend == "numba":
        pytest.importorskip("numba", reason="the twin needs numba")
    picture = np.zeros(100)
    seen = beam_marks.BeamsInCells(np.full(2, 5.0), np.array([end]), np.ones(1, bool))
    with _kernels.use_backend(backend), pytest.raises(ValueError, match="a beam leaves the map"):
        apply_plain(picture, 10, seen, np.array([1.0, 2.0]), 9.0)
    assert not picture.any()


def test_kernels_and_their_functions_have_the_same_constants() -> None:
    kernels = pytest.importorskip("vslam_ref._kernels.grids", reason="the twins need numba")
    for name in ("QUANTA", "MAX_LENGTH", "TOO_LONG"):
        assert getattr(kernels, name) == getattr(rays, name)
    for name in ("UNSEEN", "GRAZE", "MISS", "HIT", "OUTSIDE"):
        assert getattr(kernels, name) == getattr(beam_marks, name)
    for name in ("FREE", "UNKNOWN", "OCCUPIED", "DECIDED_LOG_ODDS"):
        assert getattr(kernels, name) == getattr(log_odds, name)


def test_no_beam_crosses_nothing() -> None:
    found = rays.crossed_cells([0.5, 0.5], np.zeros((0, 2)))
    assert found.cells.shape == (0, 2)
