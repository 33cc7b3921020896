"""Losses drawn: cost, influence and weight; and A2.8 as printed beside its correction."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.estimation.robust import Loss
from vslam_ref.plot import style

LOOKS: dict[str, style.LineStyle] = {
    "printed": style.LineStyle("A2.8 as printed", style.VERMILION, "-"),
    "corrected": style.LineStyle("Tukey, corrected", style.BLUE, "--"),
    "huber": style.LineStyle("Huber", style.GREEN, "-."),
    "l2": style.LineStyle("least squares", style.GREY, ":"),
    "cauchy": style.LineStyle("Cauchy", style.ORANGE, (0, (5, 1, 1, 1))),  # type: ignore[arg-type]
    "geman-mcclure": style.LineStyle("Geman-McClure", style.PURPLE, (0, (3, 1, 1, 1, 1, 1))),  # type: ignore[arg-type]
    "tukey": style.LineStyle("Tukey", style.BLUE, "--"),
}


def losses_figure(losses: Mapping[str, Loss], end: float = 8.0) -> Figure:
    """Draw cost, influence and weight of losses, by the names of ``LOOKS``, up to ``end`` sigma."""
    x = np.linspace(0.0, end, 801)
    with style.house_style():
        figure, panels = style.new_figure(3.9, 3)
        for axes, name in zip(panels, ("cost", "influence", "weight"), strict=True):
            for key, loss in losses.items():
                look = LOOKS[key]
                axes.plot(x, getattr(loss, name)(x), color=look.colour, ls=look.line, lw=2.0, label=look.name)
            axes.set_xlabel("error x [σ]")
            axes.set_xlim(0.0, end)
        panels[0].set(title="cost ρ(x): what it costs", ylabel="cost [σ²]", ylim=(0.0, 9.0))
        panels[1].set(title="influence ψ = ρ′: how it pulls", ylabel="influence [σ]", ylim=(-0.1, 4.0))
        panels[2].set(title="weight w = ψ/x", ylabel="weight (no unit)", ylim=(-0.03, 1.05))
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(losses), frameon=False)
    return figure


def _mark(axes: Axes, place: float, text: str) -> None:
    axes.axvline(place, color=style.GREY, lw=1, ls=(0, (2, 2)))
    axes.annotate(
        text, (place, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -11),
        textcoords="offset points", color=style.GREY, fontsize=9,
    )  # fmt: skip


def errata_figure(
    cost: Mapping[str, Array],
    along: Array,
    objective: Mapping[str, Array],
    starts: Array,
    found: Mapping[str, Array],
    *,
    c: float,
    runs: int,
    wrong: float,
) -> Figure:
    """Draw A2.8 as printed and corrected: the cost, the objective it makes, and what a solver does with it.

    Parameters
    ----------
    cost : mapping of str to ndarray
        ``"x"``: norms of errors in sigma, (n,); ``"printed"``, ``"corrected"``: costs, (n,).
    along : ndarray, shape (k,)
        Shifts of the pose through the truth, in sigma.
    objective : mapping of str to ndarray, shape (k,)
        Sums of costs.
    starts : ndarray, shape (s,)
        Distances of the starts from the truth, in sigma.
    found : mapping of str to ndarray, shape (s,)
        Share of runs that find the pose.
    c : float
        Tukey's constant, in sigma.
    runs : int
    wrong : float
        Share of wrong sightings.
    """
    with style.house_style():
        figure, (left, middle, right) = style.new_figure(4.3, 3)
        for name in ("printed", "corrected"):
            look = LOOKS[name]
            left.plot(cost["x"], cost[name], color=look.colour, ls=look.line, lw=2.2)
            middle.plot(along, objective[name], color=look.colour, ls=look.line, lw=2.2)
        for name, share in found.items():
            look = LOOKS[name]
            right.plot(
                starts, 100 * share, color=look.colour, ls=look.line, marker="o", ms=4, lw=2, label=look.name
            )
        for axes in (left, right):
            _mark(axes, c / math.sqrt(3), "c/√3")
            _mark(axes, c, "c")
        left.set(title="cost of one error", xlabel="norm of the error [σ]", ylabel="cost [σ², print: σ]")
        middle.set(
            title=f"sum over one scene, {wrong:.0%} wrong", xlabel="shift of the pose [σ]",
            ylabel="objective [σ², print: σ]",
        )  # fmt: skip
        middle.set_ylim(bottom=0.0)
        left.set_ylim(0.0, 1.15 * float(cost["corrected"].max()))
        right.set(
            title=f"poses found, {runs} runs", xlabel="start's distance from the truth [σ]",
            ylabel="found [%]", ylim=(-4, 112),
        )  # fmt: skip
        handles, labels = right.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return figure
