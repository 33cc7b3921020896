"""Writers of trajectories: no digit is lost, and no half file is left."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.trajectories.formats import EUROC, FORMATS, TUM, AsRead, matrices, seconds
from vslam_ref.geometry import quaternion
from vslam_ref.metrics.trajectory.poses import Trajectory
from vslam_ref.support.files import write_bytes


def write(path: Path, trajectory: Trajectory, format: str, as_read: AsRead | None = None) -> None:
    """Write a trajectory in one step: readers of the file see the old content or the new.

    Parameters
    ----------
    path : Path
        Packed if it ends in ``.gz``.
    trajectory : Trajectory
    format : {"tum", "kitti", "euroc"}
        TUM and EuRoC need times.  KITTI has none: they are left out.
    as_read : AsRead, optional
        What the file held from which this very trajectory was read.

    Raises
    ------
    ValueError
        As :func:`to_text`.

    Notes
    -----
    Without ``as_read``, quaternions are computed from the matrices (right to a few eps), and EuRoC's times
    are rounded to whole nanoseconds.
    """
    write_bytes(path, to_text(trajectory, format, as_read).encode())


def to_text(trajectory: Trajectory, format: str, as_read: AsRead | None = None) -> str:
    """Return what :func:`write` writes.

    Raises
    ------
    ValueError
        If there is no such format, times are needed and missing, or ``as_read`` is of another trajectory.

    Examples
    --------
    >>> path = Trajectory(np.array([0.1]), np.array([[1.0, 2.0, 3.0]]), np.eye(3)[None])
    >>> print(to_text(path, "tum"), end="")
    # time tx ty tz qx qy qz qw
    0.1 1.0 2.0 3.0 0.0 0.0 0.0 1.0
    """
    if format not in FORMATS:
        raise ValueError(f"trajectory format {format!r}: need one of {', '.join(FORMATS)}")
    t, R = trajectory.t_world_body, trajectory.R_world_body
    if format == "kitti":
        return _join("", " ", np.concatenate([R, t[:, :, None]], 2).reshape(-1, 12).tolist())
    if trajectory.times is None:
        raise ValueError(
            f"a trajectory without times cannot be written as {format}: give it times, or use kitti"
        )
    q, ns = _verbatim(trajectory, trajectory.times, as_read or AsRead())
    if format == "tum":
        rows = np.column_stack([trajectory.times, t, q[:, [1, 2, 3, 0]]]).tolist()
        return _join(f"# {' '.join(TUM)}", " ", rows)
    rows = [[n, *row] for n, row in zip(ns.tolist(), np.column_stack([t, q]).tolist(), strict=True)]
    return _join(f"#{','.join(EUROC)}", ",", rows)


def _join(head: str, separator: str, rows: list[list[float]]) -> str:
    """Shortest digits that read back to the same double, which is what repr gives."""
    lines = [head] if head else []
    return "\n".join(lines + [separator.join(map(repr, row)) for row in rows]) + "\n"


def _verbatim(trajectory: Trajectory, times: Array, as_read: AsRead) -> tuple[Array, IntArray]:
    """Quaternions and nanoseconds to write: those of the file if they belong to these poses."""
    q, ns = as_read.quaternions, as_read.nanoseconds
    other = "as_read is of another trajectory: its {} differ; leave it out for changed poses"
    if q is None:
        q = quaternion.from_matrix(trajectory.R_world_body)
    elif len(q) != len(times) or np.abs(matrices(q) - trajectory.R_world_body).max() > 1e-12:
        raise ValueError(other.format("quaternions"))
    if ns is None:
        whole = np.floor(times)
        ns = whole.astype(np.int64) * 10**9 + np.rint((times - whole) * 1e9).astype(np.int64)
    elif len(ns) != len(times) or np.abs(seconds(ns) - times).max() > 0:
        raise ValueError(other.format("times"))
    return q, ns
