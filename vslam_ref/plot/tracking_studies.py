"""Studies of tracking: losses under wrong matches, one pass and two, pure rotation, latency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.plot import style

LOSSES = {
    "l2": ("least squares", style.VERMILION, "--", "s"),
    "huber": ("Huber", style.ORANGE, "-.", "^"),
    "tukey": ("Tukey", style.BLUE, "-", "o"),
}
"""Loss -> name, colour, line and mark."""


def wrong_matches_figure(wrong: Array, errors: Array, losses: Sequence[str], good: float) -> Figure:
    """Draw errors over the share of wrong matches.

    Parameters
    ----------
    wrong : ndarray, shape (W,)
        Shares.
    errors : ndarray, shape (3, 2, W, losses)
        Percentiles 5, 50, 95; wrong matches each for itself, and all alike; pixels.
    losses : sequence of str
    good : float
        Pixels, below which a pose is good.
    """
    with style.house_style():
        figure, panels = style.new_figure(4.2, 2, sharey=True)
        titles = ("wrong matches each for itself", "wrong matches all alike (a thing that moves)")
        for k, (panel, title) in enumerate(zip(panels, titles, strict=True)):
            for i, loss in enumerate(losses):
                name, colour, line, mark = LOSSES[loss]
                low, middle, high = errors[:, k, :, i]
                panel.fill_between(100 * wrong, low, high, color=colour, alpha=0.15, lw=0)
                panel.plot(100 * wrong, middle, line, marker=mark, color=colour, ms=5, label=name)
            _limit(panel, good, "a good pose")
            panel.set_yscale("log")
            panel.set_title(title)
            panel.set_xlabel("wrong matches [%]")
        panels[0].set_ylabel("error of the pose in the picture [px]")
        style.legend_below(figure, panels[0], 4)
        figure.suptitle("Median and 5 to 95 % of all pictures", fontsize=11)
    return figure


def _limit(panel: Axes, value: float, name: str) -> None:
    panel.axhline(value, color=style.GREY, lw=1.0, ls=":", label=name)


def turning_figure(arms: Array, reached: Array, points: Array, view: float, turn: float) -> Figure:
    """Draw how far a turn was tracked, and what it added to the map.

    Parameters
    ----------
    arms : ndarray, shape (A,)
        Metres.
    reached : ndarray, shape (A, runs)
        Degrees turned at the last pose.
    points : ndarray, shape (A, runs)
        Points added to the map.
    view, turn : float
        Field of view, and the whole turn, degrees.
    """
    with style.house_style():
        figure, (left, right) = style.new_figure(4.0, 2)
        at = np.arange(len(arms))
        for panel, values in ((left, reached), (right, points)):
            shift = np.linspace(-0.15, 0.15, values.shape[1]) if values.shape[1] > 1 else np.zeros(1)
            for run in range(values.shape[1]):
                panel.plot(at + shift[run], values[:, run], "o", color=style.BLUE, ms=5,
                           label="one room" if run == 0 else None)  # fmt: skip
            panel.set_xticks(at, [f"{100 * arm:g}" for arm in arms])
            panel.set_xlabel("arm: lens to the point that stays [cm]")
        left.axhline(view, color=style.VERMILION, lw=1.2, ls="--", label="field of view")
        left.axhline(turn, color=style.GREY, lw=1.2, ls=":", label="whole turn")
        left.set_ylim(0, 1.08 * turn)
        left.set_ylabel("turned when last tracked [degrees]")
        right.set_ylabel("points where nothing was seen before")
        style.legend_below(figure, left, 3)
    return figure


WAYS = ((style.VERMILION, "--", "s"), (style.ORANGE, "-.", "^"), (style.BLUE, "-", "o"))


def passes_figure(pixels: Array, shares: Array, compared: Array, names: Sequence[str], sure: float) -> Figure:
    """Draw how many jumps were tracked, and the work, over their size.

    Parameters
    ----------
    pixels : ndarray, shape (S,)
        Size of the jump.
    shares, compared : ndarray, shape (ways, S)
        Share tracked, and patches compared with corners.
    names : sequence of str
        Of the ways.
    sure : float
        Share from which a motion counts as trackable.
    """
    with style.house_style():
        figure, (left, right) = style.new_figure(4.0, 2)
        for i, name in enumerate(names):
            colour, line, mark = WAYS[i]
            left.plot(pixels, 100 * shares[i], line, marker=mark, color=colour, ms=5, label=name)
            right.plot(pixels, compared[i], line, marker=mark, color=colour, ms=5)
        _limit(left, 100 * sure, "trackable")
        left.set_ylim(-3, 103)
        left.set_ylabel("jumps tracked [%]")
        right.set_yscale("log")
        right.set_ylabel("patches compared with corners")
        for panel in (left, right):
            panel.set_xlabel("jump between two pictures [px]")
        style.legend_below(figure, left, 4)
    return figure


BACKENDS = {"numpy": (style.ORANGE, "-."), "numba": (style.BLUE, "-")}


def rates_figure(rates: Mapping[str, Mapping[str, Array]], marks: Sequence[float]) -> Figure:
    """Draw how many pictures are done at a rate or a higher one.

    Parameters
    ----------
    rates : mapping of mapping of ndarray
        Scene -> backend -> pictures a second of every picture.
    marks : sequence of float
        Rates to be marked.
    """
    with style.house_style():
        figure, panels = style.new_figure(4.0, len(rates), sharey=True)
        for panel, (name, curves) in zip(panels, rates.items(), strict=True):
            for backend, values in curves.items():
                colour, line = BACKENDS.get(backend, (style.BLACK, "-"))
                x = np.sort(values.ravel())
                y = 100 * (1 - np.arange(len(x)) / max(len(x), 1))
                panel.step(x, y, line, color=colour, where="pre", label=backend)
            for mark in marks:
                panel.axvline(mark, color=style.GREY, lw=1.0, ls=":")
                panel.text(mark, 101, f"{mark:g}", ha="center", fontsize=9, color=style.GREY)
            panel.set_title(name, pad=14)
            panel.set_xlabel("pictures a second, or more")
            panel.set_xlim(left=0)
            panel.set_ylim(0, 100)
        panels[0].set_ylabel("pictures done at that rate [%]")
        style.legend_below(figure, panels[0], 2)
    return figure


PIPELINES = {"in line": (style.VERMILION, "--"), "beside": (style.BLUE, "-")}


def latency_figure(latency: Mapping[str, Array], budget: float) -> Figure:
    """Draw how many pictures are later than a time.

    Parameters
    ----------
    latency : mapping of str to ndarray
        "in line" and "beside" -> seconds of every picture.
    budget : float
        Seconds from picture to picture.
    """
    with style.house_style():
        figure, (panel,) = style.new_figure(4.0)
        for way, values in latency.items():
            colour, line = PIPELINES[way]
            x = np.sort(1e3 * values)
            panel.step(x, 100 * (1 - np.arange(len(x)) / max(len(x), 1)), line, color=colour, where="pre",
                       label=f"mapping {way}")  # fmt: skip
        panel.axvline(1e3 * budget, color=style.GREY, lw=1.2, ls=":", label="the next picture")
        panel.axhline(1.0, color=style.GREY, lw=0.8)
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_ylim(0.05, 120)
        panel.set_xlabel("from a picture to its pose [ms]")
        panel.set_ylabel("pictures that are later [%]")
        style.legend_below(figure, panel, 3)
    return figure
