"""A log as the row of steps a filter takes: predictions, cut where something was seen or is recorded.

::

    controls   |----c0----|----c1----|-------c2-------|---c3---      zero-order hold
    events               s        r               s    r             sightings, records
    steps      |---------|-|------|--|------------|---|-|

Without a time limit for steps, every control begins a step of its own (odometry rate).  With
``max_step``, neighbouring controls are summed up to that duration.  Through a gap of the odometry the last
control holds, with the variance that :mod:`.gaps` adds, spread evenly over the gap.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters import vehicle
from vslam_ref.systems.slam_log.calibration import RobotCalibration
from vslam_ref.systems.slam_log.gaps import gap_variances
from vslam_ref.systems.slam_log.log import SlamLog


class Timeline(NamedTuple):
    """Steps between consecutive cut times.

    Attributes
    ----------
    times : ndarray, shape (K + 1,)
        Cuts, seconds; step k runs from times[k] to times[k + 1].
    increments : ndarray, shape (K, 2)
        ds (m) and dalpha (rad) of each step.
    cov : ndarray, shape (K, 2, 2)
        Their covariances.
    sighting_at, record_at : ndarray of int, shapes (S,), (R,)
        Index of the cut at which each sighting was taken, and each record is to be made.
    """

    times: Array
    increments: Array
    cov: Array
    sighting_at: IntArray
    record_at: IntArray


def control_increments(log: SlamLog, calibration: RobotCalibration) -> Array:
    """Calibrated ds (metres) and dalpha (radians) of each control interval, shape (T - 1, 2).

    Implements :eq:`eq-b4` (B4) for an Ackermann log.
    """
    dt, u = np.diff(log.times)[:, None], log.controls[:-1]
    if log.drive == "ackermann":
        steered = u + np.array([0.0, calibration.steering_offset])
        raw = vehicle.ackermann(steered, log.wheelbase, 1.0) * dt
    else:
        raw = u * dt
    ds = calibration.distance_gain * raw[:, 0]
    return np.stack([ds, calibration.turn_gain * raw[:, 1] + calibration.drift * ds], -1)


def increment_variances(increments: Array, calibration: RobotCalibration) -> Array:
    """Variances of increments; see :class:`RobotCalibration`.

    Parameters
    ----------
    increments : ndarray, shape (..., 2)
        ds (m) and dalpha (rad).
    calibration : RobotCalibration

    Returns
    -------
    ndarray, shape (..., 2)
        m^2 and rad^2.
    """
    way, turn = np.abs(increments[..., 0]), np.abs(increments[..., 1])
    distance = calibration.sigma_distance**2 * way
    heading = calibration.sigma_turn**2 * turn + calibration.sigma_drift**2 * way
    return np.stack([distance, heading], -1)


def sighting_times(log: SlamLog, calibration: RobotCalibration) -> Array:
    """When each sighting was taken, seconds, held inside the log, shape (S,)."""
    taken = np.array([s.time for s in log.sightings]) - calibration.sighting_delay
    return np.clip(taken, log.times[0], log.times[-1])


def build_timeline(
    log: SlamLog, calibration: RobotCalibration, record_times: Array, max_step: float = 0.0
) -> Timeline:
    """Cut the log at its sightings and at ``record_times``.

    Parameters
    ----------
    log : SlamLog
    calibration : RobotCalibration
    record_times : ndarray, shape (R,)
        Inside the log, seconds.
    max_step : float
        0: a step for every control.  Otherwise controls are summed over at most this duration; the
        error is of the order of ds dalpha / 2 a step, sideways.
    """
    seen = sighting_times(log, calibration)
    if max_step > 0:
        count = int(np.ceil((log.times[-1] - log.times[0]) / max_step))
        grid = np.linspace(log.times[0], log.times[-1], count + 1)
    else:
        grid = log.times
    cuts = np.unique(np.concatenate([grid, seen, record_times, log.times[[0, -1]]]))
    inc = control_increments(log, calibration)
    # zero-order hold: the sums up to any time are linear between the stamps
    start, where = np.unique(log.times, return_index=True)
    each = np.hstack([inc, increment_variances(inc, calibration) + gap_variances(log.times, inc)])
    way = np.vstack([np.zeros(4), np.cumsum(each, 0)])[where]
    sums = np.stack([np.interp(cuts, start, way[:, i]) for i in range(4)], -1)
    steps = np.diff(sums, axis=0)
    cov = np.zeros((len(steps), 2, 2))
    cov[:, 0, 0], cov[:, 1, 1] = steps[:, 2], steps[:, 3]
    return Timeline(cuts, steps[:, :2], cov, np.searchsorted(cuts, seen), np.searchsorted(cuts, record_times))
