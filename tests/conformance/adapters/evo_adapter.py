"""evo under the vectors, through its commands only.

evo is free software under the GPL; it is started as a program, beside us, and never imported.  Each question
writes trajectories to a folder of its own, calls ``evo_ape``, ``evo_rpe`` or ``evo_traj``, and reads the
files that these write: about two seconds a question.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers, answer_from

Array = NDArray[np.float64]
SECONDS = 120.0


def answer(function: str, inputs: dict[str, Any]) -> Any:
    """Answer one question with evo."""
    return answer_from(TABLE, function, inputs)


def _run(folder: Path, command: str, *words: str) -> str:
    """Start a command of evo in a folder, which is its home, too: it keeps its settings there."""
    program = shutil.which(command)
    if program is None:
        raise NotImplementedError(f"{command} is not installed")
    surroundings = {**os.environ, "HOME": str(folder), "MPLBACKEND": "Agg", "NO_COLOR": "1"}
    done = subprocess.run(
        [program, *words], cwd=folder, env=surroundings, capture_output=True, text=True, timeout=SECONDS
    )
    if done.returncode != 0:
        lines = (done.stdout + done.stderr).strip().splitlines()
        raise ValueError(f"{command}: {lines[-1] if lines else done.returncode}")
    return done.stdout


def _kitti(path: Path, T: Array) -> None:
    np.savetxt(path, T[:, :3].reshape(-1, 12), fmt="%.17g")


def _poses(positions: Array) -> Array:
    T = np.tile(np.eye(4), (len(positions), 1, 1))
    T[:, :3, 3] = positions
    return T


def _statistics(folder: Path, command: str, estimate: Array, truth: Array, *words: str) -> dict[str, Any]:
    """Numbers that a comparison saves: its statistics, and the alignment where there is one."""
    _kitti(folder / "estimate.txt", estimate)
    _kitti(folder / "truth.txt", truth)
    files = ["kitti", "truth.txt", "estimate.txt", "--save_results", "r.zip", "--no_warnings"]
    _run(folder, command, *files, *words)
    with zipfile.ZipFile(folder / "r.zip") as saved:
        found: dict[str, Any] = json.loads(saved.read("stats.json"))
        for name in saved.namelist():
            if name.startswith("alignment_transformation"):
                found["alignment"] = np.load(io.BytesIO(saved.read(name)), allow_pickle=False)
    return found


def _ate(estimate: Array, truth: Array, align: str) -> dict[str, float]:
    words = {"none": [], "se3": ["--align"], "sim3": ["--align", "--correct_scale"]}[align]
    with tempfile.TemporaryDirectory() as folder:
        found = _statistics(Path(folder), "evo_ape", _poses(estimate), _poses(truth), *words)
    scale = float(np.cbrt(np.linalg.det(found["alignment"][:3, :3]))) if align == "sim3" else 1.0
    return {**{key: found[key] for key in ("rmse", "mean", "median", "max")}, "scale": scale}


def _rpe(estimate: Array, truth: Array) -> dict[str, float]:
    step = ["--delta", "1", "--delta_unit", "f"]
    with tempfile.TemporaryDirectory() as folder:
        moved = _statistics(Path(folder), "evo_rpe", estimate, truth, *step, "-r", "trans_part")
    with tempfile.TemporaryDirectory() as folder:
        turned = _statistics(Path(folder), "evo_rpe", estimate, truth, *step, "-r", "angle_deg")
    return {"trans_rmse": moved["rmse"], "rot_rmse_deg": turned["rmse"]}


def _tum(text: str) -> dict[str, Any]:
    """Read and written again by ``evo_traj``."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "file.txt").write_text(text, encoding="utf-8")
        _run(folder, "evo_traj", "tum", "file.txt", "--save_as_tum", "--no_warnings")
        rows = np.loadtxt(folder / "file.tum", ndmin=2)
    return {"times": rows[:, 0], "t": rows[:, 1:4], "q": rows[:, [7, 4, 5, 6]]}


def _kitti_file(text: str) -> Array:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "file.txt").write_text(text, encoding="utf-8")
        _run(folder, "evo_traj", "kitti", "file.txt", "--save_as_kitti", "--no_warnings")
        rows = np.loadtxt(folder / "file.kitti", ndmin=2)
    T = np.tile(np.eye(4), (len(rows), 1, 1))
    T[:, :3] = rows.reshape(-1, 3, 4)
    return T


TABLE: Answers = {
    "trajectory.ate": _ate,
    "trajectory.rpe": _rpe,
    "format.tum": _tum,
    "format.kitti": _kitti_file,
}
