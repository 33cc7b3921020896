"""Closing a loop along graphs that grow: error and work over the number of edges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style


def essential_figure(
    least_shared: Sequence[float], edges: Array, after: Array, misled: Array, before: Array, work: Array
) -> Figure:
    """Draw errors (left) and work (right) over the edges of a graph.

    Parameters
    ----------
    least_shared : sequence of float
        Thresholds of the graphs, points; the first one is the tree.
    edges, after, misled, before : ndarray, shape (graphs, runs)
        Edges; ATE in metres after the closing, with a false loop, and as mapped.
    work : ndarray, shape (graphs, runs)
        Multiplications, over those of the first graph.
    """
    x = np.median(edges, axis=1)
    with style.house_style():
        figure, (left, right) = style.new_figure(4.0, 2)
        rows = (
            (before, "as mapped", style.GREY, ":", "^"),
            (misled, "closed, one loop false", style.VERMILION, "--", "o"),
            (after, "closed", style.BLUE, "-", "s"),
        )
        for values, name, colour, line, marker in rows:
            low, middle, high = np.quantile(values, (0.25, 0.5, 0.75), axis=1)
            left.loglog(x, middle, line, color=colour, marker=marker, label=name)
            left.fill_between(x, low, high, color=colour, alpha=0.15, lw=0)
        right.loglog(x, np.median(work, axis=1), "-", color=style.BLUE, marker="s")
        for k, least in enumerate(least_shared):
            name = "tree" if k == 0 else f"{least:g}"
            shift, side = ((-4, 7), "right") if k % 2 == 0 else ((4, -12), "left")
            right.annotate(name, (x[k], np.median(work[k])), shift, textcoords="offset points", ha=side)
        left.set(xlabel="edges besides the loops", ylabel="ATE, m (quartiles of the drives)", title="error")
        right.set(xlabel="edges besides the loops", ylabel="multiplications, tree = 1")
        right.set(title="work, by the least number of common points")
        right.margins(0.12)
        left.set_ylim(bottom=float(after.min()) / 6)
        left.legend(loc="lower right")
    return figure
