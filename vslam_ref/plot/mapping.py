"""Figures of chapter 11: curves of rays, wrong matches, the sigma of depths, a map from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from vslam_ref.plot import style
from vslam_ref.plot.features import show

Bytes = NDArray[np.uint8]
COLOURS = (style.ORANGE, style.SKY, style.YELLOW, style.PURPLE, style.VERMILION, style.GREEN)


def curves_figure(
    first: Bytes,
    second: Bytes,
    uv_a: ArrayLike,
    curves: Sequence[ArrayLike],
    uv_b: ArrayLike,
    corners: ArrayLike,
) -> Figure:
    """Points of one picture; in the other the curves of their rays, their places, and all corners."""
    height, width = second.shape
    with style.house_style():
        figure, (left, right) = style.new_figure(4.0, 2)
        show(left, first, "the new keyframe: five corners")
        show(right, second, "its neighbour: where each may be (line), is (ring)")
        right.plot(*np.asarray(corners).T, ".", color="white", mec=style.BLACK, mew=0.4, ms=4)
        for colour, a, curve, b in zip(COLOURS, np.asarray(uv_a), curves, np.asarray(uv_b), strict=False):
            left.plot(*a, "o", mfc="none", mec=colour, mew=2.2, ms=10)
            right.plot(*np.asarray(curve).T, "-", color=colour, lw=1.8)
            right.plot(*b, "o", mfc="none", mec=colour, mew=2.2, ms=10)
        right.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    return figure


def misses_figure(errors: Mapping[str, ArrayLike], wrong: Mapping[str, ArrayLike], limit: float) -> Figure:
    """Reprojection errors of right and of wrong matches in their two views."""
    with style.house_style():
        figure, panels = style.new_figure(3.0, len(errors))
        bins = np.linspace(0, limit, 21).tolist()
        for axes, (name, error) in zip(panels, errors.items(), strict=True):
            bad = np.asarray(wrong[name], dtype=bool)
            each = [np.minimum(np.asarray(error)[rows], limit) for rows in (~bad, bad)]
            axes.hist(
                each,
                bins,
                stacked=True,
                color=[style.SKY, style.VERMILION],
                label=[f"right: {np.sum(~bad)}", f"wrong: {np.sum(bad)}"],
                edgecolor="white",
                lw=0.4,
            )
            axes.set(title=name, xlabel="error in the two views [px of the level]", ylabel="matches")
            axes.legend()
    return figure


def depth_figure(
    depth: ArrayLike, scatter: Mapping[str, ArrayLike], formula: Mapping[str, ArrayLike]
) -> Figure:
    """Standard deviation of the depth over the depth: dots from many drawn errors, lines from the formula."""
    z = np.asarray(depth)
    with style.house_style():
        figure, (axes,) = style.new_figure(3.8)
        for name, colour, mark in zip(
            formula, (style.BLUE, style.VERMILION, style.GREEN), "os^", strict=False
        ):
            axes.loglog(z, np.asarray(formula[name]), "-", color=colour, label=f"{name}: formula")
            axes.loglog(z, np.asarray(scatter[name]), mark, color=colour, ms=5, label=f"{name}: drawn")
        axes.loglog(z, z, ":", color=style.GREY, label="sigma = depth")
        axes.set(xlabel="depth [m]", ylabel="sigma of the depth [m]")
        axes.legend(ncols=2)
    return figure


def map_figure(X: ArrayLike, centres: ArrayLike, true_path: ArrayLike, true_X: ArrayLike) -> Figure:
    """Points and keyframes of a map from above and from the side, over path and surfaces as they are."""
    points, keyframes, path, surface = (np.asarray(a) for a in (X, centres, true_path, true_X))
    with style.house_style():
        figure, panels = style.new_figure(4.2, 2)
        for axes, (i, j), names in zip(panels, ((0, 1), (0, 2)), ("xy", "xz"), strict=True):
            axes.plot(surface[:, i], surface[:, j], ".", color="#C9C9C9", ms=1, label="surfaces, as they are")
            axes.plot(points[:, i], points[:, j], ".", color=style.BLUE, ms=3, label="points of the map")
            axes.plot(path[:, i], path[:, j], "-", color=style.ORANGE, lw=2, label="the camera's true path")
            axes.plot(keyframes[:, i], keyframes[:, j], "^", color=style.VERMILION, ms=7, label="keyframes")
            axes.set(xlabel=f"{names[0]} [m]", ylabel=f"{names[1]} [m]", aspect="equal")
        panels[0].legend(loc="upper left", bbox_to_anchor=(0.0, -0.18), ncols=2)
    return figure
