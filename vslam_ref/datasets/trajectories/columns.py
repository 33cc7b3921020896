"""Which columns of a table are a pose, where its format is not given: by names, numbers of columns, times."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.text import FormatError, is_number
from vslam_ref.datasets.trajectories import telling
from vslam_ref.datasets.trajectories.formats import EUROC, TUM
from vslam_ref.datasets.trajectories.names import Layout
from vslam_ref.datasets.trajectories.rows import WordTable
from vslam_ref.datasets.trajectories.stamps import is_whole, unit_of

UNIT_TOLERANCE = 1e-3
"""Four decimals of a quaternion move its length by 1e-4 at most, four of a matrix R^T R by 2e-4."""
WIDE = (8, 11, 17)
"""Columns of known files with commas: pose; with velocity (VINS); with velocity and biases (EuRoC)."""
ORDERS = {"tum": (1, 2, 3, 7, 4, 5, 6), "euroc": (1, 2, 3, 4, 5, 6, 7)}
"""Columns of tx, ty, tz, qw, qx, qy, qz."""
LOOKED_AT = 50
"""Lines that are looked at to see what the columns are."""


def format_of(rows: WordTable) -> str:
    """Return the format of a table: by its header, else by the number of columns, separators and times.

    Raises
    ------
    FormatError
        If it fits no format.
    """
    if rows.header is None:
        count = len(rows.words[0])
        if count in (12, 16) and is_matrix(rows, count):
            return "kitti"
        if count < len(TUM):
            right = "expected 8 (TUM), 12 (KITTI), or 8 with commas (EuRoC)"
            why = _short(count) if is_number(rows.words[0][0]) else ""
            raise FormatError(rows.path, rows.lines[0], f"{count} columns; {right}{why}")
    if not rows.commas or (rows.header is not None and len(rows.header.time) == 2):
        return "tum"
    column = rows.header.time[0] if rows.header else 0
    words = [row[column] for row in rows.words]
    usual = "ns" if all(map(is_whole, words[:LOOKED_AT])) else "s"
    stated = rows.header.unit if rows.header else None
    known = [float(word) for word in words if is_whole(word)]
    unit = stated or (unit_of(np.array(known), usual) if known else usual)
    return "euroc" if unit == "ns" else "tum"


def _short(count: int) -> str:
    """What may be wrong with a line of few columns."""
    if count == 7:
        return "; is the time missing?"
    if count in (3, 4):
        return "; positions alone are no poses: add 0 0 0 1 where the rotation is not known"
    return ""


def is_matrix(rows: WordTable, count: int) -> bool:
    """Whether the first line that can be read has a rotation's numbers, and, of 16, the last row 0 0 0 1."""
    values = _known(rows, range(count))
    if values is None:
        return True
    if count == 16 and values[12:].tolist() != [0, 0, 0, 1]:
        return False
    R = values[:12].reshape(3, 4)[:, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        return (
            bool(np.abs(R.T @ R - np.eye(3)).max() < 0.5)
            or not abs(_length(values[4:8]) - 1) < UNIT_TOLERANCE
        )


def _known(rows: WordTable, columns: range | tuple[int, ...]) -> Array | None:
    """The numbers in some columns of the first line in which all can be read."""
    for words in rows.words[:LOOKED_AT]:
        try:
            values = np.array([float(words[k]) for k in columns])
        except ValueError:
            continue
        if np.isfinite(values).all() and values[-4:].any():
            return values
    return None


def _length(q: Array) -> float:
    with np.errstate(over="ignore"):
        return float(np.linalg.norm(q))


def pose_columns(rows: WordTable, format: str) -> tuple[Layout, tuple[str, ...]]:
    """Return the columns of a pose, and what is to be told about them.

    They are those of the header, else the usual ones; a number of the pose may stand before them.

    Raises
    ------
    FormatError
        If there are too few.
    """
    if rows.header is not None:
        return rows.header, ()
    count, names = len(rows.words[0]), EUROC if format == "euroc" else TUM
    if count < len(names):
        what = f"{count} columns; expected {len(names)}: {', '.join(names)}{_short(count)}"
        raise FormatError(rows.path, rows.lines[0], what)
    pose = ORDERS[format]
    if count in (WIDE if rows.commas else WIDE[:1]):
        return Layout((0,), pose), ()
    first = 0
    for start in (0, 1) if is_whole(rows.words[0][0]) else (0,):
        values = _known(rows, tuple(k + start for k in pose))
        if values is not None and abs(_length(values[3:]) - 1) < UNIT_TOLERANCE:
            first = start
            break
    told = telling.passed_over(count, first, names)
    return Layout((first,), tuple(k + first for k in pose)), (told,)
