"""A picture's levels with their corners, and a search for known points in it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.plot import style
from vslam_ref.plot.features import show

LEVELS = (style.VERMILION, style.YELLOW, style.SKY, style.BLUE)


def scale_space_figure(
    levels: Sequence[NDArray[np.uint8]],
    corners: Sequence[ArrayLike],
    expected: Array,
    found: Array,
    level: IntArray,
    radius: float,
) -> Figure:
    """Draw the levels in their sizes on the left, the search on the right.

    Parameters
    ----------
    levels : sequence of ndarray of uint8, shapes (H >> l, W >> l)
    corners : sequence of array_like, shapes (n_l, 2)
        Pixels of their level.
    expected, found : ndarray, shape (m, 2)
        Pixels of level 0; NaN where a point was not found.
    level : ndarray of int, shape (m,)
    radius : float
        Of the search, pixels of level 0.
    """
    with style.house_style():
        figure = Figure(figsize=(style.WIDTH, 4.6), dpi=style.DPI, layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(len(levels), 3, width_ratios=(1.0, 0.62, 2.6),
                                   height_ratios=[2.0**-k + 0.35 for k in range(len(levels))])  # fmt: skip
        for k, (image, xy) in enumerate(zip(levels, corners, strict=True)):
            _level(figure.add_subplot(grid[k, :2]), k, image, np.asarray(xy))
        _search(figure.add_subplot(grid[:, 2]), levels[0], expected, found, level, radius)
    return figure


def _level(panel: Axes, k: int, image: NDArray[np.uint8], xy: NDArray[np.int32]) -> None:
    show(panel, image)
    panel.plot(*xy.T, ".", color=style.ORANGE, ms=0.7 if len(xy) > 2000 else 1.6)
    panel.set_anchor("W")
    height, width = image.shape
    panel.text(1.03, 0.5, f"level {k}\n{width} × {height}\nσ = {2**k}\n{len(xy)} corners", fontsize=8,
               va="center", transform=panel.transAxes)  # fmt: skip


def _search(
    panel: Axes, image: NDArray[np.uint8], expected: Array, found: Array, level: IntArray, radius: float
) -> None:
    show(panel, image, "where points are expected, looked for, and found")
    for k, colour in enumerate(LEVELS):
        rows = level == k
        for place in expected[rows]:
            reach = max(radius, 1.5 * 2.0**k)
            panel.add_patch(Circle((place[0], place[1]), reach, fill=False, ec=colour, lw=1.2))
        panel.plot(*found[rows].T, "x", color=colour, ms=5, mew=1.5,
                   label=f"level {k}: search radius, and found")  # fmt: skip
    lost = ~np.isfinite(found[:, 0])
    panel.plot(*expected[lost].T, "s", mfc="none", mec=style.PURPLE, ms=9, ls="none", label="not found")
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.02), ncols=3, frameon=False, fontsize=8)
