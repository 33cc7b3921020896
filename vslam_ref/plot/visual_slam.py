"""A visual SLAM run: its map and path from three sides, and its tracking picture by picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.plot import style

SIDES = (("from above", 0, 2), ("from the front", 0, 1), ("from the side", 2, 1))
"""Of a world whose y axis points down: title, horizontal and vertical axis."""
AXES = "xyz"
KEPT = (2.0, 98.0)
"""Percentiles of the points that the picture's frame must hold: a few lie far off."""
MARGIN = 0.06
COLOURS = (
    *(style.GREY, style.SKY, style.BLUE, style.GREEN, style.ORANGE, style.VERMILION, style.PURPLE),
    style.YELLOW,
)
"""Of stages that stand upon each other."""


class MapDrawing(NamedTuple):
    """What is drawn of a map.

    Attributes
    ----------
    points : ndarray, shape (N, 3)
    keyframes : ndarray, shape (K, 3)
        Their centres.
    path : ndarray, shape (n, 3)
        Centres of the camera; NaN rows part pieces.
    truth : ndarray, shape (m, 3)
        May be empty.
    unit : str
    y_down : bool
        Whether the y axis points down, as in a camera's frame.
    """

    points: Array
    keyframes: Array
    path: Array
    truth: Array
    unit: str
    y_down: bool


def map_figure(scene: MapDrawing, title: str) -> Figure:
    """Draw points, keyframes and paths from three sides, in one scale each."""
    with style.house_style():
        figure, panels = style.new_figure(4.4, 3)
        for panel, side in zip(panels, SIDES, strict=True):
            _side(panel, scene, side)
        style.legend_below(figure, panels[0], 4)
        figure.suptitle(f"{title}: map and path", fontsize=12)
    return figure


def _side(panel: Axes, scene: MapDrawing, side: tuple[str, int, int]) -> None:
    words, a, b = side
    at = [a, b]
    panel.plot(*scene.points[:, at].T, ".", color=style.SKY, ms=1.6, alpha=0.6, zorder=1)
    panel.plot([], [], ".", color=style.SKY, ms=6, label="point")  # large enough to be seen in the legend
    if len(scene.truth):
        panel.plot(*scene.truth[:, at].T, "--", color=style.BLACK, lw=0.9, label="truth", zorder=5)
    panel.plot(*scene.path[:, at].T, color=style.VERMILION, lw=2.2, label="path", zorder=3)
    panel.plot(
        *scene.keyframes[:, at].T, "o", color=style.BLUE, ms=3.5, mfc="none", label="keyframe", zorder=5
    )
    _frame(panel, scene, at)
    panel.set_title(words if scene.y_down else f"{AXES[a]} and {AXES[b]}")
    panel.set_xlabel(f"{AXES[a]} [{scene.unit}]")
    panel.set_ylabel(f"{AXES[b]} [{scene.unit}]")


def _frame(panel: Axes, scene: MapDrawing, at: list[int]) -> None:
    """A square that holds the paths and most of the points."""
    parts = [scene.path, scene.keyframes, scene.truth]
    if len(scene.points):
        parts.append(np.percentile(scene.points, KEPT, axis=0))
    X = np.concatenate([part.reshape(-1, 3) for part in parts])[:, at]
    low, high = np.nanmin(X, axis=0), np.nanmax(X, axis=0)
    half = (0.5 + MARGIN) * max(float((high - low).max()), 1e-9)
    x, y = (low + high) / 2
    panel.set_xlim(x - half, x + half)
    down = scene.y_down and at[1] == 1
    panel.set_ylim(*((y + half, y - half) if down else (y - half, y + half)))
    panel.set_aspect("equal")
    panel.locator_params(nbins=5)


class CourseDrawing(NamedTuple):
    """Tracking, one entry a picture; NaN where there is nothing to tell.

    Attributes
    ----------
    number : ndarray, shape (n,)
        Of the picture.
    trails : ndarray, shape (n,)
        Corners that are followed before there is a map.
    tried, found : ndarray, shape (n,)
        Points.
    sigma : ndarray, shape (n,)
        Pixels of the points' levels.
    ms : ndarray, shape (n,)
        Milliseconds.
    keyframe : ndarray of bool, shape (n,)
    state : ndarray of str, shape (n,)
    """

    number: NDArray[np.int64]
    trails: Array
    tried: Array
    found: Array
    sigma: Array
    ms: Array
    keyframe: BoolArray
    state: NDArray[np.str_]


STATES = {
    "unusable": (style.BLACK, "no usable picture"),
    "waiting": (style.GREY, "no map yet"),
    "start": (style.GREEN, "start"),
    "good": (style.BLUE, "good"),
    "poor": (style.ORANGE, "poor"),
    "lost": (style.VERMILION, "lost"),
}
"""State of a picture -> colour and words, from the lowest row to the highest."""


