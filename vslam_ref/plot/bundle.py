"""Bundle adjustment drawn: losses under wrong observations."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from vslam_ref.arrays import Array
from vslam_ref.plot import style

LOSS_LOOKS: dict[str, style.LineStyle] = {
    "l2": style.LineStyle("least squares", style.GREY, ":"),
    "huber": style.LineStyle("Huber, σ known", style.GREEN, "-."),
    "tukey": style.LineStyle("Tukey, σ known", style.BLUE, "--"),
    "adaptive": style.LineStyle("Tukey, σ found", style.VERMILION, "-"),
    "ptam": style.LineStyle("Tukey, PTAM's constants", style.PURPLE, (0, (3, 1, 1, 1, 1, 1))),  # type: ignore[arg-type]
}


def _curve(
    axes: Axes, x: Array, line: Array, look: style.LineStyle, band: tuple[Array | None, Array | None]
) -> None:
    axes.plot(x, line, color=look.colour, ls=look.line, marker="o", ms=3.5, lw=2, label=look.name)
    if band[0] is not None and band[1] is not None:
        axes.fill_between(x, band[0], band[1], color=look.colour, alpha=0.13, lw=0)


def robust_figure(
    shares: Array,
    methods: Sequence[str],
    centre: Array,
    point: Array,
    broken: Array,
    *,
    limit: float,
    runs: int,
) -> Figure:
    """Draw errors of centres and points, and the share of broken scenes, against wrong observations.

    Parameters
    ----------
    shares : ndarray, shape (s,)
        Share of wrong observations.
    methods : sequence of m str
        Names in ``LOSS_LOOKS``.
    centre, point : ndarray, shape (3, m, s)
        Lower quartile, median and upper quartile over the scenes, millimetres.
    broken : ndarray, shape (m, s)
        Share of the scenes.
    limit : float
        Error of the centres from which a scene is broken, millimetres.
    runs : int
        Number of scenes.
    """
    with style.house_style():
        figure, panels = style.new_figure(4.2, 3)
        for axes, values in zip(panels, (centre, point, None), strict=True):
            for k, method in enumerate(methods):
                low, line, high = (None, 100 * broken[k], None) if values is None else values[:, k]
                _curve(axes, 100 * shares, line, LOSS_LOOKS[method], (low, high))
            axes.set_xlabel("wrong observations [%]")
            axes.axvline(50, color=style.GREY, lw=1, ls=(0, (2, 2)))
        for axes in panels[:2]:
            axes.set_yscale("log")
            axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.yaxis.set_major_formatter(ScalarFormatter())
            axes.yaxis.set_minor_formatter(NullFormatter())
        panels[0].axhline(limit, color=style.BLACK, lw=1)
        panels[0].annotate("broken above", (0, limit), xytext=(0, 4), textcoords="offset points", fontsize=9)
        panels[0].set(title=f"camera centres, {runs} scenes", ylabel="RMSE, median and quartiles [mm]")
        panels[1].set(title="points", ylabel="RMSE, median and quartiles [mm]")
        panels[2].set(title="broken scenes", ylabel="scenes [%]", ylim=(-4, 104))
        style.legend_below(figure, panels[0], len(methods))
    return figure
