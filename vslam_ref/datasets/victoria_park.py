"""Reader of the Victoria Park log: a utility vehicle with Ackermann steering among trees.

::

    aa3_dr.mat          time [ms], speed [m/s, encoder at the left rear wheel], steering [rad]
    victoria_park.txt   ODOMETRY i j dx dy dtheta (6 numbers)       pose j in the frame of pose i
                        LANDMARK i id dx dy (3 numbers)             tree id seen from pose i
    aa3_gpsx.mat        timeGps [ms], Lo_m (east), La_m (north)     reference

Two conversions happen at this door.

*Speed.*  The encoder turns with the left rear wheel, H to the left of the axle's middle.  With turn
rate v tan(phi) / L that wheel moves at v_e = v (1 - tan(phi) H / L), so v = v_e / (1 - tan(phi) H / L).

*Time.*  A sighting carries a pose number and no time.  The ODOMETRY lines were made from the same
encoder; so pose i belongs to the moment at which dead reckoning has covered the way the lines have
covered up to i.  Their totals agree to 1 part in 10^4 (4026.60 against 4026.64 m), and nothing is lost
where the vehicle stands: there every moment sees the same.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets import matfile
from vslam_ref.datasets.mrclam import group_sightings
from vslam_ref.datasets.text import LARGEST_INTEGER, FormatError, number, read_lines
from vslam_ref.systems.slam_log.log import LogTruth, SlamLog

WHEELBASE = 2.83
"""Distance L between the axles, metres."""
ENCODER_OFFSET = 0.76
"""Distance H of the encoder wheel from the middle of the rear axle, metres."""
ANTENNA_AHEAD = 3.78
"""Metres from the rear axle to the GPS antenna, taken as the laser's place in the data's note.

