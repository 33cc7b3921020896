"""Chapter 23: errors of trajectories, and their files."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.datasets.trajectories.formats import AsRead, TrajectoryFile, matrices
from vslam_ref.datasets.trajectories.reading import read
from vslam_ref.datasets.trajectories.writing import to_text
from vslam_ref.geometry import se3
from vslam_ref.metrics.trajectory import Trajectory, absolute_error, relative_error

Array = NDArray[Any]


def _path(t: Array) -> Trajectory:
    return Trajectory(None, t, np.tile(np.eye(3), (len(t), 1, 1)))


def _ate(estimate: Array, truth: Array, align: str) -> dict[str, float]:
    found = absolute_error(_path(estimate), _path(truth), align)
    s = found.stats
    return {"rmse": s.rmse, "mean": s.mean, "median": s.median, "max": s.max, "scale": found.alignment.scale}


def _rpe(estimate: Array, truth: Array) -> dict[str, float]:
    guess, true = (Trajectory(None, se3.translation(T), se3.rotation(T)) for T in (estimate, truth))
    found = relative_error(guess, true)
    return {"trans_rmse": found.translation_stats.rmse, "rot_rmse_deg": found.rotation_stats_deg.rmse}


def _chain(steps: Array) -> Array:
    poses = [se3.identity()]
    for step in steps:
        poses.append(se3.compose(poses[-1], step))
    return np.stack(poses)


def _read(text: str, form: str) -> TrajectoryFile:
    """The readers take files, and read more than the formats allow; what they tell of is not the format."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trajectory.txt"
        path.write_text(text, encoding="utf-8")
        found = read(path, form)
    if found.notes:
        raise ValueError(found.notes[0])
    return found


def _tum(text: str) -> dict[str, Any]:
    found = _read(text, "tum")
    return {
        "times": found.trajectory.times,
        "t": found.trajectory.t_world_body,
        "q": found.as_read.quaternions,
    }


def _kitti(text: str) -> Array:
    path = _read(text, "kitti").trajectory
    return se3.from_rt(path.R_world_body, path.t_world_body)


def _write_tum(times: Array, t: Array, q: Array) -> str:
    return to_text(Trajectory(times, t, matrices(q)), "tum", AsRead(q))


TABLE: Answers = {
    "trajectory.ate": _ate,
    "trajectory.rpe": _rpe,
    "trajectory.chain": _chain,
    "format.tum": _tum,
    "format.kitti": _kitti,
    "format.write_tum": _write_tum,
}
