"""Floors with people, beams, maps and landmarks; and the figures of their studies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import se2
from vslam_ref.grids import LogOddsGrid
from vslam_ref.grids.landmarks import Landmark
from vslam_ref.plot import style
from vslam_ref.worlds.floor_plan import Recording

STATIC, MOVING, ROBOT, MARK = style.BLACK, style.VERMILION, style.BLUE, style.GREEN
MODES: dict[str, style.LineStyle] = {
    "separated": style.LineStyle("S and D", style.BLUE, "-"),
    "plain": style.LineStyle("plain grid", style.VERMILION, "--"),
    "ideal": style.LineStyle("moving beams left out by the truth", style.BLACK, ":"),
    "forbidden": style.LineStyle("taken from S, withdrawn when wrong", style.BLUE, "-"),
    "allowed": style.LineStyle("any corner", style.VERMILION, "--"),
    "odometry": style.LineStyle("odometry alone", style.GREY, ":"),
}


def draw_floor(axes: Axes, recording: Recording, k: int, *, beams: bool = True, people: bool = True) -> None:
    """Draw what stands on the floor at scan k: black what is static, red what moves, and the robot.

    Parameters
    ----------
    axes : Axes
    recording : Recording
    k : int
        Number of the scan.
    beams : bool
        Draw the measured beams, red where they end on something that moves.
    people : bool
        Draw bodies and what the laser sees of them.
    """
    s = recording.surfaces(k)
    moving = recording.moving[k, s.segment_owner]
    if beams:
        _draw_beams(axes, recording, k)
    for which, colour in ((~moving, STATIC), (moving, MOVING)):
        lines = s.segments[which].reshape(-1, 2, 2)
        axes.add_collection(LineCollection(list(lines), colors=colour, linewidths=1.6, zorder=3))
    if people and len(recording.people[k]):
        r = recording.config.crowd.radius
        _discs(
            axes,
            np.column_stack([recording.people[k], np.full(len(recording.people[k]), r)]),
            style.GREY,
            0.15,
        )
        _discs(axes, s.discs, MOVING, 0.9)
    draw_robot(axes, recording.T_world_robot[k])
    _square(axes)


def _draw_beams(axes: Axes, recording: Recording, k: int) -> None:
    r, pose = recording.ranges[k], recording.T_world_robot[k]
    hit = np.isfinite(r) & (recording.owner[k] >= 0)
    angles = recording.angles[hit]
    ends = se2.act(pose, r[hit, None] * np.stack([np.cos(angles), np.sin(angles)], 1))
    moves = recording.moving[k, recording.owner[k, hit]]
    for which, colour in ((~moves, style.SKY), (moves, MOVING)):
        lines = np.stack([np.broadcast_to(pose[:2], ends[which].shape), ends[which]], 1)
        axes.add_collection(LineCollection(list(lines), colors=colour, linewidths=0.3, alpha=0.5, zorder=1))


def _discs(axes: Axes, discs: Array, colour: str, alpha: float) -> None:
    width = 2 * discs[:, 2]
    axes.add_collection(
        EllipseCollection(
            width, width, np.zeros(len(discs)), units="xy", offsets=discs[:, :2],
            offset_transform=axes.transData, facecolors=colour, alpha=alpha, zorder=2,
        )
    )  # fmt: skip


def draw_robot(
    axes: Axes, pose: ArrayLike, colour: str = ROBOT, size: float = 0.35, label: str | None = None
) -> None:
    """Draw a triangle that points along the heading."""
    corners = se2.act(pose, size * np.array([[1.2, 0.0], [-0.8, 0.7], [-0.8, -0.7]]))
    axes.fill(corners[:, 0], corners[:, 1], color=colour, zorder=5, label=label)


def draw_map(axes: Axes, grid: LogOddsGrid, title: str = "") -> None:
    """Draw probabilities of a map: white free, black occupied, grey unknown."""
    axes.imshow(
        1.0 - grid.probability, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", extent=grid.lattice.extent,
        interpolation="nearest", zorder=0,
    )  # fmt: skip
    axes.set_title(title)
    _square(axes)


def draw_landmarks(axes: Axes, places: Mapping[int, ArrayLike], landmarks: Sequence[Landmark]) -> None:
    """Draw landmarks at ``places`` (by number): green those in use, red crosses those withdrawn."""
    for withdrawn, colour, marker, name in ((False, MARK, "o", "landmark"), (True, MOVING, "x", "withdrawn")):
        at = np.array([places[m.id] for m in landmarks if (m.withdrawn is not None) == withdrawn]).reshape(
            -1, 2
        )
        face, edge = ("none", colour) if marker == "o" else (colour, None)
        axes.scatter(at[:, 0], at[:, 1], s=46, marker=marker, facecolors=face, edgecolors=edge,
                     linewidths=1.8, zorder=6, label=f"{name} ({len(at)})")  # fmt: skip


def _square(axes: Axes) -> None:
    axes.set_aspect("equal")
    axes.grid(False)
    axes.set(xlabel="x [m]", ylabel="y [m]")


def floor_figure(recording: Recording, scans: Sequence[int]) -> Figure:
    """Draw the floor at some scans, beside each other."""
    with style.house_style():
        figure, panels = style.new_figure(4.4 if len(scans) > 1 else 7.2, len(scans), sharey=True)
        ends = recording.segments[0].reshape(-1, 2)
        for axes, k in zip(panels, scans, strict=True):
            draw_floor(axes, recording, k)
            axes.set(
                xlim=(ends[:, 0].min() - 0.3, ends[:, 0].max() + 0.3), title=f"t = {recording.times[k]:.1f} s"
            )
            axes.set_ylim(ends[:, 1].min() - 0.3, ends[:, 1].max() + 0.3)
    return figure


def maps_figure(
    recording: Recording, k: int, static: LogOddsGrid, dynamic: LogOddsGrid, plain: LogOddsGrid
) -> Figure:
    """Draw S, D and a plain grid beside each other, after scan k; people's bodies as rings over D."""
    with style.house_style():
        figure, panels = style.new_figure(3.7, 3, sharey=True)
        grids = {"S: what stays": static, "D: what moves now": dynamic, "plain grid": plain}
        ends = recording.segments[0].reshape(-1, 2)
        for axes, (title, grid) in zip(panels, grids.items(), strict=True):
            draw_map(axes, grid, title)
            draw_robot(axes, recording.T_world_robot[k])
            axes.set(xlim=(ends[:, 0].min() - 0.3, ends[:, 0].max() + 0.3))
            axes.set_ylim(ends[:, 1].min() - 0.3, ends[:, 1].max() + 0.3)
        people = recording.people[k]
        width = np.full(len(people), 2 * recording.config.crowd.radius)
        rings = EllipseCollection(
            width, width, np.zeros(len(people)), units="xy", offsets=people,
            offset_transform=panels[1].transData, facecolors="none", edgecolors=MOVING, linewidths=0.8,
        )  # fmt: skip
        panels[1].add_collection(rings)
    return figure


