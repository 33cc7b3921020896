"""A recorded run in one convention: controls, sightings of known landmarks, and, apart from them, truth.

Seconds since the log's first control; metres; radians.  The vehicle frame has x ahead and y to the
left, its origin at the middle of the driven axle; sightings are taken in the *sensor frame*, which the
:class:`~vslam_ref.systems.slam_log.calibration.RobotCalibration` places in the vehicle frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

from vslam_ref.arrays import Array, IntArray

Drive = Literal["differential", "ackermann"]


class LoggedSighting(NamedTuple):
    """What was seen at one moment.

    Attributes
    ----------
    time : float
        As stamped in the log, seconds.
    ids : ndarray of int, shape (m,)
        Landmark identities, each once.
    polar : ndarray, shape (m, 2)
        Range (m) and bearing (rad, left positive), sensor frame.
    """

    time: float
    ids: IntArray
    polar: Array


class SlamLog(NamedTuple):
    """A log without its truth.

    Attributes
    ----------
    name : str
    drive : {"differential", "ackermann"}
        What the controls are: (v, omega) in m/s and rad/s, or (v of the rear axle, steering angle).
    wheelbase : float
        Metres; unused by a differential drive.
    clock_start : float
        Reading of the data set's clock at time zero of the log, seconds.
    times : ndarray, shape (T,)
        Seconds, never decreasing.  Control k holds from times[k] to times[k + 1].
    controls : ndarray, shape (T, 2)
    sightings : tuple of LoggedSighting
        In order of time.
    dropped : mapping of str to int
        Sightings the reader left out, counted by reason.
    notes : tuple of str
        What the reader found odd, a sentence each.
    """

    name: str
    drive: Drive
    wheelbase: float
    clock_start: float
    times: Array
    controls: Array
    sightings: tuple[LoggedSighting, ...]
    dropped: Mapping[str, int]
    notes: tuple[str, ...] = ()


class LogTruth(NamedTuple):
    """Reference of a run in the world frame, on the log's time.

    Attributes
    ----------
    times : ndarray, shape (N,)
        Strictly increasing.
    T_world_vehicle : ndarray, shape (N, 3)
        (x, y, theta), metres and radians; theta is NaN where the reference knows positions only.
    max_gap : float
        Between two samples further apart than this, seconds, there is no truth.
    ids, landmarks : ndarray, shapes (n,) and (n, 2)
        True map; empty where there is none.
    lever : ndarray, shape (2,)
        The point whose position is given, in the vehicle frame, metres: where the antenna stands.
    exact : bool
        Whether errors against it are the estimate's own (motion capture), or also the reference's (GPS).
    notes : tuple of str
        What the reader found odd, a sentence each.
    """

    times: Array
    T_world_vehicle: Array
    max_gap: float
    ids: IntArray
    landmarks: Array
    lever: Array
    exact: bool
    notes: tuple[str, ...] = ()
