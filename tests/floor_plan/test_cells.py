"""Cells under segments and discs, against independent counts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vslam_ref.worlds.floor_plan import Cells, cells_on_segments, disc_cells, segment_cells

GRID = Cells((-1.0, -2.0), 0.25, (24, 20))


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_a_segment_covers_the_cells_whose_square_it_clips(seed: int) -> None:
    """Liang and Barsky's clipping by each square: covered if a part of positive length is inside."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-2, 5, (2, 2))
    found = segment_cells(GRID, np.concatenate([a, b])[None])
    expected = np.zeros(GRID.shape, dtype=bool)
    for row, column in np.ndindex(GRID.shape):
        low = np.array(GRID.origin_xy) + GRID.resolution * np.array([column, row])
        enter, leave = 0.0, 1.0
        for k in range(2):
            t = np.sort((low[k] + np.array([0.0, GRID.resolution]) - a[k]) / (b[k] - a[k]))
            enter, leave = max(enter, t[0]), min(leave, t[1])
        expected[row, column] = leave - enter > 1e-9
    np.testing.assert_array_equal(found, expected)


def test_cells_come_once_and_in_order() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-0.9, 3.9, (2, 50, 2))
    met = cells_on_segments(GRID, a, b)
    for i in range(50):
        mine = met.segment == i
        path = np.stack([met.row[mine], met.column[mine]], 1)
        assert len(np.unique(path, axis=0)) == len(path)
        assert (np.abs(np.diff(path, axis=0)).sum(axis=1) == 1).all(), "each cell shares a side with the next"


@pytest.mark.parametrize("way", [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1)])
def test_straight_and_diagonal_ways(way: tuple[int, int]) -> None:
    """From a cell's middle by four cells: five cells; on the diagonal corners count for nothing."""
    start = np.array([1.125, 1.125])
    met = cells_on_segments(GRID, start[None], start[None] + 4 * 0.25 * np.array(way))
    assert len(met.row) == 5


@given(st.integers(0, 2**32 - 1))
def test_a_disc_covers_the_cells_that_hold_one_of_its_points(seed: int) -> None:
    """Samples of the disc never lie outside of the cover; each covered cell has its nearest point inside."""
    rng = np.random.default_rng(seed)
    x, y, r = rng.uniform(0, 3), rng.uniform(0, 3), rng.uniform(0.05, 0.8)
    cover = disc_cells(GRID, [[x, y, r]])
    angle, radius = rng.uniform(0, 2 * np.pi, 400), r * np.sqrt(rng.uniform(0, 1, 400))
    column = np.floor((x + radius * np.cos(angle) + 1.0) / 0.25).astype(int)
    row = np.floor((y + radius * np.sin(angle) + 2.0) / 0.25).astype(int)
    inside = (row >= 0) & (row < 24) & (column >= 0) & (column < 20)
    assert cover[row[inside], column[inside]].all()
    for i, j in zip(*np.nonzero(cover), strict=True):
        low = np.array([-1.0 + 0.25 * j, -2.0 + 0.25 * i])
        nearest = np.clip([x, y], low, low + 0.25)
        assert np.hypot(*(nearest - [x, y])) < r


@pytest.mark.parametrize(
    ("cells", "start"),
    [
        (Cells((0.0, 0.0), 0.0, (3, 3)), [[0.0, 0.0]]),
        (Cells((0.0, np.nan), 0.1, (3, 3)), [[0.0, 0.0]]),
        (Cells((0.0, 0.0), 0.1, (0, 3)), [[0.0, 0.0]]),
        (GRID, [[np.inf, 0.0]]),
    ],
)
def test_rasters_and_segments_that_mean_nothing_are_refused(cells: Cells, start: list[list[float]]) -> None:
    with pytest.raises(ValueError, match="need"):
        cells_on_segments(cells, start, [[1.0, 1.0]])
