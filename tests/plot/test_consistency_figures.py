"""The figures show the numbers they are given; pixels are not tested."""

import sys

import matplotlib
import numpy as np
import pytest

from vslam_ref.metrics import consistency
from vslam_ref.plot import style
from vslam_ref.plot.consistency import MeanCurves, error_figure, nees_figure

TIME = np.linspace(0.0, 160.0, 161)
RUNS, POPULATION = 50, 200


@pytest.fixture(scope="module")
def runs():
    rng = np.random.default_rng(0)
    growth = {"ekf/low": 1.3, "ekf/high": 8.0, "ekf-anchored/low": 1.0, "ekf-anchored/high": 1.0}
    return {key: np.linspace(1, g, 161) * rng.chisquare(3, (POPULATION, 161)) for key, g in growth.items()}


@pytest.fixture(scope="module")
def curves(runs):
    return {key: MeanCurves.from_runs(x, RUNS, np.random.default_rng(1)) for key, x in runs.items()}


def draw(function, curves, filters=("ekf", "ekf-anchored"), **more):
    return function(TIME, curves, filters, runs=RUNS, population=POPULATION, lap_seconds=80.0, **more)


def drawn(axes, width):
    """Data of the curves with this line width."""
    return [
        line.get_ydata() for line in axes.lines if len(line.get_ydata()) == 161 and line.get_lw() == width
    ]


def test_mean_curves_are_those_of_the_runs(runs, curves):
    for key, x in runs.items():
        assert curves[key].own == pytest.approx(x[:RUNS].mean(axis=0), rel=1e-14)
        assert curves[key].population == pytest.approx(x.mean(axis=0), rel=1e-14)
        inside = (curves[key].low < curves[key].population) & (curves[key].population < curves[key].high)
        assert np.all(inside)


@pytest.mark.parametrize("function", [nees_figure, error_figure])
def test_bold_is_the_study_and_thin_the_population(function, curves):
    figure = draw(function, curves)
    for axes, p0 in zip(figure.axes, ("low", "high"), strict=True):
        assert p0 in axes.get_title()
        for width, name in ((2.0, "own"), (1.0, "population")):
            expected = [getattr(curves[f"{f}/{p0}"], name) for f in ("ekf-anchored", "ekf")]
            assert np.array_equal(drawn(axes, width), expected)


def test_the_chi_squared_lines_are_there_with_their_values(curves):
    figure = draw(nees_figure, curves)
    line, band = consistency.mean_line(RUNS), consistency.mean_band(RUNS)
    for axes in figure.axes:
        levels = {
            float(v.get_ydata()[0]) for v in axes.lines if len(v.get_ydata()) == 2 and v.get_xdata()[1] == 1
        }
        assert {line, band.lower, band.upper} <= levels
    text = " ".join(t.get_text() for t in figure.legends[0].get_texts())
    for value in ("3.592", "2.360", "3.716", "EKF", "anchored EKF", "50 runs", "200 runs"):
        assert value in text


def test_axes_have_names_and_units(curves):
    nees, error = draw(nees_figure, curves), draw(error_figure, curves)
    assert "no unit" in nees.axes[0].get_ylabel()
    assert "[m]" in error.axes[0].get_ylabel()
    assert all(axes.get_xlabel() == "time [s]" for axes in (*nees.axes, *error.axes))
    assert [axes.get_yscale() for axes in nees.axes] == ["linear", "log"], (
        "only a filter that runs away needs it"
    )


def test_missing_series_are_left_out(curves):
    some = {key: c for key, c in curves.items() if key != "ekf-anchored/high"}
    figure = draw(nees_figure, some)
    assert [len(drawn(axes, 2.0)) for axes in figure.axes] == [2, 1]
    assert draw(nees_figure, {}) is not None


def test_only_the_filters_the_figure_is_about_are_shaded(curves):
    assert [len(a.collections) for a in draw(nees_figure, curves).axes] == [1, 1]
    assert [len(a.collections) for a in draw(nees_figure, curves, shaded=2).axes] == [2, 2]


def test_a_figure_is_1200_pixels_wide_and_leaves_matplotlib_alone(curves, tmp_path):
    before = dict(matplotlib.rcParams)
    figure = draw(nees_figure, curves, title="A title")
    figure.savefig(tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    assert figure.get_figwidth() * figure.dpi == 1200
    assert dict(matplotlib.rcParams) == before
    pyplot = sys.modules.get("matplotlib.pyplot")
    assert pyplot is None or not pyplot.get_fignums()


def test_every_filter_has_its_own_colour_and_an_unknown_one_its_name():
    assert len({look.colour for look in style.FILTERS.values()}) == len(style.FILTERS)
    assert style.look("new filter").name == "new filter"
