"""Recorded logs: map and trajectory beside the truth, and errors with their 3 sigma bands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.plot import style

COMPONENTS = (("x error", "m"), ("y error", "m"), ("heading error", "rad"))
BATCH = style.LineStyle("batch least squares", style.BLACK, ":")
TRUTH = style.GREY


class Drawn(NamedTuple):
    """What is drawn of one run, in the world frame.

    Attributes
    ----------
    name : str
        Of the filter, or "batch".
    path : ndarray, shape (N, 2)
        Estimated positions, aligned with the truth where there is one.
    landmarks : ndarray, shape (n, 2)
    landmark_cov : ndarray, shape (n, 2, 2)
        NaN where unknown.
    times, errors, sigmas : ndarray, shapes (M,), (M, 3), (M, 3)
        Not aligned; empty where there is no truth. NaN parts are not drawn.
    """

    name: str
    path: Array
    landmarks: Array
    landmark_cov: Array
    times: Array
    errors: Array
    sigmas: Array


def _look(name: str) -> style.LineStyle:
    return BATCH if name == "batch" else style.look(name)


def map_figure(runs: Mapping[str, Drawn], truth_path: Array, truth_map: Array, title: str) -> Figure:
    """Trajectory and map of each run in a panel of its own, over the truth.

    Parameters
    ----------
    runs : mapping of str to Drawn
    truth_path : ndarray, shape (N, 2)
        NaN rows part its pieces; empty where there is no truth.
    truth_map : ndarray, shape (n, 2)
    title : str
    """
    with style.house_style():
        figure, panels = style.new_figure(4.3 if len(runs) < 4 else 3.6, len(runs), sharey=True)
        for panel, run in zip(panels, runs.values(), strict=True):
            look = _look(run.name)
            if len(truth_path):
                panel.plot(*truth_path.T, color=TRUTH, lw=2.2, alpha=0.45, label="truth")
            panel.plot(*run.path.T, color=look.colour, lw=0.9, label="estimate")
            if len(truth_map):
                panel.plot(*truth_map.T, "x", color=style.BLACK, ms=6, mew=1.3, label="true landmark")
            panel.plot(*run.landmarks.T, "o", color=look.colour, ms=4, mfc="none", label="landmark, 3σ")
            _ellipses(panel, run, look.colour)
            panel.set_title(look.name)
            panel.set_aspect("equal", adjustable="datalim")
            panel.set_xlabel("x [m]")
        panels[0].set_ylabel("y [m]")
        style.legend_below(figure, panels[0], 4)
        figure.suptitle(title, fontsize=12)
    return figure


def _ellipses(panel: Axes, run: Drawn, colour: str) -> None:
    """3 sigma outlines of the landmarks."""
    angle = np.linspace(0.0, 2 * np.pi, 49)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    for centre, cov in zip(run.landmarks, run.landmark_cov, strict=True):
        if np.isfinite(cov).all():
            values, vectors = np.linalg.eigh(cov)
            outline = centre[:, None] + 3 * vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * circle)
            panel.plot(*outline, color=colour, lw=0.7)


def error_figure(runs: Mapping[str, Drawn], title: str) -> Figure | None:
    """Errors of x, y and heading over time, one row a component, one column a run, with 3 sigma bands.

    Returns None if no run has errors.
    """
    drawn = [run for run in runs.values() if np.isfinite(run.errors).any()]
    if not drawn:
        return None
    rows = [i for i in range(3) if any(np.isfinite(run.errors[:, i]).any() for run in drawn)]
    with style.house_style():
        figure = Figure(figsize=(style.WIDTH, 1.9 * len(rows) + 1.0), dpi=style.DPI, layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(len(rows), len(drawn), squeeze=False, sharex=True, sharey="row")
        for row, component in enumerate(rows):
            _error_row(axes[row], drawn, component)
        for panel, run in zip(axes[0], drawn, strict=True):
            panel.set_title(_look(run.name).name)
        for panel in axes[-1]:
            panel.set_xlabel("time [s]")
        style.legend_below(figure, axes[0, 0], 2)
        figure.suptitle(title, fontsize=12)
    return figure


def _error_row(panels: NDArray[np.object_], drawn: list[Drawn], component: int) -> None:
    """One component for all runs; the scale follows the errors and the narrowest bands."""
    for panel, run in zip(panels, drawn, strict=True):
        look = _look(run.name)
        error, band = run.errors[:, component], 3 * run.sigmas[:, component]
        gaps = np.concatenate([[False], np.diff(run.times) > 1.0])
        error, band = np.where(gaps, np.nan, error), np.where(gaps, np.nan, band)
        panel.axhline(0.0, color=TRUTH, lw=0.6)
        if np.isfinite(band).any():
            panel.fill_between(run.times, -band, band, color=look.colour, alpha=0.18, lw=0, label="±3σ")
        panel.plot(run.times, error, color=look.colour, lw=0.9, label="error")
    name, unit = COMPONENTS[component]
    panels[0].set_ylabel(f"{name} [{unit}]")
    largest = max(float(np.nanmax(np.abs(run.errors[:, component]))) for run in drawn)
    bands = [
        3 * float(np.nanmax(r.sigmas[:, component]))
        for r in drawn
        if np.isfinite(r.sigmas[:, component]).any()
    ]
    limit = 1.08 * max([largest, *(min(b, 3 * largest) for b in bands)])
    panels[0].set_ylim(-limit, limit)
