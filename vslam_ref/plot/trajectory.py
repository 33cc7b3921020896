"""An estimated path over the true one, seen from above, and the error over time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.plot import style

AXES = "xyz"
TRUTH = style.LineStyle("truth", style.BLACK, "--")
ESTIMATE = style.LineStyle("estimate", style.BLUE, "-")
ERROR = style.VERMILION
GAP = 20.0
"""A step this many times longer than the median is a gap."""
FEW = 300
"""Fewer errors than this get a dot each."""


def top_view(truth: Array) -> tuple[int, int]:
    """The two axes of a view along the third, in which the truth (N, 3) moves least.

    A vehicle's path is seen from above, whether the world's z axis points up or its y axis down.

    Examples
    --------
    >>> top_view(np.array([[0.0, 0, 0], [5, 0.1, 0], [5, 0, 9]]))
    (0, 2)
    """
    least = int(np.ptp(truth, axis=0).argmin())
    first, second = (axis for axis in range(3) if axis != least)
    return first, second


def trajectory_figure(
    estimate: Array, truth: Array, errors: Array, times: Array | None, title: str, alignment: str
) -> Figure:
    """Draw paired paths from above, and their distance over time.

    Parameters
    ----------
    estimate, truth : ndarray, shape (N, 3)
        Metres, in the frame of the truth: the estimate is aligned.
    errors : ndarray, shape (N,)
        Metres.
    times : ndarray, shape (N,), or None
        Seconds; the first is drawn as 0.  None: the axis is the number of the pose.
    title : str
    alignment : str
        How the estimate was aligned, for its name in the legend.
    """
    gaps = _gaps(times)
    with style.house_style():
        figure, (view, error) = style.new_figure(4.7, 2)
        _draw_view(view, _parted(estimate, gaps), _parted(truth, gaps), alignment)
        _draw_errors(error, errors, times, gaps)
        handles = [*view.get_legend_handles_labels()[0], *error.get_legend_handles_labels()[0]]
        labels = [*view.get_legend_handles_labels()[1], *error.get_legend_handles_labels()[1]]
        figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False)
        figure.suptitle(title, fontsize=12)
    return figure


def _gaps(times: Array | None) -> NDArray[np.int64]:
    """Numbers of the poses before which the time jumps: no line is drawn over what was not compared."""
    if times is None:
        return np.zeros(0, dtype=np.int64)
    step = np.diff(times)
    return np.flatnonzero(step > GAP * np.median(step)) + 1


def _parted(values: Array, gaps: NDArray[np.int64]) -> Array:
    """Values (N, ...) with a row of NaN in each gap."""
    return np.insert(values, gaps, np.nan, axis=0)


def _draw_view(panel: Axes, estimate: Array, truth: Array, alignment: str) -> None:
    """Both paths; the true one is dashed and on top, so that neither hides the other."""
    a, b = top_view(truth[np.isfinite(truth[:, 0])])
    name = f"{ESTIMATE.name} ({alignment})"
    panel.plot(*estimate[:, [a, b]].T, ESTIMATE.line, color=ESTIMATE.colour, lw=2.2, label=name)
    panel.plot(*truth[:, [a, b]].T, TRUTH.line, color=TRUTH.colour, lw=0.9, label=TRUTH.name)
    panel.plot(*truth[0, [a, b]], "o", color=TRUTH.colour, ms=6, mfc="none", label="start")
    panel.set_aspect("equal", adjustable="datalim")
    panel.set(xlabel=f"{AXES[a]} [m]", ylabel=f"{AXES[b]} [m]", title="top view")


def _draw_errors(panel: Axes, errors: Array, times: Array | None, gaps: NDArray[np.int64]) -> None:
    rmse = float(np.sqrt(np.mean(errors**2)))
    at = np.arange(float(len(errors))) if times is None else times - times[0]
    marker = "." if len(errors) < FEW else ""
    panel.plot(
        _parted(at, gaps), _parted(errors, gaps), color=ERROR, lw=0.9, label="position error", marker=marker
    )
    panel.axhline(rmse, color=style.GREY, ls=":", lw=1.4, label=f"RMSE {rmse:.4g} m")
    panel.set_ylim(bottom=0.0)
    xlabel = "pose" if times is None else "time [s]"
    panel.set(xlabel=xlabel, ylabel="position error [m]", title="absolute trajectory error")
