"""Reader and writer of laser logs in CARMEN's text format, plain or gzipped.

One message a line, its name first; ``#`` begins a comment.  Read are the scans of the front laser::

    FLASER n r_1 ... r_n  x y theta  odom_x odom_y odom_theta  ipc_time host logger_time

``r_i`` are metres, from right to left over a half circle.  (x, y, theta) is the pose of the laser and
(odom_x, ...) that of the robot; in *corrected* logs both are what scan matching found.  Other messages
(``ODOM``, ``PARAM``, ``NEFF``, ...) are counted and left alone.

What the format leaves open, and what is taken here:

* *Where the beams look.*  The lasers of these logs have steps of a whole or a half degree and begin at -90
  degrees: 181 and 361 beams span the half circle with both ends, 180 and 360 lack one.  Hence the step is 180
  degrees over n for even n, over n - 1 for odd n.  (On intel, aces and fhw every other choice blurs the map.)
* *When nothing came back.*  The scanners send 81.91, 81.83, 51.15 or 50 m then, by make and driver.  Readings
  of 50 m (:data:`MAX_RANGE`) and more count as "no return"; no wall of a building is seen from there.
* *Time.*  ``ipc_time``, as it is.  Stamps that run backwards or stand still are counted, and never refused.
* *Readings* may be zero, negative, ``nan`` or ``inf``: the maps count them.  Poses and times must be finite.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.text import MAX_BYTES, FormatError, is_number, number, read_lines
from vslam_ref.grids.scan import LaserScanner, Scan
from vslam_ref.support.files import write_text

SCAN = "FLASER"
MAX_RANGE = 50.0
NO_RETURN = 81.91
"""Metres; what is written for a beam that nothing came back of, as a SICK scanner says it."""
MAX_BEAMS = 4096
"""More than any scanner of half a circle has; a larger number is a damaged line."""
TAIL = ("x", "y", "theta", "odom_x", "odom_y", "odom_theta", "ipc_time", "host", "logger_time")


class CarmenLog(NamedTuple):
    """The scans of one log.

    Attributes
    ----------
    path : Path
    scanner : LaserScanner
    ranges : ndarray, shape (N, B)
        Metres, as they are in the file.
    poses : ndarray, shape (N, 3)
        (x, y, theta) of the laser in the world.
    times : ndarray, shape (N,)
        Seconds, as they are in the file.
    lines : ndarray of int, shape (N,)
        Line numbers of the scans.
    others : dict of str to int
        Other messages, by name.
    """

    path: Path
    scanner: LaserScanner
    ranges: Array
    poses: Array
    times: Array
    lines: IntArray
    others: dict[str, int]

    @property
    def backward_stamps(self) -> int:
        """How many stamps are not later than the latest before them."""
        latest = np.maximum.accumulate(self.times)
        return int(np.count_nonzero(self.times[1:] <= latest[:-1]))

    def scans(self) -> Iterator[tuple[Array, Scan]]:
        """Yield the pose (3,) and the scan of every line, in the order of the file."""
        angles, max_range = self.scanner.angles, self.scanner.max_range
        for pose, ranges, time in zip(self.poses, self.ranges, self.times.tolist(), strict=True):
            yield pose, Scan(angles, ranges, max_range, time)


def scanner(beams: int, max_range: float = MAX_RANGE) -> LaserScanner:
    """Return the geometry that a number of beams stands for, as the module says.

    Examples
    --------
    >>> np.degrees(scanner(180).angles[[0, -1]]), np.degrees(scanner(361).angles[[0, -1]])
    (array([-90.,  89.]), array([-90.,  90.]))
    """
    return LaserScanner(beams, -np.pi / 2, np.pi / max(beams - beams % 2, 1), max_range)


def read(path: Path, max_bytes: int = MAX_BYTES) -> CarmenLog:
    """Read a log.

    Raises
    ------
    FormatError
        If the file has no scan, a scan has not as many words as it should, or another number of beams than
        those before; if a reading is not a number, or a pose or a time no finite number.
    OSError
        If the file cannot be read.
    """
    ranges: list[Array] = []
    tails: list[list[float]] = []
    lines: list[int] = []
    others: Counter[str] = Counter()
    for line, text in read_lines(path, max_bytes):
        words = text.split()
        if words[0] != SCAN:
            others[words[0]] += 1
            continue
        beams = _beams(path, line, words)
        if ranges and beams != len(ranges[0]):
            what = f"{beams} beams; the scan in line {lines[0]} has {len(ranges[0])}, expected the same"
            raise FormatError(path, line, what)
        ranges.append(_readings(path, line, words[2 : 2 + beams]))
        tail = words[2 + beams :]
        tails.append([number(path, line, tail[i], TAIL[i]) for i in (0, 1, 2, 6)])
        lines.append(line)
    if not ranges:
        there = ", ".join(sorted(others)[:5]) or "nothing"
        raise FormatError(path, None, f"no {SCAN} line ({there} found); expected a log of a front laser")
    numbers = np.array(tails)
    return CarmenLog(
        path=path,
        scanner=scanner(len(ranges[0])),
        ranges=np.array(ranges),
        poses=numbers[:, :3].copy(),
        times=numbers[:, 3].copy(),
        lines=np.array(lines),
        others=dict(others),
    )


def _beams(path: Path, line: int, words: list[str]) -> int:
    """The number of beams, checked against the number of words."""
    try:
        beams = int(words[1])
    except (ValueError, IndexError):
        given = words[1] if len(words) > 1 else ""
        raise FormatError(path, line, f"number of beams is {given!r}; expected a whole number") from None
    if not 1 <= beams <= MAX_BEAMS:
        raise FormatError(path, line, f"{beams} beams; expected between 1 and {MAX_BEAMS}")
    expected = 2 + beams + len(TAIL)
    if len(words) != expected:
        right = f"expected {expected}: {SCAN}, {beams}, as many readings, {', '.join(TAIL)}"
        raise FormatError(path, line, f"{len(words)} words; {right}")
    return beams


def _readings(path: Path, line: int, words: list[str]) -> Array:
    try:
        return np.array([float(word) for word in words])
    except ValueError:
        k, word = next((k, word) for k, word in enumerate(words, 1) if not is_number(word))
        raise FormatError(path, line, f"reading {k} is {word!r}; expected a number") from None


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
    lines = [f"# {SCAN} n r_1 ... r_n {' '.join(TAIL)}"]
    for row, pose, wheels, time in zip(readings, poses, odometry, times.tolist(), strict=True):
        numbers = " ".join(map(repr, [*row.tolist(), *pose.tolist(), *wheels.tolist(), time]))
        lines.append(f"{SCAN} {beams} {numbers} simulated {time!r}")
    write_text(path, "\n".join(lines) + "\n")
