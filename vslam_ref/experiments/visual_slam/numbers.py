"""The numbers of a run: counts, errors against the truth, times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from vslam_ref import _kernels
from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.sequences import Sequence
from vslam_ref.experiments.visual_slam.camera import camera_notes, camera_numbers
from vslam_ref.experiments.visual_slam.kinds import KINDS
from vslam_ref.experiments.visual_slam.paths import LEAST_THIRD, scale_drift, trajectory
from vslam_ref.experiments.visual_slam.running import (
    GOOD,
    LOST,
    POOR,
    START,
    UNUSABLE,
    WAITING,
    Frame,
    Run,
    path,
)
from vslam_ref.geometry.alignment import Alignment
from vslam_ref.metrics.trajectory import MAX_DIFFERENCE, Trajectory, absolute_error, associate, no_pairs
from vslam_ref.support.config import assumptions
from vslam_ref.support.provenance import versions

ROWS = (
    ("frames", "pictures", ""),
    ("unusable", "pictures that could not be used", ""),
    ("started_at", "the two pictures of the start", ""),
    ("tracked", "pictures with a pose", ""),
    ("lost", "pictures lost after the start", ""),
    ("relocalised", "pictures found again by a keyframe", ""),
    ("keyframes", "keyframes", ""),
    ("points", "points in the map", ""),
    ("ate_rmse", "ATE of the final path, RMSE after a similarity", "truth's unit"),
    ("ate_percent", "the same, of the true path's length", "%"),
    ("ate_live_rmse", "ATE of the live path", "truth's unit"),
    ("scale_drift", "scale of the last third over that of the first", ""),
    ("camera_shift_px", "shift of a pixel by the refined camera: largest, RMS", "px"),
    ("fps", "pictures a second, tracking and mapping", "1/s"),
    ("seconds", "time of the run, with reading and drawing", "s"),
)
"""Key in the JSON, words and unit in the table."""
COUNTS = 8
"""Rows before which a system's own stand."""


class Accuracy(NamedTuple):
    """A path against the truth; None where it cannot be told, and then why.

    Attributes
    ----------
    rmse, percent, drift : float or None
        ATE, in the truth's unit and of the true path's length; scale S_truth_map of the last third over that
        of the first.
    alignment : Alignment or None
        S_truth_map.
    truth : ndarray, shape (n, 3)
        True positions that were paired.
    reason : str
    """

    rmse: float | None
    percent: float | None
    drift: float | None
    alignment: Alignment | None
    truth: Array
    reason: str


def accuracy(sequence: Sequence, numbers: IntArray, T_cam_world: Array) -> Accuracy:
    """Compare poses ``T_cam_world`` (n, 4, 4) of the pictures ``numbers`` (n,) with the truth."""
    nothing = Accuracy(None, None, None, None, np.zeros((0, 3)), "")
    if sequence.truth is None:
        return nothing
    pairs = sequence.pairs()
    rows = {int(number): row for row, number in enumerate(numbers)}
    both = [(rows[int(a)], int(b)) for a, b in zip(*pairs, strict=True) if int(a) in rows]
    if len(both) < LEAST_THIRD:
        what = f"{len(both)} pictures have a pose and a true pose: need {LEAST_THIRD}"
        return nothing._replace(reason=_clocks(sequence, numbers, T_cam_world) or what)
    mine, theirs = np.array(both).T
    estimate, truth = trajectory(None, T_cam_world[mine]), sequence.truth.take(theirs)
    truth = Trajectory(None, truth.t_world_body, truth.R_world_body)
    try:
        found = absolute_error(estimate, truth, "sim3")
    except ValueError as error:
        return nothing._replace(reason=str(error))
    length = float(np.linalg.norm(np.diff(truth.t_world_body, axis=0), axis=1).sum())
    percent = 100 * found.stats.rmse / length if length > 0 else None
    drift = scale_drift(estimate, truth)
    return Accuracy(found.stats.rmse, percent, drift, found.alignment, truth.t_world_body, "")


def _clocks(sequence: Sequence, numbers: IntArray, T_cam_world: Array) -> str:
    """Why poses that were found have no true one: what their times say, in the words of ``evaluate``."""
    truth = sequence.truth
    if len(numbers) < LEAST_THIRD or truth is None or truth.times is None:
        return ""
    estimate = trajectory(sequence.times[numbers], T_cam_world)
    assert estimate.times is not None
    pairs = associate(estimate.times, truth.times)
    if len(pairs.truth) >= LEAST_THIRD:
        return ""
    told = no_pairs(estimate, truth, pairs, MAX_DIFFERENCE, options=False)
    falls = int((np.diff(sequence.times) < 0).sum())
    mend = f"; first mend the times of the pictures, which go back at {falls} of them"
    return told + mend if falls else told


