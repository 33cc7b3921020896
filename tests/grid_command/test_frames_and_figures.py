"""Pictures of maps: north is up, colours lie where they belong, walls stay when shrunk; labels."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.experiments.grid_log import frames
from vslam_ref.experiments.grid_log.mapping import Moment
from vslam_ref.grids.clusters import Clusters, Tracker
from vslam_ref.grids.lattice import Lattice
from vslam_ref.grids.log_odds import LogOddsGrid


def grid(shape: tuple[int, int]) -> LogOddsGrid:
    """Free but for a wall in the last row, which lies north."""
    L = np.full(shape, -5.0)
    L[-1] = 5.0
    return LogOddsGrid(Lattice(0.1, (-10, -10), shape), L)


def moment(shape: tuple[int, int], cells: list[tuple[int, int]]) -> Moment:
    none = np.zeros(0, np.int64)
    clusters = Clusters(np.zeros((0, 2)), np.zeros((0, 2)), none, np.array(cells), none)
    window = slice(0, shape[0]), slice(0, shape[1])
    return Moment(0, window, np.array([0.0, 0.0, 0.0]), grid(shape), grid(shape), clusters, Tracker())


def test_north_is_up_and_d_is_in_the_first_picture_only() -> None:
    shape = (40, 60)  # wide: S above, the plain grid below
    picture = frames.picture(moment(shape, [(5, 50)]))
    times = frames.MOST // (2 * shape[0])
    times = min(times, frames.MOST // shape[1])
    assert picture.shape == (2 * 40 * times + frames.GAP, 60 * times, 3)
    assert (picture[0] < 10).all(), "the wall is north, so it is on top"
    middle = picture[(40 - 1 - 5) * times + times // 2, 50 * times + times // 2]
    assert tuple(middle) == frames.VERMILION
    lower = picture[40 * times + frames.GAP :]
    assert not (lower == frames.VERMILION).all(axis=-1).any()
    assert (picture == frames.BLUE).all(axis=-1).sum() > 2 * 20 * times**2, "the robot is in both"


def test_a_tall_map_has_its_pictures_side_by_side() -> None:
    picture = frames.picture(moment((60, 20), [(1, 1)]))
    times = frames.MOST // 60
    assert picture.shape[0] == 60 * times
    assert picture.shape[1] == 2 * 20 * times + frames.GAP


def test_shrinking_keeps_thin_walls() -> None:
    image = np.full((3000, 4001, 3), 255, np.uint8)
    image[1234] = 0
    image[:, 4000] = 0
    small = frames.fitted(image, wide=True)
    assert max(small.shape[:2]) <= frames.MOST
    assert (small == 0).all(axis=-1).all(axis=1).sum() == 1
    assert (small[:, -1] == 0).all()


def test_what_lies_outside_is_not_painted() -> None:
    image = np.zeros((4, 4, 3), np.uint8)
    frames.paint(image, np.array([[-1, 0], [0, 4], [2, 3]]), (1, 2, 3))
    assert np.argwhere(image.any(axis=-1)).tolist() == [[2, 3]]


def labels(figure: object) -> list[str]:
    axes = figure.axes  # type: ignore[attr-defined]
    return [a.get_xlabel() for a in axes if a.get_title() or a.lines]


def test_figures_have_axes_with_units() -> None:
    pytest.importorskip("matplotlib")
    from vslam_ref.plot import grids

    p = np.random.default_rng(0).random((20, 30))
    extent = (0.0, 3.0, 0.0, 2.0)
    walk = np.array([[0.5, 0.5], [1.5, 1.0]])
    drawn = [
        grids.log_figure(p, p, extent, walk, np.array([0.1, 0.9]), walk, [walk], "a log"),
        grids.log_figure(p, p, extent, walk[:0], np.zeros(0), walk, [], "nothing moved"),
        grids.readings_figure(["a", "b"], np.random.default_rng(1).random((5, 2, 2))),
        grids.chair_figure(np.arange(5.0), p[:2, :5], p[2:4, :5], ("printed", "ageing"), 2.0),
        grids.cell_figure([("a", np.arange(4.0))], np.arange(4.0), 2.2),
        grids.beams_figure(np.full(2, 0.5), walk + 3, [np.array([[0, 0], [1, 1]])] * 2, ("a", "b")),
    ]
    for figure in drawn:
        assert all(label for label in labels(figure))
        figure.canvas.draw()
