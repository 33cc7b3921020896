"""Writer of laser logs in CARMEN's text format."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.carmen.messages import TAIL
from vslam_ref.datasets.carmen.view import HALF_CIRCLE
from vslam_ref.support.files import write_text

NO_RETURN = 81.91
"""Metres; what is written for a beam that nothing came back of, as a SICK scanner says it."""


def write(path: Path, poses: Array, odometry: Array, ranges: Array, times: Array) -> None:
    """Write a log of a front laser, every number in full.

    Parameters
    ----------
    path : Path
    poses, odometry : ndarray, shapes (N, 3)
        (x, y, theta) of the laser in the world, and what the wheels say of the robot.
    ranges : ndarray, shape (N, B)
        Metres, at the angles of :func:`scanner` ``(B)``; what is not finite is written as :data:`NO_RETURN`.
    times : ndarray, shape (N,)
        Seconds.
    """
    beams = ranges.shape[1]
    readings = np.where(np.isfinite(ranges), ranges, NO_RETURN)
    lines = [f"# FLASER n r_1 ... r_n {' '.join(TAIL)}"]
    if beams not in HALF_CIRCLE:  # a number that does not say by itself where the beams look
        step = 180 / max(beams - beams % 2, 1)
        told = {"fov": 180.0, "resolution": step}
        lines += [f"PARAM laser_front_laser_{name} {value!r} simulated 0" for name, value in told.items()]
    for row, pose, wheels, time in zip(readings, poses, odometry, times.tolist(), strict=True):
        numbers = " ".join(map(repr, [*row.tolist(), *pose.tolist(), *wheels.tolist(), time]))
        lines.append(f"FLASER {beams} {numbers} simulated {time!r}")
    write_text(path, "\n".join(lines) + "\n")
