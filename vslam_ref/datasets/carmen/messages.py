"""The laser messages of a CARMEN log, word by word.

::

    FLASER n r_1 ... r_n  x y theta  odom_x odom_y odom_theta
    ROBOTLASER1 type start fov step max accuracy remission_mode n r_1 ... r_n  m e_1 ... e_m
                laser_x laser_y laser_theta  robot_x robot_y robot_theta  tv rv forward side axis
    RAWLASER1   type start fov step max accuracy remission_mode n r_1 ... r_n  m e_1 ... e_m
    ODOM x y theta tv rv acceleration

and after each ``ipc_time host logger_time``.  The angles of ROBOTLASER1 and RAWLASER1 are radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.carmen.view import LaserView, degrees
from vslam_ref.datasets.text import FormatError, is_number, number

MAX_BEAMS = 4096
"""More than any scanner has; a larger number is a damaged line."""
STAMP = ("ipc_time", "host", "logger_time")
TAIL = ("x", "y", "theta", "odom_x", "odom_y", "odom_theta", *STAMP)
HEAD = ("type", "start angle", "field of view", "resolution", "maximum range", "accuracy", "remission mode")
ROBOT = (
    *("laser_x", "laser_y", "laser_theta", "robot_x", "robot_y", "robot_theta"),
    *("tv", "rv", "forward", "side", "axis"),
    *STAMP,
)


class Scanned(NamedTuple):
    """One message: ``ranges (B,)``, pose (3,) of the laser (None: not told), seconds, view, range limit."""

    ranges: Array
    pose: list[float] | None
    time: float
    view: LaserView | None
    max_range: float | None


def front_laser(path: Path, line: int, words: Sequence[str]) -> Scanned:
    """Read an FLASER line."""
    beams = _beams(path, line, words, 1)
    tail = words[2 + beams :]
    if len(tail) != len(TAIL):
        expected = 2 + beams + len(TAIL)
        right = f"expected {expected}: {words[0]}, {beams}, as many readings, {', '.join(TAIL)}"
        raise FormatError(path, line, f"{len(words)} words; {right}")
    ranges = _readings(path, line, words[2 : 2 + beams])
    x, y, theta, time = (number(path, line, tail[i], TAIL[i]) for i in (0, 1, 2, 6))
    return Scanned(ranges, [x, y, theta], time, None, None)


def robot_laser(path: Path, line: int, words: Sequence[str]) -> Scanned:
    """Read a ROBOTLASER1 line; remissions are passed over."""
    found, tail = _with_head(path, line, words, ROBOT)
    pose = [number(path, line, tail[i], ROBOT[i]) for i in range(3)]
    return found._replace(pose=pose)


def raw_laser(path: Path, line: int, words: Sequence[str]) -> Scanned:
    """Read a RAWLASER1 line, which tells no pose; remissions are passed over."""
    return _with_head(path, line, words, STAMP)[0]


def odometry(path: Path, line: int, words: Sequence[str]) -> list[float]:
    """Time and pose (t, x, y, theta) of an ODOM line."""
    if len(words) != 10:
        right = "expected 10: ODOM, x, y, theta, tv, rv, acceleration, ipc_time, host, logger_time"
        raise FormatError(path, line, f"{len(words)} words; {right}")
    return [number(path, line, words[i], n) for i, n in ((7, "ipc_time"), (1, "x"), (2, "y"), (3, "theta"))]


def view_of(path: Path, line: int, words: Sequence[str]) -> LaserView:
    """Start angle, field of view and step of a ROBOTLASER1 or RAWLASER1 line."""
    start, field, step = (
        number(path, line, words[i] if i < len(words) else "", HEAD[i - 1]) for i in (2, 3, 4)
    )
    if not 0 < degrees(field) <= 360:
        raise FormatError(
            path, line, f"field of view is {words[3]!r}; expected radians, more than 0, up to 6.2832"
        )
    in_degrees = degrees(field) == field or abs(field) > 2 * np.pi + 1e-3
    resolution = step if in_degrees else float(np.degrees(step))
    return LaserView(
        start if in_degrees else degrees(start), degrees(field), resolution if step > 0 else None
    )


def _with_head(
    path: Path, line: int, words: Sequence[str], names: tuple[str, ...]
) -> tuple[Scanned, Sequence[str]]:
    """Read the head, the readings and the stamp of a message; return what stands behind the remissions."""
    beams = _beams(path, line, words, 8)
    at = 9 + beams
    try:
        remissions = int(words[at])
    except (ValueError, IndexError):
        given = words[at] if at < len(words) else ""
        raise FormatError(path, line, f"number of remissions is {given!r}; expected a whole number") from None
    tail = words[at + 1 + max(remissions, 0) :]
    if remissions < 0 or len(tail) != len(names):
        expected = at + 1 + max(remissions, 0) + len(names)
        right = (
            f"{words[0]}, {', '.join(HEAD)}, {beams} readings, {remissions} remissions, {', '.join(names)}"
        )
        raise FormatError(path, line, f"{len(words)} words; expected {expected}: {right}")
    limit = number(path, line, words[5], HEAD[4])
    found = Scanned(
        _readings(path, line, words[9:at]),
        None,
        number(path, line, tail[-3], STAMP[0]),
        view_of(path, line, words),
        limit if limit > 0 else None,
    )
    return found, tail


def _beams(path: Path, line: int, words: Sequence[str], at: int) -> int:
    """The number of beams, checked against the number of words."""
    try:
        beams = int(words[at])
    except (ValueError, IndexError):
        given = words[at] if len(words) > at else ""
        raise FormatError(path, line, f"number of beams is {given!r}; expected a whole number") from None
    if not 1 <= beams <= MAX_BEAMS:
        raise FormatError(path, line, f"{beams} beams; expected between 1 and {MAX_BEAMS}")
    return beams


def _readings(path: Path, line: int, words: Sequence[str]) -> Array:
    try:
        return np.array([float(word) for word in words])
    except ValueError:
        k, word = next((k, word) for k, word in enumerate(words, 1) if not is_number(word))
        raise FormatError(path, line, f"reading {k} is {word!r}; expected a number") from None
