"""EuRoC's folders: nanoseconds, a body with a camera on it, and lists with commas."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets import trajectories
from vslam_ref.datasets.calibration_files import read_euroc
from vslam_ref.datasets.sequences import listing
from vslam_ref.datasets.text import FormatError, read_lines
from vslam_ref.datasets.trajectories.formats import seconds
from vslam_ref.datasets.trajectories.reading import nanoseconds
from vslam_ref.geometry import se3
from vslam_ref.metrics.trajectory import Trajectory


def read_image_list(folder: Path) -> tuple[Array, tuple[Path, ...]]:
    """Read ``data.csv`` of a camera's folder: lines ``nanoseconds,name``; the pictures lie in ``data/``.

    Returns
    -------
    ndarray, shape (N,), and tuple of Path
        Seconds, and where the pictures should be.

    Raises
    ------
    FormatError
        On a line that is not so, or no line at all.
    """
    path = folder / "data.csv"
    stamps, pictures = [], []
    for line, text in read_lines(path):
        words = [word.strip() for word in text.split(",")]
        if len(words) != 2:
            raise FormatError(path, line, f"{len(words)} columns; expected 2: time [ns], name of a picture")
        stamps.append(nanoseconds(path, line, words[0]))
        pictures.append(listing.inside(folder / "data", path, line, words[1]))
    if not pictures:
        raise FormatError(path, None, "no picture; expected lines of time [ns] and name")
    return seconds(np.array(stamps, dtype=np.int64)), tuple(pictures)


def read_truth(path: Path, sensor: Path) -> trajectories.TrajectoryFile:
    """Read the body's poses, and turn them into the camera's: T_world_cam = T_world_body T_body_cam.

    Raises
    ------
    FormatError
        If one of the files is malformed.
    """
    file = trajectories.read_euroc(path)
    body = file.trajectory
    T_cam_body = read_euroc(sensor).T_cam_rig
    if T_cam_body is None:  # the reader demands it
        raise FormatError(sensor, None, "no T_BS; expected the body from the sensor")
    T = se3.from_rt(body.R_world_body, body.t_world_body) @ se3.inverse(T_cam_body)
    return file._replace(trajectory=Trajectory(body.times, T[:, :3, 3], T[:, :3, :3]))
