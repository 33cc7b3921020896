"""Reader of the UTIAS multi-robot localisation and mapping logs (MRCLAM).

Files of a set, plain text or gzipped, ``#`` begins a comment::

    Barcodes.dat               subject  barcode                  subjects 1-5 are robots, others landmarks
    RobotN_Odometry.dat        time [s]  v [m/s]  omega [rad/s]
    RobotN_Measurement.dat     time [s]  BARCODE  range [m]  bearing [rad]
    RobotN_Groundtruth.dat     time [s]  x [m]  y [m]  theta [rad]             truth
    Landmark_Groundtruth.dat   subject  x [m]  y [m]  sd x [m]  sd y [m]        truth

:func:`read_log` opens the first three only; :func:`read_truth` opens the last two.  Landmark ids are
subject numbers.  Sightings of other robots are dropped and counted.  A barcode in no line of
``Barcodes.dat`` is a misreading; a real log has a few in ten thousand lines, so up to
``MISREAD_SHARE`` of the lines are dropped and counted, and more are an error.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.text import (
    Columns,
    FormatError,
    existing,
    read_columns,
    require_integers,
    require_order,
)
from vslam_ref.geometry import so2
from vslam_ref.systems.slam_log.log import Sighting, SlamLog, Truth

ROBOTS = range(1, 6)
MISREAD_SHARE = 1e-3
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
        On anything that is not as the module says, with file and line.
    """
    here = robots(folder) if folder.is_dir() else []
    if robot not in here:
        found = ", ".join(map(str, here)) or "none"
        raise FormatError(folder, None, f"no odometry of robot {robot}; robots here: {found}")
    odometry = read_columns(existing(folder, f"Robot{robot}_Odometry.dat"), ("time", "v", "omega"))
    require_order(odometry, 0)
    if len(odometry.values) < 2:
        raise FormatError(odometry.path, None, "one line; expected two or more")
    start = float(odometry.values[0, 0])
    sightings, dropped = _read_sightings(folder, robot, start)
    return SlamLog(
        name=f"mrclam robot {robot}",
        drive="differential",
        wheelbase=float("nan"),
        clock_start=start,
        times=odometry.values[:, 0] - start,
        controls=odometry.values[:, 1:],
        sightings=sightings,
        dropped=dropped,
    )


def read_truth(folder: Path, robot: int, log: SlamLog) -> Truth:
    """Read the motion-capture poses of one robot on the time of ``log``, and the true landmarks."""
    poses = read_columns(existing(folder, f"Robot{robot}_Groundtruth.dat"), ("time", "x", "y", "theta"))
    require_order(poses, 0, strict=True)
    names = ("subject", "x", "y", "sd x", "sd y")
    marks = read_columns(existing(folder, "Landmark_Groundtruth.dat"), names)
    subjects = require_integers(marks, 0, "subject")
    _require_distinct(marks, subjects, "subject")
    known = set(read_barcodes(folder).values())
    for line, subject in zip(marks.lines.tolist(), subjects.tolist(), strict=True):
        if subject not in known:
            raise FormatError(
                marks.path, line, f"landmark {subject} has no barcode; expected one of Barcodes.dat"
            )
    pose = poses.values[:, 1:].copy()
    pose[:, 2] = so2.wrap(pose[:, 2])
    return Truth(
        times=poses.values[:, 0] - log.clock_start,
        T_world_vehicle=pose,
        max_gap=TRUTH_GAP,
        ids=subjects,
        landmarks=marks.values[:, 1:3],
        lever=np.zeros(2),
        exact=True,
    )


def read_barcodes(folder: Path) -> dict[int, int]:
    """Barcode -> subject."""
    table = read_columns(existing(folder, "Barcodes.dat"), ("subject", "barcode"))
    subjects, codes = require_integers(table, 0, "subject"), require_integers(table, 1, "barcode")
    _require_distinct(table, subjects, "subject")
    _require_distinct(table, codes, "barcode")
    return dict(zip(codes.tolist(), subjects.tolist(), strict=True))


def _require_distinct(table: Columns, values: IntArray, name: str) -> None:
    seen: dict[int, int] = {}
    for line, value in zip(table.lines.tolist(), values.tolist(), strict=True):
        if value in seen:
            raise FormatError(table.path, line, f"{name} {value} again; line {seen[value]} has it already")
        seen[value] = line


def _read_sightings(folder: Path, robot: int, start: float) -> tuple[tuple[Sighting, ...], dict[str, int]]:
    subject_of = read_barcodes(folder)
    names = ("time", "barcode", "range", "bearing")
    table = read_columns(existing(folder, f"Robot{robot}_Measurement.dat"), names)
    require_order(table, 0)
    codes = require_integers(table, 1, "barcode")
    _require_sane(table)
    subjects = np.array([subject_of.get(code, -1) for code in codes.tolist()])
    unknown = np.flatnonzero(subjects < 0)
    if len(unknown) > MISREAD_SHARE * len(subjects):
        line, code = int(table.lines[unknown[0]]), int(codes[unknown[0]])
        what = f"unknown landmark: barcode {code} is in no line of Barcodes.dat"
        if len(unknown) > 1:
            what += f" ({len(unknown)} such lines)"
        raise FormatError(table.path, line, what)
    robots_seen = np.isin(subjects, ROBOTS)
    keep = (subjects >= 0) & ~robots_seen
    dropped = {"other robots": int(robots_seen.sum()), "misread barcodes": len(unknown)}
    values = table.values[keep]
    return group_sightings(values[:, 0] - start, subjects[keep], values[:, 2:]), dropped


def _require_sane(table: Columns) -> None:
    """Ranges are positive and bearings less than a right angle: the cameras look ahead."""
    for column, name, right, bad in (
        (2, "range", "more than 0 m", table.values[:, 2] <= 0),
        (3, "bearing", "radians between -1.57 and 1.57", np.abs(table.values[:, 3]) >= np.pi / 2),
    ):
        at = np.flatnonzero(bad)
        if len(at):
            what = f"{name} is {table.values[at[0], column]:g}; expected {right}"
            raise FormatError(table.path, int(table.lines[at[0]]), what)


def group_sightings(times: Array, ids: IntArray, polar: Array) -> tuple[Sighting, ...]:
    """Collect rows of one time into sightings; a landmark seen twice at one time begins another."""
    groups: list[list[int]] = []
    for k in range(len(times)):
        last = groups[-1] if groups else []
        if last and times[last[0]] == times[k] and ids[k] not in ids[last]:
            last.append(k)
        else:
            groups.append([k])
    return tuple(Sighting(float(times[g[0]]), ids[g], polar[g]) for g in groups)


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
