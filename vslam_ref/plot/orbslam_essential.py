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
        Thresholds of the graphs, points.
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
            name = "tree" if np.isinf(least) else f"{least:g}"
            right.annotate(name, (x[k], np.median(work[k])), (0, 7), textcoords="offset points", ha="center")
        left.set(xlabel="edges besides the loops", ylabel="ATE, m (quartiles of the drives)", title="error")
        right.set(xlabel="edges besides the loops", ylabel="multiplications, tree = 1")
        right.set(title="work, by the least number of common points")
        right.set_ylim(top=float(np.median(work, axis=1).max()) * 2)
        left.legend(loc="best")
    return figure
