"""Errors of a program's answers over an angle or another number of their inputs, on logarithmic axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.plot import style

LOOKS = {
    "passed": (style.BLUE, "o", "passed"),
    "lost digits": (style.ORANGE, "^", "lost digits"),
    "failed": (style.VERMILION, "x", "failed"),
}
"""Verdict -> colour, marker, words."""
SMALLEST_ERROR = 1e-16


def error_figure(
    at: ArrayLike, errors: ArrayLike, verdicts: Sequence[str], *, axis: str, half_turn: bool
) -> Figure:
    """Draw relative errors over a number; for angles, over the distance from a half turn as well.

    Parameters
    ----------
    at : array_like, shape (N,)
        At least 0; zeros stand at the left edge.
    errors : array_like, shape (N,)
        Relative errors; those below 1e-16 are drawn there.
    verdicts : sequence of str
        "passed", "lost digits" or "failed".
    axis : str
        What the number is.
    half_turn : bool
        Whether there is a second panel.

    Returns
    -------
    Figure
    """
    x, y = np.asarray(at, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    y = np.clip(y, SMALLEST_ERROR, 1.0)
    with style.house_style():
        figure, panels = style.new_figure(3.6, 2 if half_turn else 1, sharey=True)
        _panel(panels[0], x, y, verdicts, axis)
        if half_turn:
            turned = np.abs(np.pi - np.mod(x, 2 * np.pi))
            _panel(panels[1], turned, y, verdicts, "distance from the nearest odd half turn (rad)")
        panels[0].set_yscale("log")
        panels[0].set_ylim(SMALLEST_ERROR / 3, 5.0)
        panels[0].set_yticks([1e-16, 1e-12, 1e-8, 1e-4, 1.0])
        panels[0].set_ylabel("relative error (1: no digit right)")
        style.legend_below(figure, panels[0], 3)
    return figure


def _panel(axes: Axes, x: Array, y: Array, verdicts: Sequence[str], label: str) -> None:
    positive = x[x > 0]
    low = 10.0 ** np.floor(np.log10(positive.min(initial=1.0)) - 1.0)
    for verdict, (colour, marker, words) in LOOKS.items():
        chosen = np.array([v == verdict for v in verdicts])
        if chosen.any():
            shown = np.where(x > 0, x, low)
            axes.plot(shown[chosen], y[chosen], marker, color=colour, ms=5.0, mfc="none", label=words)
    axes.set_xscale("log")
    axes.set_xlabel(label)
    if (x == 0).any():
        axes.axvline(low * np.sqrt(10.0), color=style.GREY, lw=0.8, ls=(0, (1, 2)))
        axes.annotate("0", (low, SMALLEST_ERROR), ha="center", va="bottom", color=style.GREY)
