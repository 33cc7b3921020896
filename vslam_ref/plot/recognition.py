"""Precision over recall of recognised places, and how much support right and wrong candidates have."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style

Curve = tuple[Array, Array]
COLOURS = (style.SKY, style.GREEN, style.BLUE, style.VERMILION)


def recognition_figure(
    sizes: Sequence[int],
    curves: Sequence[tuple[Curve, Curve]],
    right: Array,
    wrong: Array,
    sure: float,
) -> Figure:
    """Draw curves for each vocabulary, and the support of candidates.

    Parameters
    ----------
    sizes : sequence of int
        Words of each vocabulary.
    curves : sequence
        For each, precision and recall by the score of the words, and by the support of the geometry.
    right, wrong : ndarray, shape (m,)
        Support of candidates, squares, in the look-alikes.
    sure : float
        Support that is enough, squares.
    """
    with style.house_style():
        figure, (left, middle) = style.new_figure(4.0, 2)
        for size, (words, geometry), colour in zip(sizes, curves, COLOURS, strict=False):
            left.plot(words[1], words[0], ":", color=colour, label=f"{size} words, score alone")
            left.plot(geometry[1], geometry[0], "-", color=colour, label=f"{size} words, geometry")
        left.set(xlabel="recall", ylabel="precision", xlim=(0, 1.02), ylim=(0, 1.03), title="the corridor")
        left.legend(loc="lower left")
        most = int(max(right.max(initial=1), wrong.max(initial=1), sure)) + 1
        bins = [float(k) for k in range(0, most + 4, 3)]
        middle.hist(wrong, bins, color=style.VERMILION, alpha=0.7, label="another place")
        middle.hist(right, bins, color=style.BLUE, alpha=0.7, label="the same place")
        middle.axvline(sure, color=style.BLACK, lw=0.9, label="enough alone")
        middle.set(
            xlabel="verified squares times share",
            ylabel="pictures",
            title="rendered look-alikes",
        )
        middle.legend(loc="upper right")
    return figure
