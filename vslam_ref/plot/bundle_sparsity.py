"""The arrow matrix drawn: its blocks, its factors, the views' system, and what they cost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Patch
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.plot import style

PARTS = ListedColormap(["#FFFFFF", style.BLUE, style.ORANGE, style.GREEN])
"""Nothing; among views; between views and points; among points."""


def parts(pattern: BoolArray, views: int, *, points_first: bool = False) -> NDArray[np.int64]:
    """Number of the colour of every entry; ``views`` columns belong to views."""
    is_view = (
        np.arange(len(pattern)) >= len(pattern) - views if points_first else np.arange(len(pattern)) < views
    )
    kind = np.where(is_view[:, None] & is_view, 1, np.where(is_view[:, None] | is_view, 2, 3))
    return np.where(pattern, kind, 0)


def draw_pattern(axes: Any, coloured: NDArray[np.int64], title: str) -> None:
    """Draw a matrix of colours."""
    axes.imshow(coloured, cmap=PARTS, vmin=0, vmax=3, interpolation="nearest")
    axes.set_title(title, fontsize=10)
    axes.grid(False)
    axes.set(xticks=[], yticks=[])
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)


def sparsity_figure(
    H: Array,
    points_first: BoolArray,
    views_first: BoolArray,
    views: int,
    systems: tuple[Array, Array],
    walks: Mapping[str, Array],
    *,
    real: bool,
) -> Figure:
    """Draw the arrow and its factors in both orders, S of a walk in two orders, and operations.

    Parameters
    ----------
    H : ndarray, shape (n, n)
        Columns of views first.
    points_first, views_first : ndarray of bool, shape (n, n)
        Patterns of factors.
    views : int
        Columns of H that belong to views.
    systems : two ndarray, shape (D, D)
        S in the file's order of views, and in the package's.
    walks : mapping of str to ndarray
        ``views`` and operations, by the names of ``experiments.bundle.sparsity.Walk``.
    real : bool
        Whether H is that of a real problem; the title says so.
    """
    with style.house_style():
        layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08)
        figure = Figure(figsize=(style.WIDTH, 7.4), dpi=style.DPI, layout=layout)
        FigureCanvasAgg(figure)
        panels = figure.subplots(2, 3)
        where = "real problem" if real else "simulation"
        draw_pattern(panels[0, 0], parts(H != 0, views), f"$J^TJ$ ({where}, views first)")
        draw_pattern(panels[0, 1], parts(points_first, views, points_first=True), "its factor, points first")
        draw_pattern(panels[0, 2], parts(views_first, views), "its factor, views first")
        names = ("S of a walk, pictures shuffled", "S of the walk, reverse Cuthill-McKee")
        for axes, S, name in zip(panels[1], systems, names, strict=False):
            draw_pattern(axes, (S != 0).astype(np.int64), name)
        kinds = (
            ("among views", style.BLUE),
            ("views with points", style.ORANGE),
            ("among points", style.GREEN),
        )
        handles = [Patch(color=colour, label=name) for name, colour in kinds]
        figure.legend(handles=handles, loc="outside lower left", ncols=3, frameon=False)
        _operations(panels[1, 2], walks)
    return figure


def _operations(axes: Any, walks: Mapping[str, Array]) -> None:
    """Operations against the length of the walk."""
    lines = (
        ("whole matrix, dense", walks["whole"], style.GREY, ":", ""),
        ("S dense", walks["dense"], style.VERMILION, "--", ""),
        ("S, pictures shuffled", walks["shuffled"], style.PURPLE, "-.", "^"),
        ("points", walks["points"], style.GREEN, "-", "s"),
        ("S in a band", walks["banded"], style.BLUE, "-", "o"),
        ("full band, predicted", walks["predicted"], style.BLACK, ":", ""),
    )
    for name, values, colour, line, marker in lines:
        axes.loglog(walks["views"], values, color=colour, ls=line, marker=marker, ms=4, lw=1.8, label=name)
    axes.set_xticks(walks["views"], [f"{v:g}" for v in walks["views"]])
    axes.minorticks_off()
    axes.set(xlabel="views", ylabel="multiplications (no unit)", title="what a factor costs")
    axes.set_ylim(top=300.0 * float(walks["whole"].max()))
    axes.legend(fontsize=8, frameon=False, ncols=2, loc="upper left")
