"""Figures of chapter 12: two pipelines, the search for a start, a run, paths, a bend with a wrong camera."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.plot import style

COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.ORANGE, style.PURPLE)
MARKS = "os^Dv"


class Lane(NamedTuple):
    """Pieces of work, one after the other: name, colour, ``start (n,)`` and ``length (n,)``, milliseconds."""

    name: str
    colour: str
    start: Array
    length: Array


def schedule_figure(ways: Mapping[str, Sequence[Lane]], arrivals: ArrayLike) -> Figure:
    """When what is worked on, each way of doing it in its own panel; dotted lines where pictures arrive."""
    with style.house_style():
        figure, panels = style.new_figure(2.6, len(ways), sharey=False)
        for axes, (title, lanes) in zip(panels, ways.items(), strict=True):
            for t in np.asarray(arrivals):
                axes.axvline(t, ls=":", color=style.GREY, lw=0.8)
            names = list(dict.fromkeys(lane.name for lane in lanes))
            for lane in lanes:
                bars = list(zip(lane.start, lane.length, strict=True))
                axes.broken_barh(bars, (-names.index(lane.name) - 0.35, 0.7), color=lane.colour)
            axes.set(title=title, xlabel="time [ms]", yticks=-np.arange(len(names)), yticklabels=names)
            axes.grid(visible=False)
    return figure


def starts_figure(
    numbers: ArrayLike, asked: Mapping[str, tuple[ArrayLike, float]], started: int | None
) -> Figure:
    """What was asked of a start, over the second picture's number; the line is what is needed."""
    with style.house_style():
        figure, panels = style.new_figure(2.8, len(asked))
        for axes, (name, (values, limit)) in zip(panels, asked.items(), strict=True):
            axes.plot(np.asarray(numbers), np.asarray(values), "o-", color=style.BLUE, ms=4)
            axes.axhline(limit, color=style.VERMILION, ls="--", label="needed")
            if started is not None:
                axes.axvline(started, color=style.GREEN, lw=2, alpha=0.6, label="started")
            axes.set(title=name, xlabel="number of the second picture")
            axes.set_ylim(bottom=0)
        panels[0].legend()
    return figure


class Limits(Protocol):
    """Shares of the points tried: above ``good`` a picture is good, below ``lost`` it is lost."""

    @property
    def good(self) -> float:
        """No unit."""

    @property
    def lost(self) -> float:
        """No unit."""


def course_figure(
    number: ArrayLike, tried: ArrayLike, found: ArrayLike, limits: Limits, keyframes: ArrayLike
) -> Figure:
    """Points tried and found over the pictures, and the share of them; triangles are keyframes."""
    k, made = np.asarray(number), np.asarray(keyframes)
    with style.house_style():
        figure, (left, right) = style.new_figure(3.2, 2)
        left.plot(k, np.asarray(tried), color=style.GREY, label="looked for")
        left.plot(k, np.asarray(found), color=style.BLUE, label="found, with weight")
        right.plot(k, np.asarray(found) / np.asarray(tried), color=style.BLUE)
        right.axhline(limits.good, color=style.ORANGE, ls="--", label="below: poor")
        right.axhline(limits.lost, color=style.VERMILION, ls=":", label="below: lost")
        for axes in (left, right):
            nought = np.zeros(len(made))
            axes.plot(made, nought, "^", color=style.PURPLE, ms=7, label="keyframe", clip_on=False, zorder=5)
            axes.set_xlabel("number of the picture")
            axes.set_ylim(bottom=0)
        left.set_ylabel("points")
        right.set(ylabel="share found", ylim=(0, 1.05))
        left.legend()
        right.legend(loc="lower left", bbox_to_anchor=(0.0, 0.32))
    return figure


def paths_figure(truth: ArrayLike, paths: Mapping[str, ArrayLike], unit: str = "m") -> Figure:
    """Paths of a camera from above and their distances from the true one, picture by picture."""
    true = np.asarray(truth)
    with style.house_style():
        figure, (above, off) = style.new_figure(3.6, 2)
        above.plot(true[:, 0], true[:, 1], color=style.BLACK, lw=4, alpha=0.3, label="truth")
        for colour, mark, (name, path) in zip(COLOURS, MARKS, paths.items(), strict=False):
            own = np.asarray(path)
            above.plot(own[:, 0], own[:, 1], mark + "-", color=colour, ms=4, lw=1, label=name)
            off.plot(
                1000 * np.linalg.norm(own - true, axis=1), mark + "-", color=colour, ms=4, lw=1, label=name
            )
        above.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]", title="from above")
        above.set_aspect("equal", adjustable="datalim")
        off.set(xlabel="picture with a pose", ylabel=f"distance from the truth [m{unit}]")
        off.set_ylim(bottom=0)
        above.locator_params(nbins=5)
        above.legend()
    return figure


def errors_figure(number: ArrayLike, errors: Mapping[str, ArrayLike]) -> Figure:
    """Errors of a path over the pictures, in millimetres; NaN where there is no pose."""
    with style.house_style():
        figure, (axes,) = style.new_figure(2.8)
        for colour, (name, error) in zip(COLOURS, errors.items(), strict=False):
            axes.plot(np.asarray(number), 1000 * np.asarray(error), color=colour, label=name)
        axes.set(xlabel="number of the picture", ylabel="distance from the truth [mm]")
        axes.set_ylim(bottom=0)
        axes.locator_params(axis="x", nbins=5)
    axes.legend()
    return figure


def bend_flow_figure(fields: Mapping[str, tuple[ArrayLike, ArrayLike]]) -> Figure:
    """Flows in the picture: at places x (n, 2), normalised, arrows (n, 2), each field in its own panel."""
    with style.house_style():
        figure, panels = style.new_figure(2.4, len(fields), sharey=True)
        for axes, (title, (place, flow)) in zip(panels, fields.items(), strict=True):
            x, arrow = np.asarray(place), np.asarray(flow)
            axes.quiver(*x.T, *arrow.T, color=style.BLUE, angles="xy", width=0.006)
            axes.set(title=title, xlabel="x", aspect="equal")
            axes.margins(0.15)
        panels[0].set_ylabel("y")
        panels[0].invert_yaxis()
    return figure


def bend_figure(
    along: ArrayLike,
    steps: Mapping[str, ArrayLike],
    bend: tuple[float, float],
    product: ArrayLike,
    drift: ArrayLike,
) -> Figure:
    """Length of each step of a map over its true length, along the road; and the drift of many bends."""
    with style.house_style():
        figure, (left, right) = style.new_figure(3.6, 2)
        left.axvspan(*bend, color="#EEEEEE", label="bend")
        for colour, (name, ratio) in zip(COLOURS, steps.items(), strict=False):
            left.plot(np.asarray(along), np.asarray(ratio), color=colour, label=name)
        left.set(xlabel="way along the road [m]", ylabel="step in the map / true step")
        style.legend_below(figure, left, 4)
        _cone(right, np.asarray(product), np.asarray(drift))
    return figure


def _cone(axes: Axes, product: Array, drift: Array) -> None:
    """Logarithms of scales over offset times angle, between the lines of slope 1 and 3."""
    line = np.linspace(product.min(), product.max(), 2)
    axes.fill_between(line, line, 3 * line, color=style.SKY, alpha=0.3, label="slope 1 to 3")
    axes.plot(product, drift, "o", color=style.VERMILION, ms=5, label="simulated bends")
    axes.set(xlabel="offset of the centre / f, times angle [rad]", ylabel="log of the scale after the bend")
    axes.locator_params(axis="x", nbins=5)
    axes.legend()
