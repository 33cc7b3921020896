"""A pose graph seen from above: where it began, where it ended, and its loops."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.plot import style
from vslam_ref.plot.trajectory import AXES, top_view

START = style.LineStyle("start", style.GREY, "--")
SOLVED = style.LineStyle("solved", style.BLUE, "-")
LOOP = style.LineStyle("loop", style.GREEN, "-")
FALSE = style.LineStyle("rejected", style.VERMILION, "-")


def graph_figure(
    before: Array, after: Array, tail: IntArray, head: IntArray, loops: BoolArray, rejected: BoolArray
) -> Figure:
    """Draw a graph before and after.

    Parameters
    ----------
    before, after : ndarray, shape (n, 2) or (n, 3)
        Positions, metres.
    tail, head : ndarray of int, shape (m,)
        Ends of the edges.
    loops, rejected : ndarray of bool, shape (m,)
        Which of them are loops, and which were called false.

    Returns
    -------
    Figure
        In space, along the axis in which the solved positions move least.
    """
    a, b = (0, 1) if after.shape[1] == 2 else top_view(after)
    with style.house_style():
        figure, (left, right) = style.new_figure(4.9, 2)
        _draw(left, before[:, [a, b]], START, tail, head, loops, np.zeros_like(rejected))
        _draw(right, after[:, [a, b]], SOLVED, tail, head, loops, rejected)
        left.set(title="start", xlabel=f"{AXES[a]} [m]", ylabel=f"{AXES[b]} [m]")
        right.set(title="solved", xlabel=f"{AXES[a]} [m]", ylabel=f"{AXES[b]} [m]")
        shown = [START, SOLVED, LOOP, *([FALSE] if rejected.any() else [])]
        handles = [Line2D([], [], color=one.colour, ls=one.line, label=one.name) for one in shown]
        figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _draw(
    panel: Axes,
    place: Array,
    path: style.LineStyle,
    tail: IntArray,
    head: IntArray,
    loops: BoolArray,
    rejected: BoolArray,
) -> None:
    """Edges as lines: loops under the path, rejected ones on top."""
    ends = np.stack([place[tail], place[head]], 1)
    for which, look, width, order in (
        (loops & ~rejected, LOOP, 0.5, 1),
        (~loops & ~rejected, path, 0.9, 2),
        (rejected, FALSE, 0.7, 3),
    ):
        lines = LineCollection(
            list(ends[which]), colors=look.colour, linestyles=look.line, linewidths=width, zorder=order
        )
        panel.add_collection(lines)
    panel.plot(*place[0], "o", color=style.BLACK, ms=5, mfc="none", zorder=4)
    panel.autoscale_view()
    panel.set_aspect("equal", adjustable="datalim")
