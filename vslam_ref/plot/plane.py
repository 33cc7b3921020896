"""Things of the plane: vehicles, landmarks and covariance ellipses, drawn into given axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, Polygon
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.plot import style

OUTLINE = np.array([[1.0, 0.0], [-0.5, 0.5], [-0.5, -0.5]])
"""A vehicle of length 1.5 that looks along +x, its reference point at the origin."""


def ellipse_points(mean: ArrayLike, cov: ArrayLike, sigmas: float = 2.0, points: int = 90) -> Array:
    """Points of the ellipse ``(p - mean)^T cov^-1 (p - mean) = sigmas^2``.

    Parameters
    ----------
    mean : array_like, shape (2,)
    cov : array_like, shape (2, 2)
        Positive semi-definite; a singular one gives a line or a point.
    sigmas : float
        Size.  Of a Gaussian, 39 % lie inside for 1, 86 % for 2.
    points : int
        Points on the curve; the first is repeated at the end.

    Returns
    -------
    ndarray, shape (points + 1, 2)
    """
    values, vectors = np.linalg.eigh(np.asarray(cov, dtype=np.float64))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    angle = np.linspace(0.0, 2.0 * np.pi, points + 1)
    circle = np.stack([np.cos(angle), np.sin(angle)], -1)
    curve: Array = np.asarray(mean, dtype=np.float64) + sigmas * circle @ root.T
    return curve


def draw_ellipse(axes: Axes, mean: ArrayLike, cov: ArrayLike, sigmas: float = 2.0, **line: Any) -> None:
    """Draw a covariance ellipse; ``line`` goes to ``axes.plot``."""
    axes.plot(*ellipse_points(mean, cov, sigmas).T, **{"color": style.BLACK, "lw": 1.2, **line})


def draw_vehicle(axes: Axes, pose: ArrayLike, size: float = 0.6, **patch: Any) -> None:
    """Draw a vehicle at a pose (x, y, theta); ``patch`` goes to the polygon."""
    x, y, theta = np.asarray(pose, dtype=np.float64)
    c, s = np.cos(theta), np.sin(theta)
    corners = size * OUTLINE @ np.array([[c, s], [-s, c]]) + (x, y)
    look = {"facecolor": "none", "edgecolor": style.BLACK, "lw": 1.4, "zorder": 3.0, **patch}
    axes.add_patch(Polygon(corners, closed=True, **look))
    axes.autoscale_view()


def draw_arrow(
    axes: Axes, start: ArrayLike, end: ArrayLike, colour: str = style.GREY, line: str = "-"
) -> None:
    """Draw a thin arrow from one point to another."""
    a, b = (tuple(np.asarray(p, dtype=np.float64).tolist()) for p in (start, end))
    look: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 12, "color": colour, "ls": line, "lw": 1.1}
    axes.add_patch(FancyArrowPatch(a, b, **look))


def plane(
    axes: Axes,
    title: str = "",
    xlim: tuple[float, float] | None = None,
    ylim: tuple[float, float] | None = None,
) -> None:
    """Give axes equal scales in metres; with limits the panel shrinks to fit them."""
    fixed = xlim is not None and ylim is not None
    axes.set_aspect("equal", adjustable="box" if fixed else "datalim")
    if fixed:
        axes.set(xlim=xlim, ylim=ylim)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    if title:
        axes.set_title(title)
