"""B's figures 2, 3 and 4: mean NEES and mean position error over Monte Carlo runs.

Each filter is drawn twice: bold, the mean over the runs of one study as in the paper; thin, the mean over
the whole population.  Shaded, for the filters a figure is about, is where the means of 90 % of such studies
lie at each time.  The shading is what a single study hides.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.metrics import consistency
from vslam_ref.plot import style

ONE_SIDED, TWO_SIDED = (0, (5, 2)), (0, (1, 2))
"""Dashes of the chi-squared lines."""

LOG_FROM = 8.0
"""A panel whose curves pass this gets a logarithmic axis."""


@dataclass(frozen=True)
class MeanCurves:
    """Means over runs, each of shape (T,).

    Attributes
    ----------
    own : ndarray
        Mean over the runs of one study.
    population : ndarray
        Mean over all runs.
    low, high : ndarray
        Pointwise 5 % and 95 % of the means of studies drawn from the population.
    """

    own: Array
    population: Array
    low: Array
    high: Array

    @classmethod
    def from_runs(cls, data: ArrayLike, runs: int, rng: np.random.Generator) -> MeanCurves:
        """Summarise per-run curves (M, T); the first ``runs`` rows are the study's own."""
        x = np.asarray(data, dtype=np.float64)
        low, high = consistency.sample_band(x, runs, rng)
        return cls(x[:runs].mean(axis=0), x.mean(axis=0), low, high)


def nees_figure(
    time: ArrayLike,
    curves: Mapping[str, MeanCurves],
    filters: Sequence[str],
    *,
    runs: int,
    population: int,
    lap_seconds: float,
    title: str = "",
    shaded: int = 1,
    dof: int = 3,
) -> Figure:
    """Draw the mean NEES of filters, low and high initial uncertainty side by side (B's figures 2 and 3).

    Parameters
    ----------
    time : array_like, shape (T,)
        Seconds.
    curves : mapping of str to MeanCurves
        By "filter/p0"; what is missing is not drawn.
    filters : sequence of str
        Which filters, the main one first.
    runs, population : int
        Runs of one study, and of all.
    lap_seconds : float
        When the loop closes.
    title : str
        Heading; none if empty.
    shaded : int
        How many of the filters, from the first, get their band of studies.
    dof : int
        Degrees of freedom of one NEES.

    Returns
    -------
    Figure
        Panels "low" and "high".
    """
    with style.house_style():
        figure, panels = style.new_figure(4.9, 2)
        for axes, p0 in zip(panels, style.P0_TITLES, strict=True):
            _chi_squared_lines(axes, runs, dof)
            _draw(axes, np.asarray(time, dtype=np.float64), curves, filters, p0, shaded)
            _frame(axes, time, lap_seconds, p0)
            _nees_scale(axes, curves, filters, p0)
        panels[0].set_ylabel(f"mean NEES of the pose ({dof} dof, no unit)")
        line, band = consistency.mean_line(runs, dof), consistency.mean_band(runs, dof)
        extra = [
            Line2D([], [], color=style.BLACK, lw=1.2, ls=ONE_SIDED, label=f"one-sided 95 %: {line:.3f}"),
            Line2D(
                [], [], color=style.GREY, lw=1.0, ls=TWO_SIDED,
                label=f"two-sided 95 %: {band.lower:.3f}, {band.upper:.3f}",
            ),
        ]  # fmt: skip
        _legend(figure, filters, extra, runs, population)
        if title:
            figure.suptitle(title, fontsize=12)
    return figure


def error_figure(
    time: ArrayLike,
    curves: Mapping[str, MeanCurves],
    filters: Sequence[str],
    *,
    runs: int,
    population: int,
    lap_seconds: float,
    title: str = "",
    shaded: int = 2,
) -> Figure:
    """Draw the mean position error of filters in metres (B's figure 4); parameters of :func:`nees_figure`.

    The axis does not start at 0: an initial position known to 1 m, which no measurement improves, is most of
    the error of every filter.
    """
    with style.house_style():
        figure, panels = style.new_figure(4.9, 2, sharey=True)
        for axes, p0 in zip(panels, style.P0_TITLES, strict=True):
            _draw(axes, np.asarray(time, dtype=np.float64), curves, filters, p0, shaded)
            _frame(axes, time, lap_seconds, p0)
        panels[0].set_ylabel("mean position error [m]")
        _legend(figure, filters, [], runs, population)
        if title:
            figure.suptitle(title, fontsize=12)
    return figure


