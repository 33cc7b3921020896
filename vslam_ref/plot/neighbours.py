"""RMSE and NEES over time of a public setup: EKF, improved EKF and anchored EKF, from two starts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style

STARTS = {"zero": "start known, $P_0$ = 0", "high": "$P_0$ = diag(1, 1, 0.03)"}


def neighbours_figure(
    series: Mapping[str, Any], *, runs: int, published: Mapping[str, tuple[float, float]]
) -> Figure:
    """Draw heading and position RMSE from a known start, and NEES from both starts.

    Parameters
    ----------
    series : mapping
        ``time`` (T,), and ``rmse_heading`` (rad), ``rmse_position`` (m), ``nees`` (per freedom), each
        "filter/start" -> (T,).
    runs : int
        Runs behind each mean.
    published : mapping
        "heading" (degrees) and "position" (m) -> published RMSE of EKF and invariant EKF, if there are any.
    """
    time = np.asarray(series["time"], dtype=np.float64)
    with style.house_style():
        figure = Figure(figsize=(style.WIDTH, 7.0), dpi=style.DPI, layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(2, 2)
        factor = {"heading": 180.0 / np.pi, "position": 1.0}
        for axes, name, unit in zip(panels[0], factor, ("deg", "m"), strict=True):
            _curves(axes, time, series[f"rmse_{name}"], "zero", factor[name])
            _levels(axes, published.get(name, ()))
            axes.set_ylabel(f"{name} RMSE of {runs} runs [{unit}]")
            axes.set_title(STARTS["zero"])
            axes.set_ylim(bottom=0)
        for axes, start in zip(panels[1], STARTS, strict=True):
            _curves(axes, time, series["nees"], start, 1.0)
            axes.axhline(1.0, color=style.GREY, lw=1.0, ls=":")
            axes.set_yscale("log")
            axes.set_ylabel(f"mean pose NEES of {runs} runs,\nper freedom (1 = consistent)")
            axes.set_title(STARTS[start])
        for axes in panels.flat:
            axes.set_xlim(time[0], time[-1])
            axes.set_xlabel("time [s]")
        style.legend_below(figure, panels[0, 0], 3)
    return figure


def _curves(axes: Axes, time: Array, curves: Mapping[str, Any], start: str, factor: float) -> None:
    """Curves of one start, by filter; the anchored EKF last and thin, as it may lie on the EKF."""
    for name, line, width in (("ekf", "-", 2.8), ("iekf", "-", 1.5), ("ekf-anchored", (0, (7, 7)), 1.2)):
        look = style.look(name)
        curve = factor * np.asarray(curves[f"{name}/{start}"], dtype=np.float64)
        axes.plot(time, curve, color=look.colour, ls=line, lw=width, label=look.name)


def _levels(axes: Axes, levels: tuple[float, ...]) -> None:
    """Published averages over the whole course, as horizontal lines."""
    for level, name, colour in zip(levels, ("EKF", "invariant EKF"), (style.BLACK, style.GREY), strict=False):
        axes.axhline(
            level, color=colour, lw=1.1, ls=(0, (5, 2)), label=f"published average, {name} (UKF-M, 100 runs)"
        )
