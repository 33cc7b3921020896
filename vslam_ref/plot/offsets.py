"""Runs from many first pictures: shares that were tracked, and errors over their bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style

MARKS = {"COLMAP": ("s", style.GREEN), "ORB-SLAM3": ("^", style.ORANGE)}


class OffsetRows(NamedTuple):
    """One sequence.

    Attributes
    ----------
    name : str
    share : ndarray, shape (n,)
        Of all pictures, with a pose.
    error : ndarray, shape (n,)
        Over its bound; NaN where there is no path.
    least : float or None
        Bound of the share.
    beside : mapping of str to float
        Other programs' errors over the bound.
    bound : str
        The bound in words.
    """

    name: str
    share: Array
    error: Array
    least: float | None
    beside: Mapping[str, float]
    bound: str


def offsets_figure(rows: Sequence[OffsetRows]) -> Figure:
    """Draw one line of dots a sequence: its shares on the left, its errors on the right."""
    with style.house_style():
        figure, (left, right) = style.new_figure(1.6 + 0.7 * max(len(rows), 1), 2)
        for at, row in enumerate(reversed(rows)):
            _shares(left, at, row)
            _errors(right, at, row)
        for panel in (left, right):
            panel.set_ylim(-0.6, max(len(rows), 1) - 0.4)
        left.set_yticks(range(len(rows)), [row.name for row in reversed(rows)])
        right.set_yticks(range(len(rows)), [f"bound {row.bound}" for row in reversed(rows)])
        left.set_xlabel("pictures with a pose, of all [%]")
        right.set_xlabel("error of the final path over its bound")
        right.set_xscale("log")
        right.set_xlim(0.08, 15)
        right.set_xticks([0.1, 0.2, 0.5, 1, 2, 5, 10], ["0.1", "0.2", "0.5", "1", "2", "5", "10"])
        right.minorticks_off()
        left.set_xlim(-3, 103)
        right.axvline(1.0, color=style.GREY, lw=1.0, ls="--")
        handles, names = right.get_legend_handles_labels()
        unique = dict(zip(names, handles, strict=True))
        figure.legend(unique.values(), unique.keys(), loc="outside lower center", ncols=5, frameon=False)
    return figure


def _spread(count: int) -> Array:
    """Small shifts, so that equal runs are seen beside each other."""
    return np.linspace(-0.18, 0.18, count) if count > 1 else np.zeros(1)


def _shares(panel: Axes, at: int, row: OffsetRows) -> None:
    panel.plot(100 * row.share, at + _spread(len(row.share)), "o", color=style.BLUE, ms=4, alpha=0.8)
    panel.plot(100 * np.median(row.share), at, "|", color=style.BLACK, ms=18, mew=2)
    if row.least is not None:
        panel.plot([100 * row.least] * 2, [at - 0.35, at + 0.35], "--", color=style.GREY, lw=1.0)


def _errors(panel: Axes, at: int, row: OffsetRows) -> None:
    panel.plot(
        row.error, at + _spread(len(row.error)), "o", color=style.BLUE, ms=4, alpha=0.8, label="one run"
    )
    if np.isfinite(row.error).any():
        panel.plot(
            np.nanmedian(row.error), at, "|", color=style.BLACK, ms=18, mew=2, ls="none", label="median"
        )
    for name, value in row.beside.items():
        mark, colour = MARKS.get(name, ("D", style.PURPLE))
        panel.plot(value, at, mark, color=colour, ms=7, mec=style.BLACK, ls="none", label=name)
