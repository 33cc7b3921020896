"""Figures of chapter 09: matches, epipolar lines, the four motions, samples, and the scene from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from vslam_ref.plot import style
from vslam_ref.plot.features import show

Bytes = NDArray[np.uint8]
COLOURS = (style.ORANGE, style.SKY, style.GREEN, style.YELLOW, style.VERMILION, style.PURPLE)


def matches_figure(
    pictures: Sequence[Bytes], uv_a: ArrayLike, uv_b: ArrayLike, good: ArrayLike | None = None
) -> Figure:
    """Both pictures; in each, every pair as a stroke from where the point was in a to where it is in b."""
    a, b = np.asarray(uv_a), np.asarray(uv_b)
    fits = np.ones(len(a), dtype=bool) if good is None else np.asarray(good)
    with style.house_style():
        figure, panels = style.new_figure(3.0, 2)
        for axes, image, name, ends in zip(panels, pictures, "ab", (a, b), strict=True):
            show(axes, image, f"picture {name}")
            for kind, colour, label in ((fits, style.SKY, "fit"), (~fits, style.VERMILION, "do not")):
                for p, q in zip(a[kind], b[kind], strict=True):
                    axes.plot([p[0], q[0]], [p[1], q[1]], color=colour, lw=0.8)
                if kind.any():
                    axes.plot(*ends[kind].T, ".", color=colour, ms=3, label=f"{kind.sum()} {label}")
            axes.set(xlim=(-0.5, image.shape[1] - 0.5), ylim=(image.shape[0] - 0.5, -0.5))
        if good is not None:
            panels[1].legend(loc="lower right", fontsize=8)
    return figure


def epipolar_figure(pictures: Sequence[Bytes], F: ArrayLike, uv_a: ArrayLike, uv_b: ArrayLike) -> Figure:
    """A few points in picture a, each with its line in picture b and its match beside it; and back."""
    F = np.asarray(F)
    with style.house_style():
        figure, panels = style.new_figure(3.0, 2)
        sides = ((panels[0], pictures[0], F.T, uv_b, uv_a), (panels[1], pictures[1], F, uv_a, uv_b))
        for axes, image, matrix, other, here in sides:
            show(axes, image, "picture a" if axes is panels[0] else "picture b")
            for k, (x, y) in enumerate(zip(np.asarray(other), np.asarray(here), strict=True)):
                colour = COLOURS[k % len(COLOURS)]
                _line(axes, matrix @ np.append(x, 1.0), image.shape[1], colour)
                axes.plot(*y, "o", mfc="none", mec=colour, mew=1.6, ms=7)
            axes.set(xlim=(-0.5, image.shape[1] - 0.5), ylim=(image.shape[0] - 0.5, -0.5))
    return figure


def _line(axes: Axes, line: NDArray[np.float64], width: int, colour: str) -> None:
    """Draw the points with line . (u, v, 1) = 0."""
    u = np.array([0.0, width - 1.0])
    if abs(line[1]) > 1e-3 * abs(line[0]):
        axes.plot(u, -(line[0] * u + line[2]) / line[1], color=colour, lw=1.2)


def motions_figure(motions: ArrayLike, front: ArrayLike, x_a: ArrayLike) -> Figure:
    """The four motions of an essential matrix from above: camera a fixed, camera b, and one pair of rays."""
    T, counts = np.asarray(motions), np.asarray(front)
    ray_a = np.array([*np.asarray(x_a), 1.0])
    with style.house_style():
        figure, panels = style.new_figure(3.0, 4)
        for axes, M, n in zip(panels, T, counts, strict=True):
            R, t = M[:3, :3], M[:3, 3]
            centre = -R.T @ t
            _camera(axes, np.zeros(3), np.array([0, 0, 1.0]), style.BLUE, "a")
            _camera(axes, centre, R[2], style.ORANGE, "b")
            axes.plot([-6 * ray_a[0], 6 * ray_a[0]], [-6, 6], color=style.BLUE, lw=0.8, ls=":")
            axes.set_title(f"{n} in front", fontsize=10)
            axes.set(xlabel="x, baselines", xlim=(-2.2, 2.2), ylim=(-2.2, 2.2), aspect="equal")
        panels[0].set_ylabel("z, baselines")
    return figure


def _camera(axes: Axes, p: NDArray[np.float64], axis: NDArray[np.float64], colour: str, name: str) -> None:
    """Draw a camera from above: its centre, its axis and the wedge of its view."""
    ahead = np.array([axis[0], axis[2]])
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-9)
    side = np.array([-ahead[1], ahead[0]])
    base = np.array([p[0], p[2]])
    wedge = np.array([base, base + 0.7 * ahead + 0.35 * side, base + 0.7 * ahead - 0.35 * side, base])
    axes.plot(*wedge.T, color=colour, lw=1.5)
    axes.plot(*base, "o", color=colour, ms=5)
    axes.annotate(name, (base[0], base[1]), textcoords="offset points", xytext=(6, -10), color=colour)


def draws_figure(sizes: Mapping[str, int], confidence: float, needed: ArrayLike, share: ArrayLike) -> Figure:
    """Samples that a confidence asks for, over the share of right pairs, for samples of several sizes."""
    with style.house_style():
        figure, (axes,) = style.new_figure(3.0)
        lines = ("-", "--", ":")
        for (name, size), row, ls in zip(sizes.items(), np.asarray(needed), lines, strict=False):
            axes.semilogy(np.asarray(share), row, ls=ls, label=f"{name}: samples of {size}")
        axes.set(xlabel="share of right pairs", ylabel="samples", title=f"confidence {confidence:g}")
        axes.set_ylim(1, 1e5)
        axes.legend()
    return figure


def plan_figure(X: ArrayLike, centres: Mapping[str, ArrayLike], axes_ahead: Sequence[ArrayLike]) -> Figure:
    """Points and cameras from above, in the frame of camera a; baselines."""
    points = np.asarray(X)
    colours = (style.BLUE, style.ORANGE, style.GREEN)
    with style.house_style():
        figure, (axes,) = style.new_figure(4.0)
        axes.plot(points[:, 0], points[:, 2], ".", color=style.GREY, ms=3, label="points")
        for (name, p), ahead, colour in zip(centres.items(), axes_ahead, colours, strict=False):
            _camera(axes, np.asarray(p), np.asarray(ahead), colour, name)
        axes.set(xlabel="x, baselines", ylabel="z, baselines", aspect="equal")
        axes.legend(loc="upper left")
    return figure
