"""The film of a run: its pictures with what was tracked, a grid on the dominant plane, and a house on it.

It is drawn when the run has ended, with the final poses, so the pictures between the two of the start have
theirs, too.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.datasets import video
from vslam_ref.experiments.visual_slam import raster, solids
from vslam_ref.experiments.visual_slam.running import GOOD, LOST, POOR, START, WAITING, Frame, Run, path
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.visual_map.plane import Plane, dominant_plane

Bytes = NDArray[np.uint8]
LEVELS = ((213, 94, 0), (240, 228, 66), (86, 180, 233), (0, 114, 178))
"""Vermilion, yellow, sky blue, blue: the finest level first.  Points of coarser levels are larger, too."""
RADII = (1.0, 1.4, 2.0, 2.8)
TRAIL = (0, 158, 115)
GRID, HOUSE = (255, 255, 255), (230, 159, 0)
STATES = {WAITING: (107, 107, 107), START: (0, 158, 115), GOOD: (0, 114, 178), POOR: (230, 159, 0),
          LOST: (213, 94, 0)}  # fmt: skip
"""Colour of the strip at the bottom."""
ABSENT = (107, 107, 107)
"""Of a picture that could not be used."""
RATES = (1.0, 60.0)
"""Pictures a second that a film may have."""
SHARE = 0.75
"""Of the plane's points, that lie inside the grid's inner circle."""


class Stage(NamedTuple):
    """What stands in the world: the plane's frame ``T_plane_world`` and a cell's side, in the map's unit."""

    T_plane_world: Array
    cell: float


def find_plane(run: Run) -> Plane | None:
    """The plane of the final map; None without a map."""
    visual_map = run.system.map
    if visual_map is None:
        return None
    rng = np.random.default_rng(run.settings.seed)
    return dominant_plane(visual_map.X_world[visual_map.alive], rng)


def stage_on(run: Run, plane: Plane | None) -> Stage | None:
    """Grid and house on a plane, as large as its points reach; None without a plane."""
    visual_map = run.system.map
    if plane is None or plane.reason or visual_map is None:
        return None
    X = se3.act(plane.T_plane_world, visual_map.X_world[visual_map.alive][plane.inliers])
    reach = float(np.quantile(np.hypot(X[:, 0], X[:, 1]), SHARE))
    return Stage(plane.T_plane_world, 2 * reach / solids.CELLS)


def film(
    target: Path,
    run: Run,
    size: str,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[], object] = lambda: None,
) -> int:
    """Write the film of a run; return the number of its pictures.

    Parameters
    ----------
    target : Path
        A WebM file.
    run : Run
    size : {"small", "half", "full"}
        As :func:`vslam_ref.datasets.video.webm`.
    stop : callable
        Asked before each picture; true ends the film there.
    progress : callable
        Called after each picture.
    """
    poses = dict(zip(*(values for values in path(run)), strict=True))
    stage = stage_on(run, find_plane(run))
    count = 0
    with video.webm(target, size, rate(run)) as add:
        for frame in run.frames:
            if stop():
                break
            add(picture(run, frame, poses.get(frame.number), stage, line_width(run, size)))
            count += 1
            progress()
    return count


def rate(run: Run) -> float:
    """Pictures a second, so that the film lasts as long as what it shows."""
    step = np.diff([frame.time for frame in run.frames])
    step = step[step > 0]
    return float(np.clip(1 / np.median(step), *RATES)) if len(step) else 10.0


def line_width(run: Run, size: str) -> float:
    """Pixels of the picture that a thin line must have, to be seen after the film was shrunk."""
    width = run.sequence.size[0]
    shown = {"small": video.SMALL, "half": width / 2, "full": width}[size]
    return max(width / shown, width / 640, 1.0)


def picture(run: Run, frame: Frame, T_cam_world: Array | None, stage: Stage | None, unit: float) -> Bytes:
    """One picture of the film, (H, W, 3).

    Parameters
    ----------
    run : Run
    frame : Frame
    T_cam_world : ndarray, shape (4, 4), or None
        Without a pose no stage is drawn.
    stage : Stage or None
    unit : float
        Width of a thin line, pixels.
    """
    width, height = run.sequence.size
    source = run.sequence.image(frame.number)
    if source.grey is None:
        return np.full((height, width, 3), ABSENT, np.uint8)
    image = np.repeat(source.grey[..., None], 3, -1) if source.colour is None else source.colour.copy()
    camera = None if run.system.map is None else run.system.map.camera  # as it was refined
    if T_cam_world is not None and stage is not None and camera is not None:
        draw_stage(image, view_of(camera, (width, height), T_cam_world, stage), stage.cell, unit)
    draw_marks(image, frame, unit)
    image[height - int(np.ceil(3 * unit)) :] = STATES.get(frame.state, ABSENT)
    return image


def view_of(camera: Camera, size: tuple[int, int], T_cam_world: Array, stage: Stage) -> solids.SolidView:
    """The stage as a camera at a pose (4, 4) sees it."""
    return solids.SolidView(camera, size, se3.compose(T_cam_world, se3.inverse(stage.T_plane_world)))


def draw_stage(image: Bytes, view: solids.SolidView, cell: float, unit: float) -> None:
    """Draw the grid, and the house on it, by the camera's projection."""
    uv, seen = view.pixels(solids.grid(cell))
    raster.lines(image, uv[seen.all(1)], GRID, 0.5 * unit, 0.6)
    eye = view.eye
    for face in solids.faces_towards(solids.house(cell), eye):
        corners, seen = view.pixels(face.corners)
        if not seen.all():
            continue
        colour = tuple(round(face.light * c) for c in HOUSE)
        raster.area(image, corners, colour, 0.9)  # type: ignore[arg-type]
        edges = np.stack([corners, np.roll(corners, -1, 0)], 1)
        raster.lines(image, edges, (0, 0, 0), 0.5 * unit)


def draw_marks(image: Bytes, frame: Frame, unit: float) -> None:
    """Draw the points of each level in its colour, the finest first, and the trails before there is a map."""
    uv, level, first = frame.marks
    if first is not None:
        raster.lines(image, np.stack([first, uv], 1).astype(np.float64), TRAIL, 0.5 * unit)
    for number, (colour, radius) in enumerate(zip(LEVELS, RADII, strict=True)):
        raster.dots(image, uv[level == number].astype(np.float64), colour, radius * unit)
