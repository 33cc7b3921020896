"""Cameras, points and rays in space, and the same point in several pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.plot import style

if TYPE_CHECKING:
    from vslam_ref.geometry.multiview import Views


SIZE = (640.0, 480.0)
"""Pixels of the pictures."""
COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE, style.ORANGE, style.SKY)


def frustum(camera: Any, T_cam_world: Array, depth: float) -> Array:
    """Corners (5, 3) of a camera's pyramid in the world: the centre, then the picture's corners."""
    w, h = SIZE
    corners = np.array([[0, 0], [w, 0], [w, h], [0, h]]) - 0.5
    rays = camera.unproject(corners).bearing
    X_cam = np.concatenate([np.zeros((1, 3)), depth * rays / rays[:, 2:]])
    world: Array = (X_cam - T_cam_world[:3, 3]) @ T_cam_world[:3, :3]
    return world


def draw_camera(axes: Any, pyramid: Array, **line: Any) -> None:
    """Draw a pyramid into axes of space; world y is drawn upwards."""
    c = _upright(pyramid)
    for a, b in ((0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1)):
        axes.plot(*c[[a, b]].T, **line)


def scene_figure(
    views: Views,
    names: Sequence[str],
    X_world: Array,
    point: Array,
    uv: Array,
    mask: NDArray[np.bool_],
    seen: Sequence[Array],
    *,
    real: bool,
) -> Figure:
    """Figure 1.1: all cameras and points, the rays of one point, and that point in up to three pictures.

    Parameters
    ----------
    views : Views
        V cameras with pictures of 640 x 480 pixels.
    names : sequence of str
        Of the pictures.
    X_world : ndarray, shape (N, 3)
        All points.
    point : ndarray, shape (3,)
        The point whose rays are drawn.
    uv, mask : ndarray, shapes (V, 2) and (V,)
        Its pixels, and where it is seen.
    seen : sequence of V ndarray (n, 2)
        All pixels of each picture.
    real : bool
        Whether these are pictures or a simulation; the title says so.
    """
    with style.house_style():
        figure = Figure(figsize=(style.WIDTH, 7.6), dpi=style.DPI, layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(2, 3, height_ratios=(2.0, 1.0))
        space = figure.add_subplot(grid[0, :], projection="3d")
        _draw_space(space, views, X_world, point, mask)
        where = "pictures of a plaster temple, cameras of a robot gantry" if real else "a simulation"
        space.set_title(f"Cameras C, points X, and the rays of one point: {where}", pad=0)
        shown = [int(v) for v in np.flatnonzero(mask)][:3]
        for k, v in enumerate(shown):
            axes = figure.add_subplot(grid[1, k])
            _draw_picture(axes, seen[v], uv[v], views.project(point[None]).uv[0, v], COLOURS[k])
            axes.set_title(
                f"{names[v]}: error {np.linalg.norm(views.project(point[None]).uv[0, v] - uv[v]):.2f} px"
            )
            if k == 0:
                axes.set_ylabel("v [px]")
                axes.legend(loc="lower left", framealpha=1.0)
        return figure


def _upright(X: Array) -> Array:
    """World (x, y, z) as drawn: y upwards."""
    return np.stack([X[..., 0], -X[..., 2], X[..., 1]], -1)


def _draw_space(axes: Any, views: Views, X: Array, point: Array, mask: NDArray[np.bool_]) -> None:
    axes.scatter(*_upright(X).T, s=3.0, color=style.GREY, alpha=0.7, linewidths=0, label="points X")
    rank = 0
    for v, (camera, T) in enumerate(zip(views.each, views.T_cam_world, strict=True)):
        size = 0.17 * float(np.linalg.norm(views.centres[v] - point))
        colour = COLOURS[rank % len(COLOURS)] if mask[v] and rank < len(COLOURS) else "#B0B0B0"
        draw_camera(axes, frustum(camera, T, size), color=colour, lw=1.2 if mask[v] else 0.7)
        if mask[v]:
            ends = _upright(np.stack([views.centres[v], point]))
            axes.plot(*ends.T, color=colour, lw=1.2)
            axes.text(
                *(ends[0] + 0.08 * (ends[0] - ends[1])), f"C{v + 1}", color=colour, ha="center", va="center"
            )
            rank += 1
    axes.scatter(*_upright(point[None]).T, s=40, marker="*", color=style.BLACK, zorder=5, label="one point X")
    everything = _upright(np.concatenate([views.centres, X]))
    low, high = everything.min(axis=0), everything.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.5)
    axes.view_init(elev=38, azim=-112)
    axes.set_xlabel("x [m]", labelpad=6)
    axes.set_ylabel("−z [m]", labelpad=6)
    axes.set_zlabel("y [m]", labelpad=2)
    axes.zaxis.set_major_locator(MaxNLocator(3))
    axes.legend(loc="upper right", markerscale=1.5)


def _draw_picture(axes: Axes, seen: Array, measured: Array, projected: Array, colour: str) -> None:
    axes.plot(*seen.T, ls="", marker=".", ms=1.5, color=style.GREY)
    axes.plot(*measured, ls="", marker="o", ms=11, mfc="none", mew=1.5, color=colour, label="measured")
    axes.plot(*projected, ls="", marker="x", ms=7, mew=1.5, color=style.BLACK, label="h(C, X)")
    axes.set(xlim=(-0.5, SIZE[0] - 0.5), ylim=(SIZE[1] - 0.5, -0.5), xlabel="u [px]")
    axes.set_aspect("equal")