def separation_figure(
    densities: Array, static: Array, moving: Array, *, aims: tuple[float, float], judged: float
) -> Figure:
    """Draw precision and recall over the crowd's density.

    Parameters
    ----------
    densities : ndarray, shape (d,)
    static : ndarray, shape (d, runs, 2, 2)
        Of S and of the plain grid; last axis: precision, recall.
    moving : ndarray, shape (d, runs, 2)
        Of D.
    aims : tuple of two floats
        For static cells, and for moving ones.
    judged : float
        The density at which the aims are judged.
    """
    x = 100 * densities
    with style.house_style():
        figure, panels = style.new_figure(4.0, 3)
        for i, (axes, name) in enumerate(zip(panels[:2], ("precision", "recall"), strict=True)):
            for m, mode in enumerate(("separated", "plain")):
                look = MODES[mode]
                name_of_map = "S" if mode == "separated" else look.name
                axes.plot(x, static[:, :, m, i], ".", color=look.colour, ms=5, alpha=0.6)
                axes.plot(
                    x, static[:, :, m, i].mean(axis=1), look.line, color=look.colour, lw=2, label=name_of_map
                )
            axes.set(title=f"static cells: {name}", ylabel=f"{name} [share of cells]")
        shown = densities > 0  # on an empty floor a door and a chair are all that moves
        for i, (name, look) in enumerate((("precision", MODES["separated"]), ("recall", MODES["plain"]))):
            panels[2].plot(x[shown], moving[shown][:, :, i], ".", color=look.colour, ms=5, alpha=0.6)
            mean = moving[shown][:, :, i].mean(axis=1)
            panels[2].plot(x[shown], mean, look.line, color=look.colour, lw=2, label=name)
        panels[2].set(title="moving cells: D", ylabel="share of cells")
        for axes, aim in zip(panels, (aims[0], aims[0], aims[1]), strict=True):
            axes.plot([100 * judged], [aim], "*", color=style.BLACK, ms=11, label=f"aim: {aim:g}", zorder=5)
            axes.set(xlabel="free floor covered by bodies [%]")
            axes.legend(frameon=False)
    return figure


