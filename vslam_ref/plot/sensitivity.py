"""A map of verdicts: statements by settings, readable in colour, in grey and by symbol."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from vslam_ref.plot import style


class Cell(NamedTuple):
    """How a verdict is drawn: symbol, fill, colour of the text; dark, light and white in grey."""

    symbol: str
    fill: str
    text: str


CELLS: dict[str, Cell] = {
    "reproduced": Cell("✓", style.BLUE, "#FFFFFF"),
    "not reproduced": Cell("✗", "#F7C873", "#000000"),
    "not testable": Cell("–", "#FFFFFF", style.GREY),
}


class VerdictMap(NamedTuple):
    """What is drawn: groups and labels of rows and columns; verdict and share per row and column."""

    rows: Sequence[tuple[str, str]]
    columns: Sequence[tuple[str, str]]
    verdict: Sequence[Sequence[str]]
    share: Sequence[Sequence[float | None]]


def cell_text(verdict: str, share: float | None) -> str:
    """Symbol, and the share in hundredths.

    Examples
    --------
    >>> cell_text("reproduced", 0.984), cell_text("not testable", None)
    ('✓98', '–')
    """
    return CELLS[verdict].symbol + ("" if share is None else f"{100 * share:.0f}")


def spans(groups: Sequence[str]) -> list[tuple[str, int, int]]:
    """Runs of equal neighbours: name, first place, number.

    Examples
    --------
    >>> spans(["a", "a", "b"])
    [('a', 0, 2), ('b', 2, 1)]
    """
    found, first = [], 0
    for name, members in groupby(groups):
        count = len(list(members))
        found.append((name, first, count))
        first += count
    return found


def map_figure(
    data: VerdictMap, ends: Mapping[str, Sequence[float]], *, runs: int, population: int
) -> Figure:
    """Draw the map, and under it the mean NEES at the end of the runs.

    Parameters
    ----------
    data : VerdictMap
        The first column is the baseline.
    ends : mapping of str to sequence
        "filter/p0" -> mean NEES over the last 10 s, one per column.
    runs, population : int
        Runs of a study; runs behind each column.
    """
    R, C, E = len(data.rows), len(data.columns), len(ends)
    with style.house_style():
        figure = Figure(figsize=(style.WIDTH, 1.75 + 0.213 * (R + E)), dpi=style.DPI, layout="constrained")
        FigureCanvasAgg(figure)
        axes, below = figure.subplots(2, 1, height_ratios=[R, E], sharex=True)
        for r in range(R):
            for c in range(C):
                verdict = data.verdict[r][c]
                look = CELLS[verdict]
                _cell(axes, r, c, look.fill, cell_text(verdict, data.share[r][c]), look.text)
        _finish(axes, [label for _, label in data.rows], C)
        _row_heads(axes, [group for group, _ in data.rows], C)
        _column_heads(axes, data.columns)
        for r, values in enumerate(ends.values()):
            for c in range(min(C, len(values))):
                _cell(below, r, c, "#FFFFFF", f"{values[c]:.3g}", style.BLACK)
        _finish(below, [f"NEES {key}" for key in ends], C)
        for panel in (axes, below):
            _divide(panel, [group for group, _ in data.columns])
        below.set_xlabel(
            f"Cells: verdict, and the share (in hundredths) of {runs}-run studies, out of {population} runs, "
            "in which the statement holds.\nOutlined: the baseline, figures 2-4. Below: mean NEES "
            "over 150-160 s; 3 is consistent.",
            fontsize=8,
        )
        handles = [Patch(fc=k.fill, ec=style.GREY, label=f"{k.symbol} {name}") for name, k in CELLS.items()]
        figure.legend(handles=handles, loc="outside upper left", ncols=3, frameon=False, fontsize=8)
    return figure


def _cell(axes: Axes, r: int, c: int, fill: str, text: str, colour: str) -> None:
    axes.add_patch(Rectangle((c - 0.5, r - 0.5), 1, 1, fc=fill, ec="#FFFFFF", lw=0.6))
    axes.text(c, r, text, ha="center", va="center", fontsize=6.3, color=colour)


def _divide(axes: Axes, groups: Sequence[str]) -> None:
    """Lines between the axes of the grid, and a frame round the baseline, the first column."""
    for _, first, _ in spans(groups):
        axes.axvline(first - 0.5, color=style.BLACK, lw=1.2)
    rows = len(axes.get_yticks())
    axes.add_patch(Rectangle((-0.5, -0.5), 1, rows, fill=False, ec=style.VERMILION, lw=2.2, zorder=5))


def _finish(axes: Axes, labels: Sequence[str], columns: int) -> None:
    axes.set_xlim(-0.5, columns - 0.5)
    axes.set_ylim(len(labels) - 0.5, -0.5)
    axes.set_yticks(range(len(labels)), list(labels), fontsize=7)
    axes.tick_params(length=0, labelbottom=False)
    axes.grid(False)
    for side in axes.spines.values():
        side.set_visible(False)


def _row_heads(axes: Axes, groups: Sequence[str], columns: int) -> None:
    """Lines between the groups of rows, their names at the right edge."""
    for name, first, count in spans(groups):
        axes.axhline(first - 0.5, color=style.BLACK, lw=1.2)
        middle = first + count / 2 - 0.5
        axes.text(columns - 0.35, middle, name, rotation=-90, va="center", ha="left", fontsize=8)


def _column_heads(axes: Axes, columns: Sequence[tuple[str, str]]) -> None:
    """Values above the columns, the axis's name slanted above its first value."""
    for c, (_, label) in enumerate(columns):
        axes.text(c, -0.65, label, ha="center", va="bottom", fontsize=6.8)
    for name, first, _ in spans([group for group, _ in columns]):
        axes.text(
            first - 0.3,
            -1.75,
            name,
            ha="left",
            va="bottom",
            fontsize=7.5,
            rotation=30,
            rotation_mode="anchor",
        )
