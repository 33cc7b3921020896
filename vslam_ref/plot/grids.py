"""Maps drawn: static, plain, and where and when something moved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style

Extent = tuple[float, float, float, float]


def show_map(axes: Axes, probability: Array, extent: Extent) -> None:
    """Draw a map (rows, columns), black occupied, into a panel in metres."""
    axes.imshow(1.0 - probability, cmap="gray", vmin=0, vmax=1, origin="lower", extent=extent, resample=False)
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.grid(False)


def log_figure(
    static: Array,
    plain: Array,
    extent: Extent,
    moved_xy: Array,
    moved_minutes: Array,
    path_xy: Array,
    walks: Sequence[Array],
    title: str,
) -> Figure:
    """Draw S, the plain grid, and the cells in which D saw something, coloured by time.

    Parameters
    ----------
    static, plain : ndarray, shape (rows, columns)
        Probabilities.
    extent : tuple
        (left, right, bottom, top), metres.
    moved_xy : ndarray, shape (n, 2)
        Cells of D, metres.
    moved_minutes : ndarray, shape (n,)
        When each was last dynamic, minutes from the start.
    path_xy : ndarray, shape (k, 2)
        The robot's way.
    walks : sequence of ndarray, shape (m, 2)
        Ways of the things that moved.
    title : str
    """
    width, height = extent[1] - extent[0], extent[3] - extent[2]
    tall = min(max(3 * style.WIDTH * height / width, 7.0), 24.0)
    with style.house_style():
        figure = Figure(figsize=(style.WIDTH, tall), dpi=style.DPI, layout="constrained")
        panels = figure.subplots(3, 1, sharex=True, sharey=True)
        for axes, p, name in ((panels[0], static, "S: what stays"), (panels[1], plain, "plain grid")):
            show_map(axes, p, extent)
            axes.set_title(name)
            axes.tick_params(labelbottom=True)  # shared axes hide the numbers over which "x [m]" stands
        axes = panels[2]
        show_map(axes, 0.5 + 0.3 * (static - 0.5), extent)
        axes.plot(path_xy[:, 0], path_xy[:, 1], color=style.GREY, lw=0.6, label="robot")
        dots = axes.scatter(
            moved_xy[:, 0], moved_xy[:, 1], c=moved_minutes, s=3, marker="s", lw=0, cmap="viridis", label="D"
        )
        for k, walk in enumerate(walks):
            axes.plot(walk[:, 0], walk[:, 1], color=style.VERMILION, lw=1.6, label=None if k else "moved")
        axes.set_title("D: where something moved, and when it last did")
        if len(moved_xy):
            figure.colorbar(dots, ax=panels, label="D: time [min]", shrink=0.4, anchor=(0.0, 0.0))
        axes.legend(loc="upper right", framealpha=0.9, markerscale=3)
        figure.suptitle(title)
    return figure


def readings_figure(names: Sequence[str], precision_recall: Array) -> Figure:
    """Draw precision and recall of D, one mark a run.

    Parameters
    ----------
    names : sequence of str
        Of the readings.
    precision_recall : ndarray, shape (runs, readings, 2)
    """
    colours = (style.BLUE, style.SKY, style.VERMILION, style.ORANGE)
    marks = ("o", "s", "^", "v")
    with style.house_style():
        figure, (axes,) = style.new_figure(4.6)
        for i, name in enumerate(names):
            axes.plot(
                precision_recall[:, i, 1], precision_recall[:, i, 0], ls="none", marker=marks[i], ms=8,
                color=colours[i], mec="white", mew=0.7, label=name,
            )  # fmt: skip
        axes.set(
            xlabel="recall: share of what moves that D holds", ylabel="precision: share of D that moves",
            xlim=(-0.03, 1.03), ylim=(-0.03, 1.03),
        )  # fmt: skip
        axes.legend(loc="center right", frameon=True)
    return figure


def chair_figure(
    since: Array, static: Array, dynamic: Array, variants: Sequence[str], settle: float
) -> Figure:
    """Draw the share of a chair's cells in S and in D over time, one panel a variant.

    Parameters
    ----------
    since : ndarray, shape (n,)
        Seconds since it was put down.
    static, dynamic : ndarray, shape (variants, n)
        Shares, NaN where it is not seen.
    variants : sequence of str
    settle : float
        Seconds after which the ageing variant takes it in.
    """
    with style.house_style():
        figure, panels = style.new_figure(3.6, len(variants), sharey=True)
        for v, (axes, name) in enumerate(zip(panels, variants, strict=True)):
            axes.plot(since, 100 * static[v], color=style.BLACK, lw=2, label="in S")
            axes.plot(since, 100 * dynamic[v], color=style.VERMILION, lw=2, ls="--", label="in D")
            if name == "ageing":
                axes.axvline(settle, color=style.GREY, lw=1, ls=(0, (2, 2)))
                axes.annotate(
                    "T", (settle, 62), xytext=(-12, 0), textcoords="offset points", color=style.GREY
                )
            axes.set(title=f"{name} table", xlabel="time since it was put down [s]", xlim=(0, since[-1]))
        panels[0].set_ylabel("share of its cells [%]")
        style.legend_below(figure, panels[0], 2)
    return figure


def beams_figure(start: Array, ends: Array, cells: Sequence[Array], titles: Sequence[str]) -> Figure:
    """Draw beams over the cells that they cross, one panel a beam.

    Parameters
    ----------
    start : ndarray, shape (2,)
    ends : ndarray, shape (b, 2)
        (x, y) in cells.
    cells : sequence of ndarray, shape (n, 2)
        (row, column) that each beam crosses.
    titles : sequence of str
    """
    with style.house_style():
        figure, panels = style.new_figure(3.6, len(ends))
        for axes, end, crossed, title in zip(panels, ends, cells, titles, strict=True):
            low = np.minimum(crossed.min(axis=0), 0) - 1
            high = crossed.max(axis=0) + 2
            picture = np.ones((high[0] - low[0], high[1] - low[1]))
            picture[tuple((crossed - low).T)] = 0.75
            extent = (low[1], high[1], low[0], high[0])
            axes.imshow(picture, cmap="gray", vmin=0, vmax=1, origin="lower", extent=extent)
            axes.set_xticks(np.arange(low[1], high[1] + 1))
            axes.set_yticks(np.arange(low[0], high[0] + 1))
            axes.plot([start[0], end[0]], [start[1], end[1]], color=style.BLUE, lw=2)
            axes.plot(*end, "o", color=style.VERMILION, ms=7)
            axes.set(title=title, xlabel="x [cells]", ylabel="y [cells]", aspect="equal")
    return figure


def cell_figure(series: Sequence[tuple[str, Array]], truth: Array, decided: float) -> Figure:
    """Draw log-odds of one cell after each observation, for readings of a recursion, beside the truth."""
    colours = (style.VERMILION, style.GREEN, style.BLUE, style.PURPLE, style.ORANGE, style.SKY)
    lines = ("-", "--", "-.", ":", (0, (5, 1, 1, 1)), (0, (1, 1)))
    with style.house_style():
        figure, (axes,) = style.new_figure(4.0)
        n = np.arange(1, len(truth) + 1)
        axes.plot(n, truth, color=style.BLACK, lw=5, alpha=0.25, label="Bayes, directly")
        for (name, values), colour, line in zip(series, colours, lines, strict=False):
            axes.plot(n, values, color=colour, ls=line, lw=2, label=name)
        for level in (-decided, decided):
            axes.axhline(level, color=style.GREY, lw=1, ls=(0, (2, 2)))
        axes.set(xlabel="observations", ylabel="log-odds", ylim=(-8, 8), xlim=(1, len(truth)))
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
