"""Two pipelines as boxes and arrows, with what passed through them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from vslam_ref.plot import style

WIDE, HIGH, STEP, UP, GAP = 1.5, 0.78, 1.95, 2.3, 0.06
"""Of the boxes: width, height, from one to the next, from row to row, and from a box to an arrow."""
DOWN = 1.9
"""From process to process."""
PALE = "#F2F2F2"
WHITE = {"fc": "white", "ec": "none", "pad": 1.5}


class FlowBox(NamedTuple):
    """A stage, in how many pictures it had a part, its median milliseconds (NaN: never; None: not told)."""

    name: str
    pictures: int
    ms: float | None


def flow_figure(
    tracker: Sequence[FlowBox], mapper: Sequence[FlowBox], pictures: int, keyframes: int
) -> Figure:
    """Draw a loop: the tracker from left to right, the mapper below from right to left, and the map."""
    with style.house_style():
        figure, (panel,) = style.new_figure(4.0)
        panel.grid(False)
        panel.set(xticks=[], yticks=[])
        for spine in panel.spines.values():
            spine.set_visible(False)
        count = max(len(tracker), len(mapper) + 1)
        panel.set_xlim(-1.75, count * STEP - 0.9)
        panel.set_ylim(-0.75, 3.1)
        _row(panel, tracker, UP, style.SKY, range(len(tracker)))
        _row(panel, mapper, 0.0, style.ORANGE, range(count - 1, count - 1 - len(mapper), -1))
        _box(panel, 0.0, 0.0, style.GREEN, "the map", "keyframes, points")
        _arrow(panel, ((count - 1 - len(mapper)) * STEP + STEP - WIDE / 2 - GAP, 0.0), (WIDE / 2 + GAP, 0.0))
        _arrow(panel, (0.0, HIGH / 2 + GAP), (2 * STEP - 0.3, UP - HIGH / 2 - GAP))
        panel.text(0.62 * STEP, UP / 2 - 0.02, "is read", fontsize=9, bbox=WHITE)
        pose = next((k for k, box in enumerate(tracker) if box.name == "pose"), len(tracker) - 1)
        end = (count - 1) * STEP
        _arrow(panel, (pose * STEP, UP - HIGH / 2 - GAP), (end, HIGH / 2 + GAP))
        panel.text((pose * STEP + end) / 2 - 0.25, UP / 2, "keyframe: picture, pose,\nand what was found",
                   fontsize=9, ha="right", va="center", bbox=WHITE)  # fmt: skip
        panel.text(-0.95, UP, f"tracking:\n{pictures} pictures", ha="right", va="center", fontsize=10)
        panel.text(-0.95, 0.0, f"mapping:\n{keyframes} keyframes", ha="right", va="center", fontsize=10)
    return figure


def processes_figure(rows: Mapping[str, Sequence[FlowBox]], told: Mapping[str, str]) -> Figure:
    """Draw processes below each other, each from left to right, and the map that they share.

    ``told`` says of each process what passed through it.
    """
    colours = (style.SKY, style.ORANGE, style.GREEN)
    with style.house_style():
        figure, (panel,) = style.new_figure(1.0 + 1.55 * len(rows))
        panel.grid(False)
        panel.set(xticks=[], yticks=[])
        for spine in panel.spines.values():
            spine.set_visible(False)
        count = max(map(len, rows.values()))
        panel.set_xlim(-2.1, count * STEP + 0.75)
        panel.set_ylim(-0.75, (len(rows) - 1) * DOWN + 0.75)
        tall = (len(rows) - 1) * DOWN
        end = count * STEP - 0.1
        for k, (name, boxes) in enumerate(rows.items()):
            y = tall - k * DOWN
            _row(panel, boxes, y, colours[k % len(colours)], range(len(boxes)))
            _arrow(panel, ((len(boxes) - 1) * STEP + WIDE / 2 + GAP, y), (end - GAP, y), "<|-|>")
            panel.text(-0.95, y, f"{name}:\n{told[name]}", ha="right", va="center", fontsize=10)
            if k:
                _arrow(panel, ((count - 1) * STEP, y + DOWN - HIGH / 2 - GAP), (0.0, y + HIGH / 2 + GAP))
                panel.text(0.5 * (count - 1) * STEP, y + DOWN / 2, "keyframe", fontsize=9, bbox=WHITE,
                           ha="center", va="center")  # fmt: skip
        panel.add_patch(
            FancyBboxPatch((end, -HIGH / 2), 0.6, tall + HIGH, boxstyle="round,pad=0.04", fc=PALE,
                           ec=style.BLACK)
        )  # fmt: skip
        panel.text(end + 0.3, tall / 2, "the map: keyframes, points, covisibility", rotation=90, ha="center",
                   va="center", fontsize=10, fontweight="bold")  # fmt: skip
    return figure


def _row(panel: Axes, boxes: Sequence[FlowBox], y: float, colour: str, places: Sequence[int]) -> None:
    for k, (box, place) in enumerate(zip(boxes, places, strict=True)):
        often = "once" if box.pictures == 1 else f"{box.pictures} times"
        if box.ms is None:
            told = often if box.pictures else "not needed"
        else:
            told = f"{often}, {box.ms:.1f} ms" if np.isfinite(box.ms) else "not needed"
        _box(panel, place * STEP, y, colour if box.pictures else PALE, box.name, told)
        if k:
            side = np.sign(place - places[k - 1])
            start, end = (
                places[k - 1] * STEP + side * (WIDE / 2 + GAP),
                place * STEP - side * (WIDE / 2 + GAP),
            )
            _arrow(panel, (float(start), y), (float(end), y))


def _box(panel: Axes, x: float, y: float, colour: str, name: str, told: str) -> None:
    panel.add_patch(
        FancyBboxPatch((x - WIDE / 2, y - HIGH / 2), WIDE, HIGH, boxstyle="round,pad=0.04", fc=colour,
                       ec=style.BLACK, alpha=0.85, ls=":" if colour == PALE else "-")
    )  # fmt: skip
    panel.text(x, y + 0.12, name, ha="center", va="center", fontsize=10, fontweight="bold", linespacing=0.95)
    panel.text(x, y - 0.2, told, ha="center", va="center", fontsize=8)


def _arrow(panel: Axes, start: tuple[float, float], end: tuple[float, float], heads: str = "-|>") -> None:
    panel.add_patch(
        FancyArrowPatch(start, end, arrowstyle=heads, mutation_scale=13, color=style.BLACK, lw=1.1,
                        shrinkA=0, shrinkB=0)
    )  # fmt: skip
