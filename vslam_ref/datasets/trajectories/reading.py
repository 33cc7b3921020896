"""Readers of trajectories; every malformation is one line with file and line number, every oddity a note."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.text import Columns, FormatError, number
from vslam_ref.datasets.trajectories import telling
from vslam_ref.datasets.trajectories.columns import UNIT_TOLERANCE, format_of, is_matrix, pose_columns
from vslam_ref.datasets.trajectories.formats import KITTI, AsRead, TrajectoryFile, matrices
from vslam_ref.datasets.trajectories.rows import CUT, WordTable, is_lost, read_rows
from vslam_ref.datasets.trajectories.stamps import read_stamps
from vslam_ref.metrics.trajectory.poses import Trajectory

LONGEST = 1e12
"""Metres; a position must be smaller (the solar system is)."""


def read(path: Path, format: str | None = None) -> TrajectoryFile:
    """Read a trajectory.

    Parameters
    ----------
    path : Path
        Plain text or ``.gz``.
    format : {"tum", "kitti", "euroc"}, optional
        By default found from the first line: 12 columns are KITTI; else commas and whole nanoseconds EuRoC,
        anything else TUM.

    Raises
    ------
    FormatError
        Where a file does not have the format above, with file and line.
    ValueError
        If there is no such format.
    """
    if format is not None and format not in READERS:
        raise ValueError(f"trajectory format {format!r}: need one of {', '.join(READERS)}")
    rows = read_rows(path)
    chosen = format_of(rows) if format is None else format
    return _read_kitti(rows) if chosen == "kitti" else _read_poses(rows, chosen)


def detect(path: Path) -> str:
    """Find the format from the columns and the times.

    Raises
    ------
    FormatError
        If it fits no format, or there is no data.
    """
    return format_of(read_rows(path))


def read_tum(path: Path) -> TrajectoryFile:
    """Read ``time tx ty tz qx qy qz qw``, or the order that a header tells; see :func:`read`."""
    return _read_poses(read_rows(path), "tum")


def read_kitti(path: Path) -> TrajectoryFile:
    """Read twelve numbers a line; see :func:`read`.  The matrices stay as they stand there."""
    return _read_kitti(read_rows(path))


def read_euroc(path: Path) -> TrajectoryFile:
    """Read ``time,tx,ty,tz,qw,qx,qy,qz`` with whole nanoseconds; see :func:`read`."""
    return _read_poses(read_rows(path), "euroc")


READERS = {"tum": read_tum, "kitti": read_kitti, "euroc": read_euroc}


def nanoseconds(path: Path, line: int, word: str) -> int:
    """Read whole nanoseconds, or raise :class:`FormatError`."""
    if not re.fullmatch(r"-?[0-9]{1,18}|-?[0-8][0-9]{18}", word):
        what = f"time [ns] is {word!r}; expected whole nanoseconds below 9e18 (a header begins with #)"
        raise FormatError(path, line, what)
    return int(word)


def _read_poses(rows: WordTable, format: str) -> TrajectoryFile:
    """Poses with times: lost ones left out, in the order of time."""
    layout, odd = pose_columns(rows, format)
    kept = [k for k, words in enumerate(rows.words) if not _lost(words, layout.pose)]
    lost = sorted(set(rows.lines) - {rows.lines[k] for k in kept})
    if not kept:
        raise _no_pose(rows)
    lines = [rows.lines[k] for k in kept]
    values = _numbers(rows, kept, layout.pose, ("tx", "ty", "tz", "qw", "qx", "qy", "qz"))
    usual = layout.unit or ("ns" if format == "euroc" else "s")
    words = [[rows.words[k][c] for c in layout.time] for k in kept]
    stamps = read_stamps(rows.path, lines, words, usual, layout.unit is not None)
    key = stamps.times if stamps.nanoseconds is None else stamps.nanoseconds
    order = np.argsort(key, kind="stable")
    table = Columns(rows.path, values, np.array(lines))
    positions, (R, unit_error) = _positions(table, (0, 1, 2)), _rotations(table, values[:, 3:], rows.cut)
    repeated = np.flatnonzero(np.diff(key[order]) == 0) + 1
    notes = (
        *rows.notes,
        *odd,
        *telling.unit(stamps.unit, usual),
        *telling.lost(lost, len(rows.words)),
        *telling.falling(stamps.times, table.lines),
        *telling.doubled(table.lines[order[repeated]], len(kept)),
        *telling.lengths(unit_error),
    )
    trajectory = Trajectory(stamps.times[order], positions[order], R[order])
    ns = None if stamps.nanoseconds is None else stamps.nanoseconds[order]
    as_read = AsRead(values[order, 3:], ns)
    places, w_first = np.array(kept)[order], layout.pose[3] < layout.pose[4]
    return TrajectoryFile(
        trajectory, format, as_read, unit_error, len(repeated), notes, places, len(rows.words), w_first
    )


def _read_kitti(rows: WordTable) -> TrajectoryFile:
    """Matrices, line by line."""
    count = len(rows.words[0])
    if count not in (12, 16) or (count == 16 and not is_matrix(rows, count)):
        raise FormatError(rows.path, rows.lines[0], f"{count} columns; expected 12: {', '.join(KITTI)}")
    kept = [k for k, words in enumerate(rows.words) if not _lost(words, range(12))]
    if not kept:
        raise _no_pose(rows)
    values = _numbers(rows, kept, range(12), KITTI)
    table = Columns(rows.path, values, np.array([rows.lines[k] for k in kept]))
    R = values.reshape(-1, 3, 4)[:, :, :3].copy()
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
    gone = sorted(set(rows.lines) - set(table.lines.tolist()))
    notes = (
        *rows.notes,
        *(["16 columns: the last four, 0 0 0 1, are not read"] if count == 16 else []),
        *telling.lost(gone, len(rows.words)),
        *telling.matrices(float(off.max())),
    )
    trajectory = Trajectory(None, _positions(table, (3, 7, 11)), R)
    return TrajectoryFile(
        trajectory, "kitti", AsRead(), float(off.max()), 0, notes, np.array(kept), len(rows.words)
    )


def _no_pose(rows: WordTable) -> FormatError:
    what = f"no pose in {len(rows.words)} lines: none has finite numbers"
    return FormatError(rows.path, rows.lines[0], what)


def _lost(words: list[str], columns: range | tuple[int, ...]) -> bool:
    """Whether a line is of a frame without a pose: a number that is none, or a rotation of zeros only.

    TUM's own program leaves out such lines, too.
    """
    if any(is_lost(words[k]) for k in columns):
        return True
    rotation = columns[3:] if len(columns) == 7 else [k for k in columns if k % 4 != 3]
    return all(re.fullmatch(r"[-+]?0*\.?0*([eE][-+]?\d+)?", words[k]) for k in rotation)


def _numbers(
    rows: WordTable, kept: list[int], columns: range | tuple[int, ...], names: tuple[str, ...]
) -> Array:
    """Numbers of some lines and columns, all finite."""
    return np.array([
        [number(rows.path, rows.lines[k], rows.words[k][c], name)
         for c, name in zip(columns, names, strict=True)]
        for k in kept
    ])  # fmt: skip


def _positions(table: Columns, columns: tuple[int, int, int]) -> Array:
    positions: Array = table.values[:, columns].copy()
    far = np.abs(positions) >= LONGEST
    axis = np.argmax(far, axis=1)
    table.require(
        ~np.any(far, axis=1),
        lambda k: f"t{'xyz'[axis[k]]} is {positions[k, axis[k]]:g} m; expected less than {LONGEST:g}",
    )
    return positions


def _rotations(table: Columns, q: Array, cut: int) -> tuple[Array, float]:
    """Rotation matrices (N, 3, 3) of quaternions wxyz (N, 4), and the worst length's distance from 1.

    ``cut`` is the number of a line that the file's end may have cut, or 0.
    """
    with np.errstate(over="ignore"):
        length = np.linalg.norm(q, axis=1)
    off = np.abs(length - 1.0)
    table.require(
        off <= UNIT_TOLERANCE,
        lambda k: (
            f"quaternion of length {length[k]:.6g}; expected 1 within {UNIT_TOLERANCE:g}"
            f"{CUT if table.lines[k] == cut else ''}"
        ),
    )
    return matrices(q), float(off.max())
