"""How often each start of a pose graph ends in the best known minimum, and how far off it begins."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style

LOOKS = ((style.VERMILION, "--", "o"), (style.BLUE, "-", "s"), (style.GREY, ":", "^"))


def starts_figure(noises: Array, starts: Sequence[str], share: Array, begun: Array, least: Array) -> Figure:
    """Draw shares and starts over the noise.

    Parameters
    ----------
    noises : ndarray, shape (k,)
        Factors on the noise of a good sensor.
    starts : sequence of str
    share, begun : ndarray, shape (k, 3)
        Share of graphs that end in the best known minimum; median chi² at the start.
    least : ndarray, shape (k,)
        Median of the least chi².
    """
    with style.house_style():
        figure, (left, right) = style.new_figure(4.0, 2)
        for k, (name, (colour, line, marker)) in enumerate(zip(starts, LOOKS, strict=True)):
            left.plot(noises, share[:, k], line, color=colour, marker=marker, label=name)
            right.semilogy(noises, begun[:, k], line, color=colour, marker=marker, label=name)
        right.semilogy(noises, least, color=style.BLACK, lw=0.9, label="least chi²")
        left.set(xlabel="noise, times a good sensor's", ylabel="share of graphs", ylim=(-0.03, 1.06))
        left.set(title="ends in the best known minimum")
        right.set(xlabel="noise, times a good sensor's", ylabel="chi² (no unit)", title="chi² at the start")
        right.legend(loc="center right")
        left.legend(loc="lower left")
    return figure
