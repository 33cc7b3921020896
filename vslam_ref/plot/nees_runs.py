"""Mean NEES of a filter's simulated runs, and the windows by which it is judged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.metrics import consistency
from vslam_ref.plot import style

LOG_FROM = 5.0
"""From this ratio of the largest to the smallest drawn value on, the axis is logarithmic."""


class JudgedWindow(Protocol):
    """Mean NEES of the steps from ``first`` to ``last``, and the band of an honest filter."""

    @property
    def first(self) -> int:
        """Place of its first step."""

    @property
    def last(self) -> int:
        """Place of its last step."""

    @property
    def mean(self) -> float:
        """Mean NEES over runs and steps."""

    @property
    def low(self) -> float:
        """Lower edge of the band."""

    @property
    def high(self) -> float:
        """Upper edge of the band."""


def nees_runs_figure(
    steps: ArrayLike, curve: ArrayLike, windows: Sequence[JudgedWindow], *, runs: int, dof: int, title: str
) -> Figure:
    """Draw the mean NEES at every step, the band of one step, and the windows' means in their bands.

    Parameters
    ----------
    steps : array_like, shape (T,)
        Numbers or times of the steps.
    curve : array_like, shape (T,)
        Mean NEES over runs.
    windows : sequence of JudgedWindow
    runs, dof : int
        Number of runs; length of an error.
    title : str

    Returns
    -------
    Figure
    """
    at, values = np.asarray(steps, dtype=np.float64), np.asarray(curve, dtype=np.float64)
    with style.house_style():
        figure, (axes,) = style.new_figure(4.6)
        band = consistency.mean_band(runs, dof)
        marker = "o" if len(at) < 3 else None
        axes.plot(at, values, color=style.BLUE, lw=1.4, marker=marker, zorder=3)
        for edge in band:
            axes.axhline(edge, color=style.GREY, lw=1.0, ls=(0, (1, 2)))
        axes.axhline(dof, color=style.BLACK, lw=0.8)
        for window in windows:
            _draw(axes, at, window)
        _scale(axes, [*values, *band, *(v for w in windows for v in (w.mean, w.low, w.high))])
        axes.set(xlabel="step", ylabel=f"mean NEES over {runs} runs ({dof} dof, no unit)", title=title)
        handles = [
            Line2D([], [], color=style.BLUE, lw=1.4, marker=marker, label="mean over runs"),
            Line2D([], [], color=style.BLACK, lw=0.8, label=f"expected: {dof}"),
            Line2D(
                [], [], color=style.GREY, lw=1.0, ls=(0, (1, 2)), label="95 % of one step, each by itself"
            ),
            Patch(color=style.GREEN, alpha=0.3, label="window: where an honest filter's mean lies"),
            Line2D([], [], color=style.BLACK, lw=2.4, label="window: mean, inside"),
            Line2D([], [], color=style.VERMILION, lw=2.4, ls="--", label="window: mean, outside"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _draw(axes: Axes, at: Array, window: JudgedWindow) -> None:
    """One window: a box for its band, a line for its mean."""
    half = 0.5 * float(np.diff(at).min()) if len(at) > 1 else 0.5
    left, right = at[window.first] - half, at[window.last] + half
    box = Rectangle(
        (left, window.low), right - left, window.high - window.low, color=style.GREEN, alpha=0.3, lw=0
    )
    axes.add_patch(box)
    inside = window.low <= window.mean <= window.high
    colour, line = (style.BLACK, "-") if inside else (style.VERMILION, "--")
    axes.plot([left, right], [window.mean] * 2, color=colour, ls=line, lw=2.4, zorder=4)


def _scale(axes: Axes, values: Sequence[float]) -> None:
    """From 0 on, or logarithmic where the values are far apart."""
    drawn = [value for value in values if np.isfinite(value)]
    low, high = min(drawn), max(drawn)
    if not (low > 0 and high > LOG_FROM * low):
        axes.set_ylim(0.0, 1.15 * high)
        return
    bottom, top = low / 1.3, high * 1.3
    exponents = range(int(np.floor(np.log10(bottom))), int(np.ceil(np.log10(top))) + 1)
    ticks = [m * 10.0**k for k in exponents for m in (1, 2, 3, 5) if bottom <= m * 10.0**k <= top]
    axes.set_yscale("log")
    axes.set_ylim(bottom, top)
    axes.yaxis.set_major_locator(FixedLocator(ticks))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
