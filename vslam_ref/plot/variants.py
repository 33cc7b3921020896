"""Mean NEES of variants of one filter, printed and corrected, on a logarithmic axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style

COLOURS = (style.BLUE, style.VERMILION, style.ORANGE, style.YELLOW, style.BLACK, style.GREEN, style.PURPLE)
LINES = ("-", "--", "-.", "-", (0, (6, 2)), ":", (0, (3, 1, 1, 1, 1, 1)))


def variants_figure(
    time: Array, nees: Mapping[str, Array], variants: Sequence[str], *, runs: int, broken: float
) -> Figure:
    """Draw mean NEES curves (T,) by ``variant/p0``; values that are not finite end a curve.

    Parameters
    ----------
    time : ndarray, shape (T,)
        Seconds.
    nees : mapping of str to ndarray
    variants : sequence of str
        Order of the legend.
    runs : int
        Runs behind each mean.
    broken : float
        Level to mark: past it a filter is called broken.
    """
    with style.house_style():
        figure, panels = style.new_figure(4.9, 2, sharey=True)
        for axes, p0 in zip(panels, style.P0_TITLES, strict=True):
            for name, colour, line in zip(variants, COLOURS, LINES, strict=False):
                curve = np.where(np.isfinite(nees[f"{name}/{p0}"]), nees[f"{name}/{p0}"], np.nan)
                axes.plot(time, curve, color=colour, ls=line, lw=1.8, label=name)
            axes.axhline(3.0, color=style.GREY, lw=1.0, ls=":")
            axes.axhline(broken, color=style.BLACK, lw=1.2, ls=(0, (5, 2)))
            axes.set_yscale("log")
            axes.set_xlim(time[0], time[-1])
            axes.set_xlabel("time [s]")
            axes.set_title(style.P0_TITLES[p0])
        panels[0].set_ylabel(f"mean NEES of {runs} runs (3 dof, no unit)")
        panels[0].annotate(
            f"{broken:g}",
            (0.0, broken),
            xycoords=("axes fraction", "data"),
            xytext=(4, 3),
            textcoords="offset points",
        )
        panels[0].annotate(
            "3 = consistent", (1.0, 3.0), xycoords=("axes fraction", "data"), xytext=(-4, -12),
            textcoords="offset points", ha="right", color=style.GREY, fontsize=9,
        )  # fmt: skip
        style.legend_below(figure, panels[0], 4)
    return figure
