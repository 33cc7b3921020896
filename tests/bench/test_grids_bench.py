"""The peer of ``bench grids`` draws the same room: what is timed against each other does the same work."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation

from vslam_ref.bench import grids
from vslam_ref.grids import beam_marks


def test_bresenham_is_the_line_and_its_cells_are_near_the_beams() -> None:
    """Unit steps along the longer axis, never more than half a cell off the line."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        a, b = (tuple(v) for v in rng.integers(-30, 30, (2, 2)).tolist())
        cells = grids.bresenham(a, b)
        d = np.subtract(b, a)
        assert len(cells) == np.abs(d).max() + 1
        assert cells[0].tolist() == list(a)
        assert cells[-1].tolist() == list(b)
        if d.any():
            v = cells - np.array(a)
            off = np.abs(v[:, 0] * d[1] - v[:, 1] * d[0]) / np.abs(d).max()
            assert off.max() <= 0.5 + 1e-12


def test_peer_and_library_see_the_same_room() -> None:
    angles, ranges = grids.room()
    theirs = grids.peer((ranges * np.cos(angles)).tolist(), (ranges * np.sin(angles)).tolist())
    window = beam_marks.mark_beams((grids.CELLS, grids.CELLS), grids.scan_in_cells())
    free = theirs.T == 0.0  # theirs has x first
    ours = window == beam_marks.MISS
    # theirs moves ends by half a cell and leaves the line by half a cell: every cell of theirs is a neighbour
    # of ours, and ours, which has every cell that is cut, has more
    near = binary_dilation(window != beam_marks.UNSEEN, np.ones((3, 3)))
    assert not (free & ~near).any()
    assert 1.0 < ours.sum() / free.sum() < 1.6
