"""Variants of a system: how many pictures each tracks, and how well."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style

KINDS = {
    "whole": ("o", style.BLUE),
    "without the part": ("s", style.VERMILION),
    "ptam2007": ("^", style.ORANGE),
}


class PartRows(NamedTuple):
    """A variant's name and kind, and its runs' shares (n,) and errors (n,), percent."""

    name: str
    kind: str
    share: Array
    error: Array


def parts_figure(rows: Sequence[PartRows]) -> Figure:
    """Draw one line a variant, the first at the top."""
    with style.house_style():
        figure, (left, right) = style.new_figure(1.4 + 0.3 * len(rows), 2, sharey=True)
        for at, row in enumerate(reversed(rows)):
            mark, colour = KINDS.get(row.kind, ("D", style.PURPLE))
            for panel, values in ((left, 100 * row.share), (right, row.error)):
                panel.plot(values, np.full(len(values), at), mark, color=colour, ms=6, alpha=0.75, ls="none",
                           label=row.kind)  # fmt: skip
        left.set_yticks(range(len(rows)), [row.name for row in reversed(rows)])
        left.set_xlim(0, 104)
        left.set_xlabel("pictures with a pose [%]")
        right.set_xscale("log")
        right.set_xlabel("error of the path [% of its length]")
        handles, names = left.get_legend_handles_labels()
        unique = dict(zip(names, handles, strict=True))
        figure.legend(unique.values(), unique.keys(), loc="outside lower center", ncols=3, frameon=False)
    return figure