def document(run: Run, seconds: float) -> dict[str, Any]:
    """Return everything that is printed, and written as JSON."""
    system, frames = run.system, run.frames
    count = Counter(frame.state for frame in frames)
    numbers, T = path(run)
    final, live = accuracy(run.sequence, numbers, T), accuracy(run.sequence, *path(run, live=True))
    visual_map = system.map
    return {
        "system": run.kind.name,
        "source": run.sequence.name,
        "frames": len(frames),
        "unusable": count[UNUSABLE],
        "started_at": system.started_at,
        "no_start": run.no_start(),
        "tracked": len(numbers),
        "lost": count[LOST],
        "relocalised": sum(f.way == "relocalised" and f.state != LOST for f in frames),
        "keyframes": 0 if visual_map is None else len(visual_map.used_keyframes()),
        "points": 0 if visual_map is None else int(visual_map.alive.sum()),
        **run.kind.counts(system),
        "ate_rmse": final.rmse,
        "ate_percent": final.percent,
        "ate_live_rmse": live.rmse,
        "scale_drift": final.drift,
        "camera_shift_px": None if system.refined is None else system.refined.shift._asdict(),
        "camera": camera_numbers(run),
        "fps": _rate(frames),
        "picture_ms": picture_ms(run),
        "stage_ms": stage_ms(run),
        "seconds": seconds,
        "interrupted": run.interrupted,
        "concurrent": run.concurrent,
        "start": _start(run),
        "refusals": {run.examples[kind]: n for kind, n in run.refusals.most_common()},
        "settings": changed(run.settings),
        "backend": _kernels.backend(),
        "versions": versions(),
        "notes": notes(run, final),
    }


def _rate(frames: list[Frame]) -> float | None:
    """Pictures after the start over the time they took."""
    times = [frame.seconds for frame in frames if frame.state in (GOOD, POOR, LOST)]
    return len(times) / sum(times) if times else None


def stage_ms(run: Run) -> dict[str, float]:
    """Median milliseconds of each stage over the pictures in which it had a part, of the processor."""
    times = {name: [f.stages[name] for f in run.frames if name in f.stages] for name in run.kind.stages}
    return {name: 1e3 * float(np.median(seconds)) for name, seconds in times.items() if seconds}


def picture_ms(run: Run) -> dict[str, float | None]:
    """Median milliseconds of a picture of each kind, and of the last adjustment, by the clock on the wall."""
    kinds: Mapping[str, list[float]] = {
        "before_start": [f.seconds for f in run.frames if f.state == WAITING],
        "start": [f.seconds for f in run.frames if f.state == START],
        "tracking": [f.seconds for f in run.frames if f.state in (GOOD, POOR, LOST) and not f.keyframe],
        "tracking_and_keyframe": [f.seconds for f in run.frames if f.state in (GOOD, POOR) and f.keyframe],
        "last_adjustment": [run.finish_seconds] if run.system.map is not None else [],
    }
    return {kind: 1e3 * float(np.median(s)) if s else None for kind, s in kinds.items()}


def _start(run: Run) -> dict[str, Any] | None:
    """What the start was judged by."""
    if run.start is None:
        return None
    found, limits = run.start, run.settings.start
    return {
        "cost": found.cost,
        "cost_limit": limits.cost,
        "parallax_deg": found.parallax,
        "points": int(found.good.sum()),
        "rivals": [{"answer": str(name), "cost": float(cost)} for name, cost in found.rivals],
    }


def changed(settings: Any) -> dict[str, dict[str, Any]]:
    """Settings that are not as they come: value and default."""
    rows = assumptions(settings, type(settings)())
    return {
        r["key"]: {"value": r["value"], "default": r["default"]} for r in rows if r["value"] != r["default"]
    }


def notes(run: Run, final: Accuracy) -> list[str]:
    """What a reader of the numbers should know."""
    told = list(run.sequence.notes)
    if len(run.frames) < len(run.sequence):
        told.append(f"interrupted after {len(run.frames)} of {len(run.sequence)} pictures")
    if run.filmed is not None and run.filmed < len(run.frames):
        told.append(f"the film was interrupted after {run.filmed} of {len(run.frames)} pictures")
    if (reason := run.no_start()) is not None:
        told.append(f"no start: {reason}")
    elif final.reason:
        told.append(f"no error against the truth: {final.reason}")
    return told + run.kind.notes(run.system) + camera_notes(run)


def number_rows(content: Mapping[str, Any]) -> list[list[str]]:
    """Rows of the table of numbers; what is not known is left out."""
    more = next(kind.rows for kind in KINDS if kind.name == content["system"])
    every = (*ROWS[:COUNTS], *more, *ROWS[COUNTS:])
    rows = [[words, _show(content[key]), unit] for key, words, unit in every if content[key] is not None]
    kinds = content["picture_ms"].items()
    rows += [[f"median, {kind.replace('_', ' ')}", _show(v), "ms"] for kind, v in kinds if v is not None]
    return rows + [[f"stage: {name}", _show(v), "ms of CPU"] for name, v in content["stage_ms"].items()]


def _show(value: Any) -> str:
    if isinstance(value, Mapping):
        value = tuple(value.values())
    if isinstance(value, tuple | list):
        return ", ".join(map(_show, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