def localisation_figure(
    densities: Array, rmse: Array, squares: Array, errors: Array, f_scores: Array
) -> Figure:
    """Draw the position error over the crowd's density, and D over the error of the poses.

    Parameters
    ----------
    densities : ndarray, shape (d,)
    rmse : ndarray, shape (d, runs, 3)
        With separation, with a plain grid, and with perfect knowledge of what moves, metres.
    squares : ndarray, shape (runs, 3)
        The same with least squares, at the last density.
    errors : ndarray, shape (e,)
        Standard deviations of the poses from which maps were drawn, metres.
    f_scores : ndarray, shape (runs, e)
    """
    with style.house_style():
        figure, (left, right) = style.new_figure(4.0, 2)
        beside = 100 * densities[-1] + 3.0
        for m, mode in enumerate(("separated", "plain", "ideal")):
            look = MODES[mode]
            left.plot(100 * densities, rmse[:, :, m], ".", color=look.colour, ms=6, alpha=0.6)
            mean = rmse[:, :, m].mean(axis=1)
            left.plot(100 * densities, mean, look.line, color=look.colour, lw=2, label=look.name)
            left.plot(np.full(len(squares), beside + m), squares[:, m], ".", color=look.colour, alpha=0.6)
            left.plot(beside + m, squares[:, m].mean(), "D", color=look.colour, mfc="white", ms=8)
        left.plot([], [], "D", color=style.GREY, mfc="white", ms=8, label="with least squares")
        left.set(title="position error; dots: runs", xlabel="free floor covered by bodies [%]", yscale="log")
        left.set_ylabel("RMSE of the position [m]")
        _plain_numbers(left)
        left.legend(frameon=False)
        right.plot(100 * errors, f_scores.T, ".", color=style.BLUE, ms=6, alpha=0.6)
        right.plot(100 * errors, f_scores.mean(axis=0), "-", color=style.BLUE, lw=2)
        right.set(title="D, drawn from wrong poses", xlabel="error of each pose, standard deviation [cm]")
        right.set_ylabel("F score of D, per beam")
    return figure


def _plain_numbers(axes: Axes) -> None:
    """Write 0.1, 0.2, 0.5 on a logarithmic axis."""
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def choice_figure(rmse: Array, counts: Mapping[str, Array], modes: Sequence[str]) -> Figure:
    """Draw the errors of the modes run by run, and what became of the landmarks.

    Parameters
    ----------
    rmse : ndarray, shape (runs, modes)
        Metres.
    counts : mapping of str to ndarray, shape (modes,)
        ``chosen``, ``on_things``, ``wrong``, ``found_out``, ``good_lost``, over all runs.
    modes : sequence of str
        Keys of :data:`MODES`; the first two are shown on the right.
    """
    words = {
        "chosen": "chosen",
        "on_things": "on a thing that moves",
        "wrong": "seen to have left",
        "found_out": "... and withdrawn",
        "good_lost": "on a wall, withdrawn",
    }
    with style.house_style():
        figure, (left, right) = style.new_figure(4.0, 2)
        order = np.argsort(rmse[:, 0])
        for m, mode in enumerate(modes):
            look = MODES[mode]
            left.plot(1 + np.arange(len(rmse)), rmse[order, m], look.line, marker="o", ms=4,
                      color=look.colour, label=look.name)  # fmt: skip
        left.xaxis.set_major_locator(MaxNLocator(integer=True))
        left.set(
            title="position error, landmarks only", xlabel="run, in order of the first error", yscale="log"
        )
        left.set_ylabel("RMSE of the position [m]")
        _plain_numbers(left)
        left.legend(frameon=False)
        y = np.arange(len(words))[::-1]
        for m, mode in enumerate(modes[:2]):
            look, shift = MODES[mode], 0.2 - 0.4 * m
            values = [counts[key][m] for key in words]
            bars = right.barh(y + shift, values, height=0.36, color=look.colour, label=look.name)
            right.bar_label(bars, fmt="%.0f", padding=3, fontsize=9)
        right.set_yticks(y, list(words.values()))
        right.set(title="landmarks, all runs", xlabel="number")
        right.margins(x=0.12)
        right.legend(frameon=False, loc="lower right")
    return figure
