"""What a robot with given gains, offsets and noises would have logged in a world with exact truth.

The inverse of what the filters take a :class:`RobotCalibration` for: a filter that runs with the same values
is consistent by construction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.systems.slam_log.calibration import RobotCalibration
from vslam_ref.systems.slam_log.log import LoggedSighting, LogTruth, SlamLog
from vslam_ref.systems.slam_log.timeline import increment_variances
from vslam_ref.worlds.figure_eight import Eight

FIRST_LANDMARK = 6
"""Number of the first landmark: MRCLAM's subjects 1 to 5 are robots."""


def log(
    world: Eight,
    calibration: RobotCalibration,
    rng: np.random.Generator | None = None,
    clock_start: float = 1000.0,
) -> tuple[SlamLog, LogTruth]:
    """Log and truth of a drive.

    Parameters
    ----------
    world : Eight
    calibration : RobotCalibration
        Gains and offsets that the log has, and its noises.
    rng : Generator, optional
        None: no noise; gains and offsets stay.
    clock_start : float
        The data set's clock at the start of the log, seconds.

    Returns
    -------
    log : SlamLog
        Sightings whose stamp lies behind the log's end are left out.
    truth : LogTruth
    """
    increments = world.controls * world.config.dt
    if rng is not None:
        sd = np.sqrt(increment_variances(increments, calibration))
        increments = increments + sd * rng.standard_normal(sd.shape)
    logged = SlamLog(
        name="simulated robot 1",
        drive="differential",
        wheelbase=float("nan"),
        clock_start=clock_start,
        times=world.times,
        controls=logged_increments(increments, calibration) / world.config.dt,
        sightings=_sightings(world, calibration, rng),
        dropped={},
    )
    ids = FIRST_LANDMARK + np.arange(len(world.landmarks))
    truth = LogTruth(world.times, world.poses, 0.25, ids, world.landmarks, np.zeros(2), exact=True)
    return logged, truth


def logged_increments(increments: ArrayLike, calibration: RobotCalibration) -> Array:
    """Increments (T, 2) as wheels report them, of ds (m) and dalpha (rad) that a filter shall take for true.

    Examples
    --------
    >>> logged_increments([[0.5, 0.1]], RobotCalibration(distance_gain=0.5, turn_gain=2.0, drift=0.2))
    array([[1., 0.]])
    """
    ds, dalpha = np.asarray(increments, dtype=np.float64).T
    turn = (dalpha - calibration.drift * ds) / calibration.turn_gain
    return np.stack([ds / calibration.distance_gain, turn], axis=-1)


def logged_polar(polar: ArrayLike, calibration: RobotCalibration) -> Array:
    """Ranges (m) and bearings (rad), shape (m, 2), as a sensor logs them: ``Calibration.correct`` undone."""
    r, b = np.asarray(polar, dtype=np.float64).T
    logged = r * np.cos(b) ** calibration.range_cosine - calibration.range_offset
    return np.stack([logged, b + calibration.bearing_offset], axis=-1)


def _sightings(
    world: Eight, calibration: RobotCalibration, rng: np.random.Generator | None
) -> tuple[LoggedSighting, ...]:
    found = []
    sigma = np.array([calibration.sigma_range, calibration.sigma_bearing])
    for step in range(0, len(world.times), world.config.steps_between_sightings):
        ids, polar = world.seen(step, calibration.sensor_ahead)
        stamp = float(world.times[step]) + calibration.sighting_delay
        if rng is not None:
            polar = polar + sigma * rng.standard_normal(polar.shape)
        if len(ids) and stamp <= world.times[-1]:
            found.append(LoggedSighting(stamp, FIRST_LANDMARK + ids, logged_polar(polar, calibration)))
    return tuple(found)
