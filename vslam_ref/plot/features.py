"""Figures of chapter 08: levels, circles, windows, patches, costs and matches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import ArrayLike, NDArray

from vslam_ref.features.fast import CIRCLE
from vslam_ref.plot import style

Bytes = NDArray[np.uint8]


def show(axes: Axes, image: ArrayLike, title: str = "", *, cmap: str = "gray") -> None:
    """Draw grey levels, pixel (0, 0) with its centre at the origin, v downwards."""
    values = np.asarray(image)
    limits = (0, 255) if values.dtype == np.uint8 else (None, None)
    axes.imshow(values, cmap=cmap, vmin=limits[0], vmax=limits[1], interpolation="nearest")
    axes.set(xticks=[], yticks=[], title=title)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def levels_figure(levels: Sequence[Bytes], corners: Sequence[ArrayLike]) -> Figure:
    """All levels with their corners, each drawn as large as the others."""
    with style.house_style():
        figure, panels = style.new_figure(2.4, len(levels))
        for level, (axes, image, xy) in enumerate(zip(panels, levels, corners, strict=True)):
            at = np.asarray(xy)
            show(axes, image, f"level {level}: {image.shape[1]} × {image.shape[0]}, {len(at)} corners")
            axes.plot(*at.T, ".", color=style.ORANGE, ms=1.0 if len(at) > 1000 else 2.0)
            axes.title.set_fontsize(9)
    return figure


def places_figure(image: Bytes, places: Mapping[str, ArrayLike]) -> Figure:
    """One picture several times, each with its places (n, 2), pixels."""
    with style.house_style():
        figure, panels = style.new_figure(2.6, len(places))
        for axes, (name, uv) in zip(panels, places.items(), strict=True):
            show(axes, image, name)
            axes.plot(*np.asarray(uv).T, ".", color=style.ORANGE, ms=4)
    return figure


def circle_figure(image: Bytes, places: Mapping[str, tuple[int, int]], threshold: int) -> Figure:
    """Surroundings of some pixels with the circle of 16: brighter, darker, or alike."""
    with style.house_style():
        figure, panels = style.new_figure(3.0, len(places))
        for axes, (title, (x, y)) in zip(panels, places.items(), strict=True):
            show(axes, image[y - 5 : y + 6, x - 5 : x + 6], title)
            centre = int(image[y, x])
            for k, (i, j) in enumerate(CIRCLE):
                more = int(image[y + j, x + i]) - centre
                colour = style.ORANGE if more > threshold else style.SKY if more < -threshold else style.GREY
                axes.plot(5 + i, 5 + j, "s", mfc=(1, 1, 1, 0.75), mec=colour, mew=2.4, ms=15)
                axes.text(5 + i, 5 + j, str(k), color="black", ha="center", va="center", fontsize=8)
            axes.plot(5, 5, "+", color=style.VERMILION, ms=12, mew=2)
    return figure


def tensor_figure(image: Bytes, windows: Mapping[str, tuple[int, int]], half: int = 3) -> Figure:
    """Windows with their slopes as dots, and the ellipse of the structure tensor."""
    with style.house_style():
        figure, panels = style.new_figure(2.4, 2 * len(windows))
        grey = image.astype(float)
        for k, (title, (x, y)) in enumerate(windows.items()):
            i, j = np.meshgrid(np.arange(x - half, x + half + 1), np.arange(y - half, y + half + 1))
            gx = (grey[j, i + 1] - grey[j, i - 1]).ravel() / 2
            gy = (grey[j + 1, i] - grey[j - 1, i]).ravel() / 2
            show(panels[2 * k], image[y - half : y + half + 1, x - half : x + half + 1], title)
            axes, g = panels[2 * k + 1], np.stack([gx, gy])
            tensor = g @ g.T / g.shape[1]
            value, vector = np.linalg.eigh(tensor)
            angle = float(np.degrees(np.arctan2(vector[1, 1], vector[0, 1])))
            axes.plot(gx, gy, ".", color=style.GREY, ms=4)
            size = 2 * np.sqrt(np.maximum(value, 0))
            axes.add_patch(Ellipse((0, 0), size[1], size[0], angle=angle, fill=False, ec=style.BLUE, lw=2))
            axes.set(xlim=(-70, 70), ylim=(70, -70), aspect="equal", xlabel="$g_x$", ylabel="$g_y$")
            axes.set_title(f"λ: {value[0]:.0f} and {value[1]:.0f}", fontsize=9)
    return figure


def patches_figure(rows: Mapping[str, Sequence[ArrayLike]], titles: Sequence[str] = ()) -> Figure:
    """Rows of small patches, each row with its name."""
    with style.house_style():
        count = max(len(row) for row in rows.values())
        figure, _ = style.new_figure(1.25 * len(rows) + 0.2)
        figure.clear()
        grid = figure.subplots(len(rows), count, squeeze=False)
        for axes_row, (name, row) in zip(grid, rows.items(), strict=True):
            for axes in axes_row:
                axes.axis("off")
            for k, (axes, patch) in enumerate(zip(axes_row, row, strict=False)):
                axes.axis("on")
                show(axes, patch, titles[k] if axes_row is grid[0] and k < len(titles) else "")
                axes.title.set_fontsize(8)
            axes_row[0].set_ylabel(name, rotation=0, ha="right", va="center", fontsize=9)
    return figure


def costs_figure(template: Bytes, costs: Mapping[str, ArrayLike], truth: tuple[float, float]) -> Figure:
    """A template, and maps of costs with the lowest (cross) and the true place (ring)."""
    with style.house_style():
        figure, panels = style.new_figure(3.2, 1 + len(costs))
        show(panels[0], template, "template")
        for axes, (name, cost) in zip(panels[1:], costs.items(), strict=True):
            values = np.asarray(cost, dtype=np.float64)
            y, x = np.unravel_index(int(values.argmin()), values.shape)
            show(axes, values, name, cmap="viridis")
            axes.plot(*truth, "o", mfc="none", mec="white", ms=13, mew=2)
            axes.plot(x, y, "x", color=style.VERMILION, ms=8, mew=2)
    return figure


def matches_figure(
    first: Bytes, second: Bytes, uv_a: ArrayLike, uv_b: ArrayLike, right: ArrayLike, title: str = ""
) -> Figure:
    """Matched points in both pictures; the lines of wrong matches are drawn across."""
    a, b, good = np.asarray(uv_a), np.asarray(uv_b), np.asarray(right, dtype=bool)
    width = first.shape[1]
    with style.house_style():
        figure, (axes,) = style.new_figure(4.1)
        show(axes, np.hstack([first, second]), title)
        for keep, colour in ((good, style.GREEN), (~good, style.VERMILION)):
            axes.plot(*a[keep].T, "o", mfc="none", mec=colour, ms=5)
            axes.plot(b[keep, 0] + width, b[keep, 1], "o", mfc="none", mec=colour, ms=5)
        for p, q in zip(a[~good], b[~good], strict=True):
            axes.plot([p[0], q[0] + width], [p[1], q[1]], "-", color=style.VERMILION, lw=0.8)
    return figure


def steps_figure(paths: Mapping[str, ArrayLike], truth: ArrayLike) -> Figure:
    """Distance from the truth, step by step, on a logarithmic scale."""
    with style.house_style():
        figure, (axes,) = style.new_figure(3.2)
        for (name, path), colour in zip(
            paths.items(), (style.BLUE, style.VERMILION, style.GREEN), strict=False
        ):
            error = np.hypot(*(np.asarray(path) - np.asarray(truth)).T)
            axes.semilogy(error, "o-", color=colour, label=name)
        axes.set(xlabel="steps", ylabel="distance from the truth [px]")
        axes.legend()
    return figure
