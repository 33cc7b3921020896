"""The map: its data in the right places, and its cells readable without colour."""

from __future__ import annotations

from itertools import pairwise

import pytest

from vslam_ref.experiments.iekf import sensitivity
from vslam_ref.experiments.iekf.sentences import SENTENCES
from vslam_ref.experiments.iekf.settings import map_series
from vslam_ref.plot.sensitivity import CELLS, cell_text, spans


@pytest.fixture(scope="module")
def grid(make):
    share = {"layout": 0.31, "draw": None}
    return make(lambda i, s: share.get(s.axis, 0.92), lambda k, s: 3.0)


def test_the_series_have_one_column_per_setting_and_one_row_per_statement(grid):
    series = map_series(grid.judged)
    columns = len(grid.judged)
    assert len(series["axis"]) == len(series["value"]) == columns
    assert list(series["verdict"]) == list(series["share"]) == list(SENTENCES)
    assert all(len(row) == columns for row in series["verdict"].values())
    assert all(len(row) == columns for row in series["nees_end"].values())
    assert {"ekf/low", "ekf/high", "iekf/low", "iekf/high", "ekf-anchored/high"} <= set(series["nees_end"])
    at = series["axis"].index("layout")
    assert series["verdict"]["iekf-low-below"][at] == "not reproduced"
    assert series["share"]["iekf-low-below"][at] == 0.31
    assert series["verdict"]["iekf-low-below"][0] == "reproduced"


def test_the_figure_shows_every_cell(grid):
    figure = sensitivity.draw(grid)
    above, below = figure.axes
    texts = [t.get_text() for t in above.texts]
    rows, layouts, draws = len(SENTENCES), len(grid.axis("layout")), len(grid.axis("draw"))
    assert texts.count("✗31") == rows * layouts
    assert texts.count("–") == rows * draws
    assert texts.count("✓92") == rows * (len(grid.judged) - layouts - draws)
    assert [t.get_text() for t in above.get_yticklabels()] == list(SENTENCES)
    assert len(below.get_yticklabels()) == 6
    assert {"figure 2", "figure 3", "figure 4"} <= set(texts)


def test_verdicts_differ_in_symbol_and_in_grey():
    """Relative luminance of the fills, ITU-R BT.709: at least a fifth of the scale apart."""

    def grey(colour: str) -> float:
        rgb = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]

    values = sorted(grey(cell.fill) for cell in CELLS.values())
    assert min(b - a for a, b in pairwise(values)) > 0.15
    assert len({cell.symbol for cell in CELLS.values()}) == 3
    assert cell_text("not reproduced", 0.0) == "✗0"


def test_spans_cover_all_places():
    assert spans([]) == []
    assert spans(["x", "y", "y", "x"]) == [("x", 0, 1), ("y", 1, 2), ("x", 3, 1)]
