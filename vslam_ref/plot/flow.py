"""Two pipelines as boxes and arrows, with what passed through them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from vslam_ref.plot import style

WIDE, HIGH, STEP = 1.5, 0.78, 1.95


class Box(NamedTuple):
    """A stage, in how many pictures it had a part, and its median milliseconds (NaN: never)."""

    name: str
    pictures: int
    ms: float


def flow_figure(tracker: Sequence[Box], mapper: Sequence[Box], pictures: int, keyframes: int) -> Figure:
    """Draw the tracker's boxes in the upper row, the mapper's in the lower one, and what goes between."""
    with style.house_style():
        figure, (panel,) = style.new_figure(4.4)
        panel.grid(False)
        panel.set(xticks=[], yticks=[])
        for spine in panel.spines.values():
            spine.set_visible(False)
        count = max(len(tracker), len(mapper))
        panel.set_xlim(-1.9, count * STEP - 0.1)
        panel.set_ylim(-1.15, 3.35)
        _row(panel, tracker, 2.2, style.SKY, f"tracking:\nevery picture\n({pictures})")
        _row(panel, mapper, 0.0, style.ORANGE, f"mapping:\nkeyframes\n({keyframes})")
        last = (len(mapper) - 1) * STEP
        _arrow(panel, (last, 2.2 - HIGH / 2), (0.0, HIGH / 2), "keyframe: picture, pose, points found", 0.62)
        _arrow(panel, (last, -HIGH / 2), (last + 0.9 * STEP, 2.2 - HIGH / 2), "", -0.35)
        panel.text(last + 0.52 * STEP, -0.75, "the map: poses of keyframes, points", ha="center", fontsize=9)
    return figure


def _row(panel: Axes, boxes: Sequence[Box], y: float, colour: str, title: str) -> None:
    panel.text(-1.0, y, title, ha="right", va="center", fontsize=10)
    for k, box in enumerate(boxes):
        x = k * STEP
        used = box.pictures > 0
        panel.add_patch(
            FancyBboxPatch((x - WIDE / 2, y - HIGH / 2), WIDE, HIGH, boxstyle="round,pad=0.04",
                           fc=colour if used else "#F2F2F2", ec=style.BLACK, alpha=0.85,
                           ls="-" if used else ":")
        )  # fmt: skip
        told = f"{box.pictures}×, {box.ms:.1f} ms" if np.isfinite(box.ms) else "not needed"
        panel.text(x, y + 0.12, box.name, ha="center", va="center", fontsize=10, fontweight="bold")
        panel.text(x, y - 0.2, told, ha="center", va="center", fontsize=8.5)
        if k:
            _arrow(panel, (x - STEP + WIDE / 2 + 0.05, y), (x - WIDE / 2 - 0.05, y), "", 0.0)
    if boxes:
        panel.add_patch(
            FancyArrowPatch((-0.95, y), (-WIDE / 2 - 0.05, y), arrowstyle="-|>", mutation_scale=13)
        )


def _arrow(
    panel: Axes, start: tuple[float, float], end: tuple[float, float], words: str, above: float
) -> None:
    panel.add_patch(
        FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=13, color=style.BLACK, lw=1.1)
    )
    if words:
        middle = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
        panel.text(middle[0], middle[1] + above * 0.3, words, ha="center", fontsize=9,
                   bbox={"fc": "white", "ec": "none", "pad": 1.5})  # fmt: skip
