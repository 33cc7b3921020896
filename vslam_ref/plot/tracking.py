"""Figures of chapter 10: where points were expected and found, weights, and how far a guess may be off."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array
from vslam_ref.estimation.robust import Loss
from vslam_ref.plot import style
from vslam_ref.plot.features import show

LEVEL_COLOURS = (style.SKY, style.GREEN, style.YELLOW, style.ORANGE)


def found_figure(
    image: NDArray[np.uint8], level: ArrayLike, expected: ArrayLike, found: ArrayLike, weights: ArrayLike
) -> Figure:
    """Points (n,) by level: a line from where they were expected (n, 2) to where they were found (n, 2).

    Those without weight get a cross, in the place found.
    """
    of, a, b, w = np.asarray(level), np.asarray(expected), np.asarray(found), np.asarray(weights)
    with style.house_style():
        figure, (axes,) = style.new_figure(6.2)
        show(axes, image)
        for each, colour in enumerate(LEVEL_COLOURS):
            rows = (of == each) & (w > 0)
            lines = np.stack([a[rows], b[rows], np.full((rows.sum(), 2), np.nan)], 1).reshape(-1, 2)
            axes.plot(*lines.T, "-", color=colour, lw=1.2)
            axes.plot(*b[rows].T, "o", color=colour, mec="black", mew=0.4, ms=3 + each, label=f"level {each}")
        axes.plot(*b[w == 0].T, "x", color=style.VERMILION, ms=6, mew=1.5, label="weight 0")
        style.legend_below(figure, axes, 5)
    return figure


def weights_figure(loss: Loss, size: ArrayLike, wrong: ArrayLike) -> Figure:
    """Errors in units of the scale, those of wrong matches apart, and the weight that each gets."""
    x, bad = np.asarray(size, np.float64), np.asarray(wrong, dtype=bool)
    line = np.linspace(0, 12, 400)
    with style.house_style():
        figure, (axes,) = style.new_figure(3.2)
        bins = np.linspace(0, 12, 49).tolist()
        parts = [np.minimum(x[~bad], 12), np.minimum(x[bad], 12)]
        axes.hist(
            parts,
            bins,
            stacked=True,
            color=[style.SKY, style.VERMILION],
            label=["right", "wrong"],
        )
        axes.set(
            xlabel=r"error $\|e\|/\sigma_j$ in units of the scale $\hat\sigma$ (last bar: 12 and more)",
            ylabel="matches",
        )
        right = axes.twinx()
        right.plot(line, loss.weight(line), color=style.BLACK, label="Tukey's weight (right axis)")
        right.set(ylim=(0, 1.05), ylabel="weight")
        right.grid(False)
        handles = [axes.get_legend_handles_labels(), right.get_legend_handles_labels()]
        axes.legend(handles[0][0] + handles[1][0], handles[0][1] + handles[1][1], loc="upper center")
    return figure


def reach_figure(offset: ArrayLike, errors: Mapping[str, ArrayLike], limit: float) -> Figure:
    """Error of the pose over how far the guess was off, for some ways to look; above the limit is lost."""
    looks = ((style.VERMILION, "s--"), (style.BLUE, "o-"), (style.GREEN, "^:"))
    with style.house_style():
        figure, (axes,) = style.new_figure(3.4)
        for (name, error), (colour, mark) in zip(errors.items(), looks, strict=False):
            values: Array = np.maximum(np.asarray(error, np.float64), 1e-3)
            axes.semilogy(offset, values, mark, color=colour, label=name)
        axes.axhline(limit, color=style.GREY, lw=1, ls=":", label=f"{limit:g} px")
        axes.set(xlabel="guess off by [px]", ylabel="pose off by [px], at the points")
        axes.legend(loc="upper left")
    return figure
