"""Differences between the lifted filter and its reduced forms over time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style

_LINES = {
    "reduced/pose": ("pose, 4 + 2 n states", style.BLUE, "-"),
    "reduced/covariance": ("its covariance", style.SKY, "--"),
    "reduced/innovation": ("innovations", style.GREEN, ":"),
    "reduced-map/pose": ("pose, 4 + 4 n states", style.ORANGE, "-."),
    "condition broken/pose": ("pose, condition |u| = 1 broken", style.VERMILION, "-"),
}
_TITLES = {"first_order": "first-order moments of P0 and U", "gaussian": "exact Gaussian moments"}


def _largest(gap: Mapping[str, Array], moments: str) -> Iterator[tuple[str, Array]]:
    """The larger of both P0's gaps for every line that was measured."""
    for key in _LINES:
        names = [f"{key}/{moments}/{p0}" for p0 in ("low", "high")]
        if found := [gap[name] for name in names if name in gap]:
            yield key, np.maximum.reduce(found)


def reduction_figure(time: Array, gap: Mapping[str, Array], *, bound: float) -> Figure:
    """Draw the largest absolute difference at each time, both P0 together.

    Parameters
    ----------
    time : ndarray, shape (T,)
        Seconds.
    gap : mapping of str to ndarray, shape (T,)
        By ``case/quantity/moments/p0``.
    bound : float
        Level to mark.
    """
    with style.house_style():
        figure, panels = style.new_figure(4.9, 2, sharey=True)
        for axes, (moments, title) in zip(panels, _TITLES.items(), strict=True):
            for key, worst in _largest(gap, moments):
                label, colour, line = _LINES[key]
                at = np.flatnonzero(worst > 0)  # a logarithm draws nothing where two floats agree
                axes.plot(time[at], worst[at], color=colour, ls=line, lw=1.6, label=label)
            axes.axhline(bound, color=style.BLACK, lw=1.2, ls=(0, (5, 2)))
            axes.set_yscale("log")
            axes.set_xlim(time[0], time[-1])
            axes.set_xlabel("time [s]")
            axes.set_title(title)
        panels[0].set_ylabel("largest difference from the lifted form\n[m, rad, or their products]")
        panels[0].annotate(
            f"bound {bound:g}", (0.0, bound), xycoords=("axes fraction", "data"), xytext=(4, 4),
            textcoords="offset points", fontsize=9,
        )  # fmt: skip
        style.legend_below(figure, panels[1], 3)
    return figure
