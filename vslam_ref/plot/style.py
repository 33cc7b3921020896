"""One look for all figures.

Colours are those of Okabe and Ito, distinguishable with every kind of colour vision; line styles differ too,
so that a figure survives a black-and-white printer.  Nothing here touches matplotlib's global state.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#6B6B6B"

DPI = 120
WIDTH = 10.0
"""Inches; 1200 pixels at :data:`DPI`."""


class LineStyle(NamedTuple):
    """How a filter is drawn: its name in a legend, colour and line style."""

    name: str
    colour: str
    line: str


FILTERS: dict[str, LineStyle] = {
    "ekf": LineStyle("EKF", VERMILION, "-"),
    "iekf": LineStyle("IEKF (Carleman lift)", BLUE, "-"),
    "ekf-anchored": LineStyle("anchored EKF", GREEN, "--"),
    "ekf-ideal": LineStyle("ideal EKF (Jacobians at truth)", PURPLE, "-."),
    "control": LineStyle("consistent control", GREY, ":"),
}

P0_TITLES: dict[str, str] = {
    "low": r"low initial uncertainty, $P_0$ = diag(1, 1, 0.001)",
    "high": r"high initial uncertainty, $P_0$ = diag(1, 1, 0.03)",
}

_RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 11.0,
    "axes.titlesize": 11.0,
    "axes.labelsize": 11.0,
    "legend.fontsize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "svg.fonttype": "path",
}


def look(name: str) -> LineStyle:
    """Return how a filter is drawn; an unknown one in black under its own name."""
    return FILTERS.get(name, LineStyle(name, BLACK, "-"))


@contextmanager
def house_style() -> Iterator[None]:
    """Create figures in the house's look inside a block, and leave matplotlib as it was."""
    with matplotlib.rc_context(_RC):
        yield


def new_figure(height: float, columns: int = 1, *, sharey: bool = False) -> tuple[Figure, list[Axes]]:
    """Make a figure of full width with one row of panels, bound to no window.

    Parameters
    ----------
    height : float
        Inches.
    columns : int
        Panels beside each other.
    sharey : bool
        Whether the panels have one scale.

    Returns
    -------
    (Figure, list of Axes)
    """
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, columns, squeeze=False, sharey=sharey)
    return figure, list(axes[0])


def legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """Put the names of what is drawn in a panel under the whole figure."""
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=columns, frameon=False)
