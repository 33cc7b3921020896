"""Reader and writer of the UTIAS multi-robot localisation and mapping logs (MRCLAM).

Files of a set, plain text or gzipped, ``#`` begins a comment::

    Barcodes.dat               subject  barcode                  subjects 1-5 are robots, others landmarks
    RobotN_Odometry.dat        time [s]  v [m/s]  omega [rad/s]
    RobotN_Measurement.dat     time [s]  BARCODE  range [m]  bearing [rad]
    RobotN_Groundtruth.dat     time [s]  x [m]  y [m]  theta [rad]             truth
    Landmark_Groundtruth.dat   subject  x [m]  y [m]  sd x [m]  sd y [m]        truth

:func:`read_log` opens the first three only; :func:`read_truth` opens the last two.  Landmark ids are
subject numbers.  Sightings of other robots are dropped and counted.  A barcode in no line of
``Barcodes.dat`` is a misreading, and a range or a bearing that the cameras cannot give is another; a real log
has a few in ten thousand lines, others in a hundred, so up to ``MISREAD_SHARE`` of the lines are dropped,
counted and told, and more are an error.  A line that stands there twice is used once, and lines out of order,
as buffers of a logger leave them, are put in order; both are told.  :func:`write` writes all five files, for
a simulated robot.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.datasets.text import (
    Columns,
    FormatError,
    existing,
    read_columns,
    require_integers,
    sorted_by,
)
from vslam_ref.geometry import so2
from vslam_ref.support.files import write_text
from vslam_ref.systems.slam_log.log import LoggedSighting, LogTruth, SlamLog

ROBOTS = range(1, 6)
MISREAD_SHARE = 0.05
"""Of the lines with sightings: what may be misread.  With more, the list of barcodes is likely wrong."""
BARCODE = 54
"""Written barcodes are subject numbers plus this: a reader that mistakes one for the other finds nothing."""
TRUTH_GAP = 0.25
"""Seconds between two true poses beyond which there is no truth (cameras at 100 Hz lost the robot)."""


def robots(folder: Path) -> list[int]:
    """Numbers of the robots whose odometry is in the folder."""
    found = (re.match(r"Robot(\d+)_Odometry\.dat(\.gz)?$", path.name) for path in folder.iterdir())
    return sorted({int(match[1]) for match in found if match})


def read_log(folder: Path, robot: int) -> SlamLog:
    """Read odometry and sightings of one robot; no truth is opened.

    Raises
    ------
    FormatError
        Where a file does not have the format above, with file and line.
    """
    here = robots(folder) if folder.is_dir() else []
    if robot not in here:
        found = ", ".join(map(str, here)) or "none"
        raise FormatError(folder, None, f"no odometry of robot {robot}; robots here: {found}")
    odometry = read_columns(existing(folder, f"Robot{robot}_Odometry.dat"), ("time", "v", "omega"))
    odometry, swapped = sorted_by(odometry, 0)
    if len(odometry.values) < 2:
        raise FormatError(odometry.path, None, "one line; expected two or more")
    start = float(odometry.values[0, 0])
    sightings, dropped, odd = _read_sightings(folder, robot, start)
    return SlamLog(
        name=f"mrclam robot {robot}",
        drive="differential",
        wheelbase=float("nan"),
        clock_start=start,
        times=odometry.values[:, 0] - start,
        controls=odometry.values[:, 1:],
        sightings=sightings,
        dropped=dropped,
        notes=(*_swapped_note(odometry, swapped), *odd),
    )


def read_truth(folder: Path, robot: int, log: SlamLog) -> LogTruth:
    """Read the motion-capture poses of one robot on the time of ``log``, and the true landmarks."""
    poses = read_columns(existing(folder, f"Robot{robot}_Groundtruth.dat"), ("time", "x", "y", "theta"))
    poses, swapped = sorted_by(poses, 0)
    notes = _swapped_note(poses, swapped)
    times = poses.values[:, 0]
    first = np.diff(times, prepend=-np.inf) > 0
    if not first.all():
        notes += (f"{poses.path.name}: {np.count_nonzero(~first)} line(s) of a time again; the first counts",)
        poses = poses._replace(values=poses.values[first], lines=poses.lines[first])
    names = ("subject", "x", "y", "sd x", "sd y")
    marks = read_columns(existing(folder, "Landmark_Groundtruth.dat"), names)
    subjects = require_integers(marks, 0, "subject")
    _require_distinct(marks, subjects, "subject")
    known = set(read_barcodes(folder).values())
    marks.require(
        np.isin(subjects, list(known)),
        lambda k: f"landmark {subjects[k]} has no barcode; expected one of Barcodes.dat",
    )
    pose = poses.values[:, 1:].copy()
    pose[:, 2] = so2.wrap(pose[:, 2])
    return LogTruth(
        times=poses.values[:, 0] - log.clock_start,
        T_world_vehicle=pose,
        max_gap=TRUTH_GAP,
        ids=subjects,
        landmarks=marks.values[:, 1:3],
        lever=np.zeros(2),
        exact=True,
        notes=notes,
    )


def read_barcodes(folder: Path) -> dict[int, int]:
    """Barcode -> subject."""
    table = read_columns(existing(folder, "Barcodes.dat"), ("subject", "barcode"))
    subjects, codes = require_integers(table, 0, "subject"), require_integers(table, 1, "barcode")
    _require_distinct(table, subjects, "subject")
    _require_distinct(table, codes, "barcode")
    return dict(zip(codes.tolist(), subjects.tolist(), strict=True))


def _require_distinct(table: Columns, values: IntArray, name: str) -> None:
    _, first, which = np.unique(values, return_index=True, return_inverse=True)
    before = first[which]  # where each value stands first
    table.require(
        before == np.arange(len(values)),
        lambda k: f"{name} {values[k]} again; line {table.lines[before[k]]} has it already",
    )


def _swapped_note(table: Columns, swapped: int) -> tuple[str, ...]:
    if not swapped:
        return ()
    return (f"{table.path.name}: {swapped} line(s) with an earlier time than a line before; put in order",)


def _read_sightings(
    folder: Path, robot: int, start: float
) -> tuple[tuple[LoggedSighting, ...], dict[str, int], tuple[str, ...]]:
    """Sightings of landmarks; counts of what was left out; sentences about what is odd."""
    subject_of = read_barcodes(folder)
    names = ("time", "barcode", "range", "bearing")
    table = read_columns(existing(folder, f"Robot{robot}_Measurement.dat"), names)
    table, swapped = sorted_by(table, 0)
    codes = require_integers(table, 1, "barcode")
    r, bearing = table.values[:, 2:].T
    subjects = np.array([subject_of.get(code, -1) for code in codes.tolist()])
    _, first = np.unique(table.values, axis=0, return_index=True)
    again = np.ones(len(codes), dtype=bool)
    again[first] = False
    kinds: dict[str, tuple[BoolArray, Callable[[int], str], str]] = {
        "misread barcodes": (
            subjects < 0,
            lambda k: f"unknown landmark: barcode {codes[k]} is in no line of Barcodes.dat",
            "with a barcode that is in no line of Barcodes.dat (misread)",
        ),
        "impossible sightings": (
            (r <= 0) | (np.abs(bearing) >= np.pi / 2),
            lambda k: (
                f"range is {r[k]:g}; expected more than 0 m"
                if r[k] <= 0
                else f"bearing is {bearing[k]:g}; expected radians between -1.57 and 1.57"
            ),
            "with a range of 0 and less, or a bearing beyond a right angle: the cameras look ahead",
        ),
    }
    notes = _swapped_note(table, swapped)
    dropped = {"other robots": int(np.isin(subjects, ROBOTS).sum())}
    keep = ~np.isin(subjects, ROBOTS) & ~again
    for kind, (bad, what, sentence) in kinds.items():
        count = dropped[kind] = int(np.count_nonzero(bad))
        if count > MISREAD_SHARE * len(bad):
            k = int(np.flatnonzero(bad)[0])
            many = f"; {count} of {len(bad)} lines are so, expected at most {MISREAD_SHARE:.0%}"
            raise FormatError(table.path, int(table.lines[k]), what(k) + (many if count > 1 else ""))
        if count:
            notes += (f"{table.path.name}: {count} of {len(bad)} sightings dropped {sentence}",)
        keep &= ~bad
    if again.any():
        notes += (f"{table.path.name}: {int(again.sum())} line(s) that stand there twice; used once",)
    values = table.values[keep]
    return group_sightings(values[:, 0] - start, subjects[keep], values[:, 2:]), dropped, notes


def group_sightings(times: Array, ids: IntArray, polar: Array) -> tuple[LoggedSighting, ...]:
    """Collect rows of one time into sightings; a landmark seen twice at one time begins another."""
    groups: list[list[int]] = []
    for k in range(len(times)):
        last = groups[-1] if groups else []
        if last and times[last[0]] == times[k] and ids[k] not in ids[last]:
            last.append(k)
        else:
            groups.append([k])
    return tuple(LoggedSighting(float(times[g[0]]), ids[g], polar[g]) for g in groups)


def set_folder(root: Path) -> Path:
    """Return the one folder below ``root`` (or ``root`` itself) that holds a set.

    Raises
    ------
    FormatError
        If there is none, or more than one.
    """
    found = [p for p in (root, *sorted(root.glob("MRCLAM_Dataset*"))) if p.is_dir() and robots(p)]
    if len(found) != 1:
        names = ", ".join(p.name for p in found) or "none"
        raise FormatError(root, None, f"sets with RobotN_Odometry.dat: {names}; expected one")
    return found[0]


def write(folder: Path, robot: int, log: SlamLog, truth: LogTruth) -> None:
    """Write log and truth of one robot into a folder, every number in full.

    Parameters
    ----------
    folder : Path
        Is there; files of the same names are replaced.
    robot : int
        1 to 5.
    log : SlamLog
        Of a differential drive.
    truth : LogTruth
        Its landmarks have numbers from 6 on.

    Raises
    ------
    ValueError
        On what the format cannot say: another drive, or a landmark with a robot's number.

    Notes
    -----
    Times are written on the data set's clock, so read again they are right to its rounding: 1e-13 s for a
    clock of a thousand seconds.  What the log's reader left out is not written.
    """
    if log.drive != "differential" or robot not in ROBOTS or np.isin(truth.ids, ROBOTS).any():
        raise ValueError(
            f"robot {robot}, {log.drive} drive: MRCLAM has robots 1 to 5, wheels, and landmarks from 6"
        )
    start = log.clock_start
    seen = [
        (start + s.time, BARCODE + int(i), r, b)
        for s in log.sightings
        for i, (r, b) in zip(s.ids.tolist(), s.polar.tolist(), strict=True)
    ]
    subjects = [*((i, i) for i in ROBOTS), *((i, BARCODE + i) for i in truth.ids.tolist())]
    marks = [(*row, 0.0, 0.0) for row in _rows(truth.ids, truth.landmarks)]
    poses = _rows(start + truth.times, truth.T_world_vehicle)
    tables: dict[str, tuple[str, list[tuple[Any, ...]]]] = {
        "Barcodes.dat": ("subject barcode", subjects),
        f"Robot{robot}_Odometry.dat": ("time_s v_m_s omega_rad_s", _rows(start + log.times, log.controls)),
        f"Robot{robot}_Measurement.dat": ("time_s barcode range_m bearing_rad", seen),
        f"Robot{robot}_Groundtruth.dat": ("time_s x_m y_m theta_rad", poses),
        "Landmark_Groundtruth.dat": ("subject x_m y_m sd_x_m sd_y_m", marks),
    }
    for name, (head, rows) in tables.items():
        lines = [f"# {head}", *(" ".join(map(repr, row)) for row in rows)]
        write_text(folder / name, "\n".join(lines) + "\n")


def _rows(first: Array | IntArray, values: Array) -> list[tuple[Any, ...]]:
    return [(k, *row) for k, row in zip(first.tolist(), values.tolist(), strict=True)]
