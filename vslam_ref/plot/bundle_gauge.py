"""The gauge of bundle adjustment drawn: a scene from above, with ellipses in each gauge."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from vslam_ref.arrays import Array
from vslam_ref.geometry import camera_pose
from vslam_ref.plot import style

if TYPE_CHECKING:
    from vslam_ref.estimation.bundle import Scene


GAUGE_LOOKS: dict[str, tuple[style.LineStyle, str]] = {
    "free": (style.LineStyle("free: nothing held", style.BLUE, "-"), "o"),
    "fixed": (style.LineStyle("fixed: view 0, far coordinate", style.VERMILION, "--"), "s"),
    "badly": (style.LineStyle("badly: view 0, near coordinate", style.PURPLE, ":"), "^"),
}
RADIUS_95 = float(np.sqrt(-2.0 * np.log(0.05)))
"""Of the ellipse that holds 95 % of a plane Gaussian, in standard deviations: 2.4477."""


def ellipse(cov: Array, radius: float = RADIUS_95) -> Array:
    """Outline (65, 2) about the origin of an ellipse of a covariance (2, 2)."""
    values, vectors = np.linalg.eigh(cov)
    t = np.linspace(0.0, 2.0 * np.pi, 65)
    circle = np.stack([np.cos(t), np.sin(t)])
    drawn: Array = (vectors @ (radius * np.sqrt(np.maximum(values, 0.0))[:, None] * circle)).T
    return drawn


def draw_from_above(axes: Any, scene: Scene) -> None:
    """Cameras with their axes, and points, in the plane of x and z."""
    centres, axis = camera_pose.centre_from_pose(scene.T_cam_world), scene.T_cam_world[:, 2, :3]
    for number, (c, z) in enumerate(zip(centres, axis, strict=True)):
        axes.plot([c[0], c[0] + 0.8 * z[0]], [c[2], c[2] + 0.8 * z[2]], color=style.GREY, lw=1.5)
        axes.plot(c[0], c[2], "o", color=style.BLACK, ms=4)
        out = 0.55 * np.array([z[0], z[2]])
        axes.annotate(str(number), (c[0] - out[0], c[2] - out[1]), ha="center", va="center", fontsize=9)
    axes.plot(scene.X_world[:, 0], scene.X_world[:, 2], ".", color="#B0B0B0", ms=4)
    axes.set(xlabel="x [m]", aspect="equal")


def gauge_figure(
    scene: Scene,
    points: Sequence[int],
    cov: Mapping[str, Array],
    errors: Mapping[str, Array],
    deviations: Mapping[str, tuple[Array, Array]],
    invariant: tuple[Array, Array],
    *,
    enlarged: float = 10.0,
) -> Figure:
    """Draw a scene from above with 95 % ellipses of three points in each gauge, and predicted against found.

    Parameters
    ----------
    scene : Scene
    points : sequence of int
        The m points that are drawn with ellipses.
    cov : mapping of gauge to ndarray, shape (3 m, 3 m)
    errors : mapping of gauge to ndarray, shape (runs, 3 m)
        Of the repetitions.
    deviations : mapping of gauge to two ndarray
        Standard deviations of coordinates, predicted and found.
    invariant : two ndarray
        The same of what no gauge changes.
    enlarged : float
        Factor on ellipses and repetitions.
    """
    with style.house_style():
        figure, panels = style.new_figure(4.0, 4)
        for axes, gauge in zip(panels, cov, strict=False):
            look, _ = GAUGE_LOOKS[gauge]
            draw_from_above(axes, scene)
            for k, point in enumerate(points):
                at, rows = scene.X_world[point][[0, 2]], [3 * k, 3 * k + 2]
                cloud = at + enlarged * errors[gauge][:, rows]
                axes.plot(*cloud.T, ".", color=look.colour, ms=1.5, alpha=0.35)
                axes.plot(
                    *(at + enlarged * ellipse(cov[gauge][np.ix_(rows, rows)])).T, color=style.BLACK, lw=1.3
                )
            axes.set_title(look.name, fontsize=10)
            axes.set(xlim=(-3.7, 3.7), ylim=(-6.9, 3.9))
        panels[0].set_ylabel("z [m]")
        figure.suptitle(f"Ellipses of 95 % and repetitions, {enlarged:g} times as large", fontsize=11)
        axes = panels[3]
        for gauge, (predicted, found) in deviations.items():
            look, marker = GAUGE_LOOKS[gauge]
            axes.loglog(predicted, found, marker, color=look.colour, ms=4, mfc="none", label=gauge)
        axes.loglog(*invariant, "*", color=style.BLACK, ms=10, label="ratio, angle")
        ends = np.array(axes.get_xlim())
        axes.plot(ends, ends, color=style.GREY, lw=1)
        axes.set_title("standard deviations", fontsize=10)
        axes.set(xlabel="predicted [m, rad]", ylabel="found [m, rad]")
        axes.legend(frameon=False, loc="upper left")
    return figure