def _draw(
    axes: Axes, time: Array, curves: Mapping[str, MeanCurves], filters: Sequence[str], p0: str, shaded: int
) -> None:
    """Draw the bands first, then the population, then the studies: the first filter on top."""
    present = [(style.look(f), curves[f"{f}/{p0}"]) for f in reversed(filters) if f"{f}/{p0}" in curves]
    names = {style.look(f).name for f in filters[:shaded]}
    for look, c in present:
        if look.name in names:
            axes.fill_between(time, c.low, c.high, color=look.colour, alpha=0.16, lw=0)
    for look, c in present:
        axes.plot(time, c.population, color=look.colour, lw=1.0, ls=look.line)
    for look, c in present:
        axes.plot(time, c.own, color=look.colour, lw=2.0, ls=look.line)


def _chi_squared_lines(axes: Axes, runs: int, dof: int) -> None:
    """Draw the one-sided line and the edges of the two-sided band."""
    axes.axhline(consistency.mean_line(runs, dof), color=style.BLACK, lw=1.2, ls=ONE_SIDED, zorder=2.5)
    for edge in consistency.mean_band(runs, dof):
        axes.axhline(edge, color=style.GREY, lw=1.0, ls=TWO_SIDED, zorder=2.4)


def _frame(axes: Axes, time: ArrayLike, lap_seconds: float, p0: str) -> None:
    """Set time axis, the moment the loop closes, and the title of the panel."""
    t = np.asarray(time, dtype=np.float64)
    axes.set_xlim(t[0], t[-1])
    axes.xaxis.set_major_locator(FixedLocator(list(np.arange(0.0, t[-1] + 1e-9, lap_seconds / 4))))
    axes.axvline(lap_seconds, color=style.GREY, lw=1.0, ls=":")
    axes.annotate(
        "lap 2", (lap_seconds, 1.0), xycoords=("data", "axes fraction"), xytext=(4, -3),
        textcoords="offset points", va="top", color=style.GREY, fontsize=9,
    )  # fmt: skip
    axes.set_xlabel("time [s]")
    axes.set_title(style.P0_TITLES[p0])


def _nees_scale(axes: Axes, curves: Mapping[str, MeanCurves], filters: Sequence[str], p0: str) -> None:
    """Scale the axis linearly from 0, or logarithmically where a filter runs away."""
    drawn = [curves[f"{f}/{p0}"] for f in filters if f"{f}/{p0}" in curves]
    top = max((float(np.nanmax([c.high.max(), c.own.max()])) for c in drawn), default=4.0)
    if top <= LOG_FROM:
        axes.set_ylim(0.0, max(5.0, 1.08 * top))
        return
    axes.set_yscale("log")
    axes.set_ylim(1.5, 1.25 * top)
    ticks = [m * 10.0**k for k in range(6) for m in (1, 2, 3, 5) if 1.5 <= m * 10.0**k <= 1.25 * top]
    axes.yaxis.set_major_locator(FixedLocator(ticks))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(ScalarFormatter())


def _legend(
    figure: Figure, filters: Sequence[str], extra: Sequence[Line2D], runs: int, population: int
) -> None:
    """One legend under both panels: filters by colour, then what the strokes mean."""
    looks = [style.look(f) for f in filters]
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=k.colour, ls=k.line, lw=2.0, label=k.name) for k in looks
    ]
    handles += [
        Line2D([], [], color=style.GREY, lw=2.0, label=f"bold: one study of {runs} runs"),
        Line2D([], [], color=style.GREY, lw=1.0, label=f"thin: all {population} runs"),
        Patch(color=style.GREY, alpha=0.3, label=f"shaded: 90 % of studies of {runs}"),
    ]
    handles += extra
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, columnspacing=1.4)
