"""Readers of trajectories; every malformation is one line with file and line number."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.text import Columns, FormatError, number, read_columns, read_lines
from vslam_ref.datasets.trajectories.formats import (
    EUROC,
    EUROC_EXTRA,
    KITTI,
    TUM,
    AsRead,
    TrajectoryFile,
    matrices,
    seconds,
)
from vslam_ref.metrics.trajectory.poses import Trajectory

UNIT_TOLERANCE = 1e-3
"""Four decimals of a quaternion move its length by 1e-4 at most, four of a matrix R^T R by 2e-4."""

LONGEST = 1e12
"""Metres; a position must be smaller (the solar system is)."""


def read(path: Path, format: str | None = None) -> TrajectoryFile:
    """Read a trajectory.

    Parameters
    ----------
    path : Path
        Plain text or ``.gz``.
    format : {"tum", "kitti", "euroc"}, optional
        By default found from the first line: commas are EuRoC, 8 columns TUM, 12 KITTI.

    Raises
    ------
    FormatError
        Where a file does not have the format above, with file and line.
    ValueError
        If there is no such format.
    """
    chosen = detect(path) if format is None else format
    if chosen not in READERS:
        raise ValueError(f"trajectory format {chosen!r}: need one of {', '.join(READERS)}")
    return READERS[chosen](path)


def detect(path: Path) -> str:
    """Find the format from the first line that is not a comment.

    Raises
    ------
    FormatError
        If it fits no format, or there is no such line.
    """
    for line, text in read_lines(path):
        if "," in text:
            return "euroc"
        columns = len(text.split())
        for name, names in (("tum", TUM), ("kitti", KITTI)):
            if columns == len(names):
                return name
        right = "expected 8 (TUM), 12 (KITTI), or 8 with commas (EuRoC)"
        raise FormatError(path, line, f"{columns} columns; {right}")
    raise FormatError(path, None, "no data; expected one pose a line (TUM, KITTI or EuRoC)")


def read_tum(path: Path) -> TrajectoryFile:
    """Read ``time tx ty tz qx qy qz qw``; see :func:`read`."""
    table = read_columns(path, TUM)
    repeated = _require_times(table)
    q = table.values[:, [7, 4, 5, 6]]
    R, unit_error = _rotations(table, q)
    trajectory = Trajectory(table.values[:, 0], _positions(table, (1, 2, 3)), R)
    return TrajectoryFile(trajectory, "tum", AsRead(q), unit_error, repeated)


def read_kitti(path: Path) -> TrajectoryFile:
    """Read twelve numbers a line; see :func:`read`.  The matrices stay as they stand there."""
    table = read_columns(path, KITTI)
    R = table.values.reshape(-1, 3, 4)[:, :, :3].copy()
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is not a rotation either
        off = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max((1, 2))
        off[np.linalg.det(R) < 0] = 2.0  # a mirror
    table.require(
        off <= UNIT_TOLERANCE,
        lambda k: (
            f"not a rotation matrix (R^T R is {off[k]:.3g} off the identity, or det R < 0); "
            "expected 12 numbers of one pose, row by row"
        ),
    )
    trajectory = Trajectory(None, _positions(table, (3, 7, 11)), R)
    return TrajectoryFile(trajectory, "kitti", AsRead(), float(off.max()), 0)


def read_euroc(path: Path) -> TrajectoryFile:
    """Read ``time,tx,ty,tz,qw,qx,qy,qz`` with whole nanoseconds; see :func:`read`."""
    stamps: list[int] = []
    rows: list[list[float]] = []
    lines: list[int] = []
    for line, text in read_lines(path):
        words = [word.strip() for word in text.split(",")]
        names = EUROC if len(words) == len(EUROC) else EUROC + EUROC_EXTRA
        if len(words) != len(names):
            what = f"{len(words)} columns; expected 8: {', '.join(EUROC)} (or these and 9 more)"
            raise FormatError(path, line, what)
        stamps.append(nanoseconds(path, line, words[0]))
        values = [number(path, line, word, name) for word, name in zip(words[1:], names[1:], strict=True)]
        rows.append([0.0, *values[:7]])
        lines.append(line)
    if not rows:
        raise FormatError(path, None, f"no data; expected lines of {','.join(EUROC)}")
    ns = np.array(stamps, dtype=np.int64)
    table = Columns(path, np.array(rows), np.array(lines))
    table.values[:, 0] = seconds(ns)
    repeated = _require_times(table, ns)
    q = table.values[:, 4:8].copy()
    R, unit_error = _rotations(table, q)
    trajectory = Trajectory(table.values[:, 0], _positions(table, (1, 2, 3)), R)
    return TrajectoryFile(trajectory, "euroc", AsRead(q, ns), unit_error, repeated)


READERS = {"tum": read_tum, "kitti": read_kitti, "euroc": read_euroc}


def nanoseconds(path: Path, line: int, word: str) -> int:
    """Read whole nanoseconds, or raise :class:`FormatError`."""
    if not re.fullmatch(r"-?[0-9]{1,18}|-?[0-8][0-9]{18}", word):
        what = f"time [ns] is {word!r}; expected whole nanoseconds below 9e18 (a header begins with #)"
        raise FormatError(path, line, what)
    return int(word)


def _positions(table: Columns, columns: tuple[int, int, int]) -> Array:
    positions: Array = table.values[:, columns].copy()
    far = np.abs(positions) >= LONGEST
    axis = np.argmax(far, axis=1)
    table.require(
        ~np.any(far, axis=1),
        lambda k: f"t{'xyz'[axis[k]]} is {positions[k, axis[k]]:g} m; expected less than {LONGEST:g}",
    )
    return positions


def _require_times(table: Columns, exact: IntArray | None = None) -> int:
    """Count times that repeat the one above; refuse times that go back."""
    times = table.values[:, 0]
    step = np.diff(times if exact is None else exact)
    after = np.concatenate([[1], step])
    table.require(
        after >= 0, lambda k: f"time {times[k]:.9f} s after {times[k - 1]:.9f} s; times must not go back"
    )
    return int((after == 0).sum())


def _rotations(table: Columns, q: Array) -> tuple[Array, float]:
    """Rotation matrices (N, 3, 3) of quaternions wxyz (N, 4), and the worst length's distance from 1."""
    with np.errstate(over="ignore"):
        length = np.linalg.norm(q, axis=1)
    off = np.abs(length - 1.0)
    table.require(
        off <= UNIT_TOLERANCE,
        lambda k: f"quaternion of length {length[k]:.6g}; expected 1 within {UNIT_TOLERANCE:g}",
    )
    return matrices(q), float(off.max())