The log says the same: an antenna fitted freely to the fixes stands 3.7 to 4.1 m ahead and 0.02 m aside.
Without it every position is 4 m off in the vehicle's own direction.
"""
WAY_TOLERANCE = 0.01
"""Share by which the two ways may differ before the files count as not of one run."""
GPS_GAP = 1.0
"""Seconds between two fixes beyond which there is no reference."""
GPS_SLACK = 0.5
"""Metres that a fix may move beyond the way driven (see :func:`continuous_fixes`)."""
GPS_SHORTEST = 25
"""Fixes that an unbroken stretch needs to be kept: 5 seconds."""


class GraphFile(NamedTuple):
    """What ``victoria_park.txt`` says.

    Attributes
    ----------
    ways : ndarray, shape (P,)
        Unsigned way from pose 0 to each pose, metres.
    pose_numbers : ndarray of int, shape (P,)
        Increasing.
    seen_from : ndarray of int, shape (N,)
        Index into ``pose_numbers`` of each sighting.
    ids : ndarray of int, shape (N,)
    xy : ndarray, shape (N, 2)
        Metres, sensor frame.
    """

    ways: Array
    pose_numbers: IntArray
    seen_from: IntArray
    ids: IntArray
    xy: Array


def rear_axle_speed(encoder: Array, steering: Array) -> Array:
    """Speed of the middle of the rear axle from that of the left rear wheel."""
    return np.asarray(encoder / (1.0 - np.tan(steering) * ENCODER_OFFSET / WHEELBASE))


def read_log(folder: Path) -> SlamLog:
    """Read controls and sightings; the GPS is not opened.

    Raises
    ------
    FormatError
        Where a file does not have the format above, with file and line.
    """
    path = folder / "aa3_dr.mat"
    raw = matfile.read_vectors(path, ("time", "speed", "steering"))
    times, steering = raw["time"] / 1e3, raw["steering"]
    back = np.flatnonzero(np.diff(times) < 0)
    if len(back):
        what = f"time({back[0] + 2}) lies before the one above; times must not go back"
        raise FormatError(path, None, what)
    steep = np.flatnonzero(np.abs(steering) >= np.pi / 3)
    if len(steep):
        what = f"steering({steep[0] + 1}) is {steering[steep[0]]:g}; expected radians within +-1.05"
        raise FormatError(path, None, what)
    controls = np.stack([rear_axle_speed(raw["speed"], steering), steering], -1)
    graph = read_graph(folder / "victoria_park.txt")
    seen_at = match_times(times, controls[:, 0], graph, folder / "victoria_park.txt")[graph.seen_from]
    polar = np.stack([np.hypot(*graph.xy.T), np.arctan2(graph.xy[:, 1], graph.xy[:, 0])], -1)
    start = float(times[0])
    sightings = group_sightings(seen_at - start, graph.ids, polar)
    return SlamLog("victoria park", "ackermann", WHEELBASE, start, times - start, controls, sightings, {})


def match_times(times: Array, speed: Array, graph: GraphFile, path: Path) -> Array:
    """Time of each pose number, by way driven, shape (P,).

    A control is taken to hold up to its stamp: so the headings of both sources agree best.
    """
    driven = np.concatenate([[0.0], np.cumsum(np.abs(speed[1:]) * np.diff(times))])
    if abs(graph.ways[-1] / driven[-1] - 1.0) > WAY_TOLERANCE:
        what = f"ODOMETRY lines cover {graph.ways[-1]:.2f} m, the wheel {driven[-1]:.2f} m; not of one run"
        raise FormatError(path, None, what)
    moving = np.concatenate([[True], np.diff(driven) > 0])
    return np.asarray(np.interp(graph.ways * (driven[-1] / graph.ways[-1]), driven[moving], times[moving]))


def read_graph(path: Path) -> GraphFile:
    """Read the pose graph file."""
    numbers, ways = [0], [0.0]
    rows: list[tuple[int, int, float, float]] = []
    index = {0: 0}
    for line, text in read_lines(path):
        word, *rest = text.split()
        if word == "ODOMETRY":
            i, j, dx, dy, _ = _values(path, line, rest, ("i", "j", "dx", "dy", "dtheta"), 6)
            if i != numbers[-1] or j <= i:
                what = f"ODOMETRY from pose {i:g} to {j:g}; expected from {numbers[-1]} to a later one"
                raise FormatError(path, line, what)
            numbers.append(int(j))
            ways.append(ways[-1] + float(np.hypot(dx, dy)))
            index[int(j)] = len(numbers) - 1
        elif word == "LANDMARK":
            i, identity, x, y = _values(path, line, rest, ("pose", "landmark", "dx", "dy"), 3)
            if i not in index:
                what = f"LANDMARK seen from pose {i:g}, which no line above has reached"
                raise FormatError(path, line, what)
            if x <= 0 and y == 0:
                raise FormatError(path, line, "LANDMARK at the sensor or straight behind; expected one ahead")
            rows.append((index[int(i)], int(identity), x, y))
        else:
            raise FormatError(path, line, f"line begins with {word!r}; expected ODOMETRY or LANDMARK")
    if len(numbers) < 2 or not rows or ways[-1] == 0:
        raise FormatError(path, None, "no data; expected ODOMETRY lines that move and LANDMARK lines")
    rows.sort(key=lambda row: row[0])
    whole = np.array([row[:2] for row in rows], dtype=np.int64)
    xy = np.array([row[2:] for row in rows])
    return GraphFile(np.array(ways), np.array(numbers), whole[:, 0], whole[:, 1], xy)


def _values(path: Path, line: int, words: list[str], names: tuple[str, ...], extra: int) -> list[float]:
    """The named numbers of a line; the first two are whole; ``extra`` more numbers follow."""
    if len(words) != len(names) + extra:
        right = f"{', '.join(names)} and {extra} of the noise"
        what = f"{len(words)} numbers; expected {len(names) + extra}: {right}"
        raise FormatError(path, line, what)
    values = [number(path, line, word, name) for word, name in zip(words, names, strict=False)]
    for value, name in zip(values[:2], names, strict=False):
        if value != round(value) or not 0 <= value < LARGEST_INTEGER:
            raise FormatError(path, line, f"{name} is {value:g}; expected a whole number from 0 to 9e15")
    for word in words[len(names) :]:
        number(path, line, word, "noise")
    return values


def read_truth(folder: Path, log: SlamLog) -> LogTruth:
    """Read the GPS on the time of ``log``: positions of metre level, without heading or map."""
    path = folder / "aa3_gpsx.mat"
    raw = matfile.read_vectors(path, ("timeGps", "Lo_m", "La_m"))
    times = raw["timeGps"] / 1e3 - log.clock_start
    if np.any(np.diff(times) <= 0):
        at = int(np.flatnonzero(np.diff(times) <= 0)[0])
        raise FormatError(path, None, f"timeGps({at + 2}) is not after the one above; times must increase")
    xy = np.stack([raw["Lo_m"], raw["La_m"]], -1)
    keep = continuous_fixes(times, xy, log)
    poses = np.column_stack([xy, np.full(len(xy), np.nan)])[keep]
    return LogTruth(
        times=times[keep],
        T_world_vehicle=poses,
        max_gap=GPS_GAP,
        ids=np.zeros(0, dtype=np.int64),
        landmarks=np.zeros((0, 2)),
        lever=np.array([ANTENNA_AHEAD, 0.0]),
        exact=False,
    )


def continuous_fixes(times: Array, xy: Array, log: SlamLog) -> NDArray[np.bool_]:
    """Fixes (N,) of unbroken stretches, by a rule that knows no SLAM result.

    Between two fixes an antenna cannot move further than the wheels have rolled.  Where it moves more
    than ``GPS_SLACK`` beyond that, or where fixes are more than ``GPS_GAP`` apart, a stretch ends; one of
    fewer than ``GPS_SHORTEST`` fixes is dropped.  A long stretch that is off as a whole is kept.
    """
    driven = np.concatenate([[0.0], np.cumsum(np.abs(log.controls[1:, 0]) * np.diff(log.times))])
    way = np.diff(np.interp(times, log.times, driven))
    moved = np.hypot(*np.diff(xy, axis=0).T)
    broken = (moved > way + GPS_SLACK) | (np.diff(times) > GPS_GAP)
    stretch = np.concatenate([[0], np.cumsum(broken)])
    size = np.bincount(stretch)[stretch]
    inside = (times >= log.times[0]) & (times <= log.times[-1])
    return np.asarray((size >= GPS_SHORTEST) & inside)
