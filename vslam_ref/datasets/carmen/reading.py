"""Reader of a CARMEN log: which of its messages are used, and what is odd in them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.carmen import messages, view
from vslam_ref.datasets.carmen.messages import Scanned
from vslam_ref.datasets.carmen.units import unit_note
from vslam_ref.datasets.text import MAX_BYTES, FormatError, read_lines
from vslam_ref.grids.scan import LaserScanner, Scan

MAX_RANGE = 50.0
KINDS: dict[str, Callable[[Path, int, Sequence[str]], Scanned]] = {
    "FLASER": messages.front_laser,
    "ROBOTLASER1": messages.robot_laser,
    "RAWLASER1": messages.raw_laser,
}
"""Messages of the front laser; the first that a file has is read."""
Lines = list[tuple[int, list[str]]]


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
    notes : tuple of str
        What is odd in the file, a sentence each.
    """

    path: Path
    scanner: LaserScanner
    ranges: Array
    poses: Array
    times: Array
    lines: IntArray
    others: dict[str, int]
    notes: tuple[str, ...] = ()

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
    """Return the half circle of a number of beams.

    Examples
    --------
    >>> np.degrees(scanner(180).angles[[0, -1]]), np.degrees(scanner(361).angles[[0, -1]])
    (array([-90.,  89.]), array([-90.,  90.]))
    """
    return view.half_circle(beams, max_range)


def read(path: Path, max_bytes: int = MAX_BYTES, field_of_view: float | None = None) -> CarmenLog:
    """Read a log.

    Parameters
    ----------
    path : Path
    max_bytes : int
        Unpacked size at which reading stops.
    field_of_view : float, optional
        Radians, up to a full circle, from half of it on the right to half of it on the left; whatever the
        file says.

    Raises
    ------
    FormatError
        If the file has no scan, a scan has not as many words as it should, or another number of beams or
        another field of view than those before; if a reading is not a number, or a pose or a time no finite
        number; if there are RAWLASER1 lines only, and no ODOM line.
    ValueError
        If the field of view is not between 0 and a full circle.
    OSError
        If the file cannot be read.
    """
    if field_of_view is not None and not 0 < field_of_view <= 2 * np.pi + 1e-12:
        raise ValueError(f"field_of_view={field_of_view} rad: must be more than 0 and at most 2 pi")
    found: dict[str, Lines] = {}
    for line, text in read_lines(path, max_bytes):
        words = text.split()
        found.setdefault(words[0], []).append((line, words))
    kind = next((name for name in KINDS if name in found), None)
    if kind is None:
        there = ", ".join(sorted(found)[:5]) or "nothing"
        raise FormatError(path, None, f"no FLASER line ({there} found); expected a log of a front laser")
    scans = [KINDS[kind](path, line, words) for line, words in found[kind]]
    lines = [line for line, _ in found[kind]]
    _require_one_scanner(path, kind, lines, scans)
    poses, notes = _poses(path, scans, found)
    seen = _scanner(path, scans[0], found, field_of_view)
    ranges = np.array([scan.ranges for scan in scans])
    unit = unit_note(ranges, seen.scanner.max_range)
    return CarmenLog(
        path=path,
        scanner=seen.scanner,
        ranges=ranges,
        poses=poses,
        times=np.array([scan.time for scan in scans]),
        lines=np.array(lines),
        others=dict(Counter({name: len(there) for name, there in found.items() if name != kind})),
        notes=(*notes, *seen.notes, *([] if unit is None else [unit])),
    )


def _require_one_scanner(path: Path, kind: str, lines: list[int], scans: list[Scanned]) -> None:
    """Beams and view of every scan must be those of the first."""
    first = scans[0]
    for line, scan in zip(lines, scans, strict=True):
        if len(scan.ranges) != len(first.ranges):
            what = f"{len(scan.ranges)} beams; the scan in line {lines[0]} has {len(first.ranges)}"
            raise FormatError(path, line, f"{what}, expected the same")
        if scan.view != first.view:
            what = f"{kind} with another start angle, field of view or resolution than in line {lines[0]}"
            raise FormatError(path, line, f"{what}; expected the same")


def _scanner(path: Path, scan: Scanned, found: dict[str, Lines], told: float | None) -> view.ChosenScanner:
    """The scanner, by what tells its view: the user, the messages, the parameters, the number of beams."""
    beams, limit = len(scan.ranges), min(scan.max_range or MAX_RANGE, MAX_RANGE)
    in_file, where = scan.view or _view_elsewhere(path, beams, found), "the messages of the laser"
    if in_file is None:
        parameters = {words[1]: words[2] for _, words in found.get("PARAM", []) if len(words) > 2}
        in_file, where = view.from_parameters(parameters), "the file's PARAM lines"
    if told is None:
        if in_file is None:
            return view.by_count(beams, limit)
        return view.chosen(beams, in_file, limit, where)
    asked = view.degrees(told)
    taken = view.chosen(beams, view.LaserView(None, asked, None), limit, "--fov")
    if in_file is None or in_file.field_of_view is None or abs(in_file.field_of_view - asked) < 0.5:
        return taken
    note = f"a field of view of {asked:g} degrees is taken as told; {where} say {in_file.field_of_view:g}"
    return view.ChosenScanner(taken.scanner, (*taken.notes, note))


def _view_elsewhere(path: Path, beams: int, found: dict[str, Lines]) -> view.LaserView | None:
    """The view that another message of the same laser tells, if it has as many beams and is whole."""
    for name in ("ROBOTLASER1", "RAWLASER1"):
        for line, words in found.get(name, [])[:1]:
            if len(words) > 8 and words[8] == str(beams):
                try:
                    return messages.view_of(path, line, words)
                except FormatError:
                    continue
    return None


def _poses(path: Path, scans: list[Scanned], found: dict[str, Lines]) -> tuple[Array, tuple[str, ...]]:
    """Poses (N, 3) of the laser; for messages without, those of the odometry at the scan's time."""
    if scans[0].pose is not None:
        return np.array([scan.pose for scan in scans]), ()
    if "ODOM" not in found:
        raise FormatError(path, None, "RAWLASER1 tells no pose, and there is no ODOM line; expected poses")
    rows = np.array([messages.odometry(path, line, words) for line, words in found["ODOM"]])
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    rows[:, 3] = np.unwrap(rows[:, 3])
    times = np.array([scan.time for scan in scans])
    poses = np.stack([np.interp(times, rows[:, 0], rows[:, i]) for i in (1, 2, 3)], -1)
    said = "RAWLASER1 tells no pose: ODOM's is taken for the laser's, as the wheels say it"
    outside = int(np.count_nonzero((times < rows[0, 0]) | (times > rows[-1, 0])))
    more = f" ({outside} scan(s) before its first or after its last line have the nearest)" if outside else ""
    return poses, (said + more,)