def course_figure(course: CourseDrawing, title: str) -> Figure:
    """Draw points, sigma, quality and time over the pictures."""
    with style.house_style():
        figure = Figure(figsize=(style.WIDTH, 7.6), dpi=style.DPI, layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(4, 1, sharex=True, gridspec_kw={"height_ratios": (3, 2, 2, 3)})
        points, sigma, quality, time = axes
        _points(points, course)
        sigma.plot(course.number, course.sigma, color=style.PURPLE, lw=1.0)
        sigma.set_ylim(bottom=0)
        sigma.set_ylabel("σ of matches\n[px of level]")
        _quality(quality, course)
        _time(time, course)
        time.set_xlabel("number of the picture")
        figure.suptitle(f"{title}: tracking", fontsize=12)
    return figure


def _points(panel: Axes, course: CourseDrawing) -> None:
    panel.plot(course.number, course.trails, ":", color=style.GREEN, lw=1.4, label="corners before the start")
    panel.fill_between(course.number, course.tried, color=style.SKY, alpha=0.35, lw=0, label="tried")
    panel.plot(course.number, course.found, color=style.BLUE, lw=1.1, label="found")
    most = np.nan_to_num([course.trails, course.tried]).max(initial=1.0)
    panel.set_ylim(0, 1.3 * most)  # room for the names
    panel.set_ylabel("points")
    panel.legend(loc="upper right", frameon=False, ncols=3)


def _quality(panel: Axes, course: CourseDrawing) -> None:
    """A mark in the row of its state for every picture; states that never came have no row."""
    names = [name for name in STATES if (course.state == name).any()]
    for row, name in enumerate(names):
        number = course.number[course.state == name]
        panel.plot(number, np.full(len(number), row), "|", color=STATES[name][0], ms=9, mew=1.2)
    panel.set_yticks(range(len(names)), [STATES[name][1] for name in names])
    panel.set_ylim(-0.6, len(names) - 0.4)


def _time(panel: Axes, course: CourseDrawing) -> None:
    panel.plot(course.number, course.ms, color=style.GREY, lw=0.8, label="picture")
    k = course.keyframe
    panel.plot(
        course.number[k], course.ms[k], "o", color=style.BLUE, ms=4, mfc="none", label="with a keyframe"
    )
    if np.nan_to_num(course.ms).max(initial=0.0) > 0:
        panel.set_yscale("log")
    panel.set_ylabel("time [ms]")
    panel.legend(loc="upper right", frameon=False, ncols=2)


def pictures_figure(
    images: Sequence[NDArray[np.uint8]], titles: Sequence[str], below: Sequence[str]
) -> Figure:
    """Draw pictures (H, W, 3) beside each other, with words above and below each."""
    with style.house_style():
        figure, panels = style.new_figure(3.0, len(images))
        for panel, image, title, words in zip(panels, images, titles, below, strict=True):
            panel.imshow(image, interpolation="antialiased")
            panel.set(xticks=[], yticks=[])
            panel.grid(False)
            panel.set_title(title, fontsize=9)
            panel.set_xlabel(words, fontsize=8)
    return figure


class StagesDrawing(NamedTuple):
    """Time of every stage, one entry a picture.

    Attributes
    ----------
    number : ndarray, shape (n,)
        Of the picture.
    tracking, mapping : mapping of str to ndarray, shape (n,)
        Milliseconds of each stage: of every picture, and of those that become keyframes; 0 where it had no
        part.
    """

    number: NDArray[np.int64]
    tracking: Mapping[str, Array]
    mapping: Mapping[str, Array]


def stages_figure(stages: StagesDrawing, title: str) -> Figure:
    """Draw the time of tracking and of mapping over the pictures, stage upon stage."""
    with style.house_style():
        figure = Figure(figsize=(style.WIDTH, 5.4), dpi=style.DPI, layout="constrained")
        FigureCanvasAgg(figure)
        above, below = figure.subplots(2, 1, sharex=True)
        for panel, times, words in ((above, stages.tracking, "tracking"), (below, stages.mapping, "mapping")):
            _stack(panel, stages.number, times)
            panel.set_ylabel(f"{words} [ms of CPU]")
        below.set_xlabel("number of the picture")
        figure.suptitle(f"{title}: time of each stage", fontsize=12)
    return figure


def _stack(panel: Axes, number: NDArray[np.int64], times: Mapping[str, Array]) -> None:
    """Bars without gaps, one stage upon the other; the few longest pictures may reach beyond the panel."""
    base = np.zeros(len(number))
    width = float(np.diff(number).min()) if len(number) > 1 else 1.0
    for colour, (name, ms) in zip(COLOURS, times.items(), strict=False):
        panel.bar(number, ms, width, bottom=base, color=colour, lw=0, label=name)
        base = base + ms
    some = base[base > 0]
    panel.set_ylim(0, 1.35 * float(np.percentile(some, 99)) if len(some) else 1.0)
    if times:
        panel.legend(loc="upper right", frameon=False, ncols=4)
