"""Maps drawn: static, plain, and where and when something moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vslam_ref.plot import style

Array = NDArray[np.float64]
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
            figure.colorbar(dots, ax=axes, label="time [min]", shrink=0.8)
        axes.legend(loc="upper right", framealpha=0.9, markerscale=3)
        figure.suptitle(title)
    return figure


def variants_figure(maps: Mapping[str, tuple[Array, Array]], extent: Extent, truth: Array) -> Figure:
    """Draw S with D for each of some variants, in one row, the truth of what moves outlined.

    Parameters
    ----------
    maps : mapping of str to (ndarray, ndarray), shape (rows, columns)
        Title -> probabilities of S and of D.
    extent : tuple
        (left, right, bottom, top), metres.
    truth : ndarray of bool, shape (rows, columns)
        Cells of what moves.
    """
    with style.house_style():
        figure, panels = style.new_figure(3.4, len(maps))
        for axes, (name, (s, d)) in zip(panels, maps.items(), strict=True):
            show_map(axes, s, extent)
            rgba = np.zeros((*d.shape, 4))
            rgba[d > 0.9] = (*(int(style.VERMILION[i : i + 2], 16) / 255 for i in (1, 3, 5)), 1.0)
            axes.imshow(rgba, origin="lower", extent=extent, resample=False)
            rows, columns = d.shape
            x = np.linspace(extent[0], extent[1], columns + 1)
            y = np.linspace(extent[2], extent[3], rows + 1)
            axes.contour(
                0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1]), truth.astype(float), [0.5],
                colors=style.BLUE, linewidths=1.2,
            )  # fmt: skip
            axes.set_title(name)
    return figure
