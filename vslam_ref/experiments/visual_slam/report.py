"""What ``vslam-ref run ptam`` and ``orbslam`` leave.

::

    OUT/result.json               the numbers that were printed
    OUT/trajectory.txt            TUM: every picture with a pose, through the last pose of its keyframe
    OUT/trajectory_live.txt       TUM: the poses as they were told when the pictures came
    OUT/keyframes.txt             TUM: the keyframes
    OUT/map.ply                   points in the grey of their pictures, keyframes as pyramids
    OUT/camera.yaml               with --refine-camera: the camera, with standard deviations
    OUT/overlay.webm              the pictures with what was tracked, a grid on the plane, a house on it
    OUT/map.png                   the map and the path from three sides
    OUT/course.png                tracking over the pictures
    OUT/stages.png                time per stage over the pictures
    OUT/report.html               the page

Without a start there are no paths and no map.  Poses are ``T_world_cam``; the world is the camera's frame at
the first picture of the start, and its unit the median depth there.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets import trajectories
from vslam_ref.datasets.bundle_files.ply import write_ply
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.datasets.calibration_files import write_opencv
from vslam_ref.experiments.visual_slam.camera import camera_file, camera_rows
from vslam_ref.experiments.visual_slam.numbers import Accuracy, accuracy, number_rows
from vslam_ref.experiments.visual_slam.overlay import find_plane
from vslam_ref.experiments.visual_slam.paths import trajectory
from vslam_ref.experiments.visual_slam.running import GOOD, LOST, POOR, WAITING, Run, path
from vslam_ref.geometry import camera_pose
from vslam_ref.plot.saving import figure_bytes
from vslam_ref.plot.visual_slam import (
    CourseDrawing,
    MapDrawing,
    StagesDrawing,
    course_figure,
    map_figure,
    stages_figure,
)
from vslam_ref.support import pages
from vslam_ref.support.files import write_text
from vslam_ref.support.json_text import to_json
from vslam_ref.systems.visual_map import KeyframeMap
from vslam_ref.systems.visual_map.adjusting import as_problem

FILM = "overlay.webm"
FILES = (
    *("trajectory.txt", "trajectory_live.txt", "keyframes.txt", "map.ply", "camera.yaml", FILM),
    "result.json",
)
LEGEND = (
    "Points that were tracked: vermilion, yellow, sky blue, blue (and larger) on levels 0, 1, 2, 3 of the "
    "pyramid (an octave of ORB counts as the level next to it); green lines before the start: how corners "
    "moved. White: a grid on the dominant plane of the map, on which a house stands. The strip at the "
    "bottom: grey without a map, green at the start, then blue good, orange poor, vermilion lost."
)

SPREAD = (
    "σ is the spread of the matches' errors, by their median; the tracker never takes it below "
    "{floor} px (tracker.least_sigma), so that a few exact matches do not outweigh all others."
)


def write_report(folder: Path, run: Run, content: Mapping[str, Any]) -> None:
    """Write all but the film into ``folder``."""
    title = f"{run.kind.title} on {Path(run.sequence.name).name}"
    figures = {"course": course_figure(course(run), title), "stages": stages_figure(stages(run), title)}
    visual_map = run.system.map
    if visual_map is not None:
        write_paths(folder, run, visual_map)
        write_map(folder / "map.ply", visual_map)
        final = accuracy(run.sequence, *path(run))
        figures = {"map": map_figure(scene(run, visual_map, final), title), **figures}
    if (found := camera_file(run)) is not None:
        write_opencv(folder / "camera.yaml", found)
    for name, figure in figures.items():
        (folder / f"{name}.png").write_bytes(figure_bytes(figure, "png", run.kind.name))
    write_text(folder / "result.json", to_json(content))
    write_text(folder / "report.html", page(folder, run, content, title, tuple(figures)))


def write_paths(folder: Path, run: Run, visual_map: KeyframeMap) -> None:
    """Write the three trajectories."""
    times = run.sequence.times
    used = visual_map.used_keyframes()
    paths = {
        "trajectory": path(run),
        "trajectory_live": path(run, live=True),
        "keyframes": (visual_map.keyframes["frame"][used], visual_map.T_kf_world[used]),
    }
    for name, (numbers, T_cam_world) in paths.items():
        trajectories.write(folder / f"{name}.txt", trajectory(times[numbers], T_cam_world), "tum")


def write_map(target: Path, visual_map: KeyframeMap) -> None:
    """Write the living points, each in the grey of the picture in which it was first seen."""
    whole = as_problem(visual_map)
    height, width = visual_map.shape
    colours = np.repeat(visual_map.greys(whole.points)[:, None], 3, axis=1)
    sizes = np.array([[width, height]])
    write_ply(target, BundleFile(whole.problem, colours=colours, image_sizes=sizes))


def scene(run: Run, visual_map: KeyframeMap, final: Accuracy) -> MapDrawing:
    """The map as it is drawn: in the frame of the truth where there is one."""
    numbers, T = path(run)
    gaps = np.flatnonzero(np.diff(numbers) > _step(run)) + 1
    way = np.insert(camera_pose.centre_from_pose(T), gaps, np.nan, axis=0)
    points, used = visual_map.X_world[visual_map.alive], visual_map.used_keyframes()
    kf = camera_pose.centre_from_pose(visual_map.T_kf_world[used])
    if final.alignment is None:
        return MapDrawing(points, kf, way, np.zeros((0, 3)), "median depth of the first picture", True)

    def moved(X: Array) -> Array:
        assert final.alignment is not None
        return np.where(np.isfinite(X), final.alignment.act(np.nan_to_num(X)), np.nan)

    return MapDrawing(moved(points), moved(kf), moved(way), final.truth, "unit of the truth", False)


def _step(run: Run) -> int:
    """Numbers from one picture of the sequence to the next."""
    numbers = run.sequence.numbers
    return int(numbers[1] - numbers[0]) if len(numbers) > 1 else 1


def course(run: Run) -> CourseDrawing:
    """Tracking over the pictures, as it is drawn."""
    frames = run.frames
    tried, found, sigma, seconds = np.array(
        [(f.tried, f.found, f.sigma, f.seconds) for f in frames], float
    ).reshape(-1, 4).T  # fmt: skip
    before = np.array([f.state == WAITING and f.tried > 0 for f in frames], bool)
    after = np.array([f.state in (GOOD, POOR, LOST) for f in frames], bool)
    return CourseDrawing(
        np.array([f.number for f in frames], np.int64),
        np.where(before, tried, np.nan),
        np.where(after, tried, np.nan),
        np.where(after, found, np.nan),
        sigma,
        1e3 * seconds,
        np.array([f.keyframe for f in frames], bool),
        np.array([f.state for f in frames], str),
    )


def stages(run: Run) -> StagesDrawing:
    """Time per stage, as it is drawn."""
    number = np.array([f.number for f in run.frames], np.int64)
    times = {
        name: np.array([1e3 * f.stages.get(name, 0.0) for f in run.frames])
        for name in run.kind.stages
        if any(name in f.stages for f in run.frames)
    }
    mapping = {name: ms for name, ms in times.items() if name in run.kind.mapping}
    return StagesDrawing(number, {n: ms for n, ms in times.items() if n not in run.kind.mapping}, mapping)


def page(folder: Path, run: Run, content: Mapping[str, Any], title: str, figures: tuple[str, ...]) -> str:
    """``report.html``: numbers and figures in it, the film beside it."""
    alt = {
        "map": "Map and path from three sides",
        "course": "Points, sigma, quality and time over pictures",
        "stages": "Time per stage over pictures",
    }
    images = [pages.image(_embedded(folder / f"{name}.png"), alt[name]) for name in figures]
    floor = run.settings.tracker.least_sigma
    there = {name: name for name in FILES if (folder / name).exists() or name == "result.json"}
    return pages.page(
        title,
        pages.tag("p", pages.tag("span", f"No start: {content['no_start']}.", class_="strong"))
        if content["no_start"]
        else "",
        _notes([note for note in content["notes"] if not note.startswith("no start:")]),
        _film(folder / FILM),
        pages.table([], number_rows(content), caption="Numbers", kind="numbers"),
        *images,
        pages.tag("p", SPREAD.format(floor=f"{floor:g}")),
        _camera(run),
        _start(content),
        _refusals(content["refusals"]),
        _plane(run),
        _changed(content["settings"]),
        pages.tag("p", pages.links(there, " ")),
    )


def _embedded(path: Path) -> str:
    return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def _notes(notes: list[str]) -> pages.Html | str:
    return pages.tag("ul", *(pages.tag("li", note) for note in notes)) if notes else ""


def _film(path: Path) -> pages.Html | str:
    """The film, if there is one."""
    if not path.exists():
        return ""
    film = pages.Html(f'<video src="{path.name}" controls muted loop playsinline></video><br>')
    return pages.tag("p", film, LEGEND)


def _camera(run: Run) -> pages.Html | str:
    """The camera as it was given and as it was refined."""
    rows = camera_rows(run)
    columns = ["", "given", "refined", "sigma", "unit"]
    return pages.table(columns, rows, caption="The camera", kind="plain") if rows else ""


def _start(content: Mapping[str, Any]) -> pages.Html | str:
    """By what the start was judged, and its rivals."""
    found = content["start"]
    if found is None:
        return ""
    first, last = content["started_at"]
    rows = [
        [f"pictures {first} and {last}: cost of a point", f"{found['cost']:.4g}", "px²"],
        ["largest cost that is a start", f"{found['cost_limit']:.4g}", "px²"],
        ["parallax, median", f"{found['parallax_deg']:.3g}", "degrees"],
        ["points", str(found["points"]), ""],
    ]
    rows += [[f"rival: {r['answer']}, cost of a point", f"{r['cost']:.4g}", "px²"] for r in found["rivals"]]
    return pages.table([], rows, caption="The start", kind="numbers")


def _refusals(refusals: Mapping[str, int]) -> pages.Html | str:
    if not refusals:
        return ""
    rows = [[reason, str(count)] for reason, count in refusals.items()]
    table = pages.table(["why there was no map yet, last of its kind", "pictures"], rows, kind="plain")
    return pages.details("Before the start", table)


def _plane(run: Run) -> pages.Html | str:
    plane = find_plane(run)
    if plane is None:
        return ""
    words = plane.reason or f"{int(plane.inliers.sum())} of {len(plane.inliers)} points lie on it"
    return pages.tag("p", f"Dominant plane: {words}.")


def _changed(settings: Mapping[str, Mapping[str, Any]]) -> pages.Html:
    """Settings that differ from the default."""
    if not settings:
        return pages.tag("p", "Every setting is the default.")
    rows = [[key, pages.shown(s["value"]), pages.shown(s["default"])] for key, s in settings.items()]
    return pages.table(
        ["setting", "value", "default"], rows, caption="Settings that were changed", kind="plain"
    )
