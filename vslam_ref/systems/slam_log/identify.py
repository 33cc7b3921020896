"""Gains, delays and noises of a data set, found from its logs alone: no truth is opened here.

Two steps, on all logs of the set together:

1. *gains and offsets* from a batch solution of each log with these values unknown.  A robot that sees
   one landmark twice, with a turn and a way in between, has measured its own odometry.  The logs'
   estimates are averaged with their information matrices, so all robots get the same values;
2. *everything, noises above all*, where the innovations of the EKF and of the IEKF together are most
   likely: the values favour neither filter.  An innovation's covariance holds odometry noise, sensor
   noise and map; one that is too small or too large costs likelihood.  One sighting in a hundred may
   lie anywhere inside the sensor's field, or a few misread barcodes would inflate every
   sigma.  One value at a time is moved to the summit of a parabola, gains in units of their standard
   errors from step 1, sigmas in their logarithms.

What the values rest on is written beside them: both logs' own gains with standard errors, the
likelihoods, and residuals of repeated sightings (the same landmark within half a second, from almost
the same place).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.systems.slam_log import LogRun, RobotCalibration, RunSettings, SlamLog, run_log
from vslam_ref.systems.slam_log.batch import Batch, solve_batch
from vslam_ref.systems.slam_log.runner import iekf, iekf_first_order

NOISES = ("sigma_distance", "sigma_turn", "sigma_drift", "sigma_range", "sigma_bearing")
FREE = {
    "mrclam": (
        *("distance_gain", "turn_gain", "drift", "sighting_delay"),
        *("sensor_ahead", "bearing_offset", "range_offset", "range_cosine"),
    ),
    "victoria_park": ("distance_gain", "turn_gain", "steering_offset", "sensor_ahead", "bearing_offset"),
}
"""Gains and offsets each set lets vary."""

START = {
    "mrclam": RobotCalibration(
        sighting_delay=0.2,
        range_cosine=1.0,
        sigma_distance=0.1,
        sigma_turn=0.15,
        sigma_drift=0.06,
        sigma_range=0.1,
        sigma_bearing=0.015,
    ),
    "victoria_park": RobotCalibration(
        sigma_distance=0.1, sigma_turn=0.1, sigma_drift=0.02, sigma_range=0.3, sigma_bearing=0.02
    ),
}
JUDGES = ("ekf", "iekf")
"""Filters whose innovations are made likely, so that the values favour neither."""
OUTLIERS = 0.01
GATES = (13.816, 30.0, 60.0, 200.0, 1e9)
"""Tried at the end, to show what the gate of a run rests on."""
STRIDES = (2.0, 1.0, 0.5, 1.0, 0.5)
"""Units between the three points of a parabola, one sweep each."""
SETTINGS = RunSettings(max_step=0.1, start_sigma_position=0.0, start_sigma_heading=0.0)
"""Faster than odometry rate; the start is the frame, so it is certain."""


def field_area(log: SlamLog) -> float:
    """Area the sensor overlooks, m^2, from the ranges and bearings it reported."""
    polar = np.concatenate([s.polar for s in log.sightings])
    return float(polar[:, 0].max() ** 2 * np.ptp(polar[:, 1]) / 2)


def log_likelihood(run: LogRun, area: float) -> float:
    """Sum over sightings of log((1 - OUTLIERS) N(innovation; 0, S) + OUTLIERS / area)."""
    _, log_det = np.linalg.slogdet(run.seen.S)
    normal = -0.5 * (run.seen.nis + log_det) - np.log(2 * np.pi)
    return float(np.sum(np.logaddexp(np.log1p(-OUTLIERS) + normal, np.log(OUTLIERS / area))))


def pooled_gains(batches: Sequence[Batch]) -> tuple[Array, Array]:
    """Mean (f,) of the logs' free values, weighted with their information, and its covariance (f, f)."""
    information = [np.linalg.inv(b.free_cov) for b in batches]
    values = [np.array([getattr(b.calibration, name) for name in b.free]) for b in batches]
    cov = np.linalg.inv(np.sum(information, 0))
    return cov @ np.sum([i @ v for i, v in zip(information, values, strict=True)], 0), cov


def fit_gains(
    logs: Sequence[SlamLog], calibration: RobotCalibration, free: Sequence[str]
) -> tuple[RobotCalibration, list[Batch]]:
    """Step 1: one batch solution per log, free values averaged."""
    batches = []
    for log in logs:
        start = run_log(log, calibration, "ekf", SETTINGS)
        batches.append(solve_batch(log, calibration, start, free))
    values, _ = pooled_gains(batches)
    return replace(calibration, **dict(zip(free, values.tolist(), strict=True))), batches


def most_likely(
    logs: Sequence[SlamLog], calibration: RobotCalibration, units: dict[str, float]
) -> tuple[RobotCalibration, float]:
    """Step 2: move the values of ``units`` and the sigmas, one at a time, until the logs are most likely.

    The gate makes small steps in the likelihood; a parabola through points ``STRIDES`` units apart looks
    past them, where a gradient would not.  The likelihood never falls.

    Parameters
    ----------
    logs : sequence of SlamLog
    calibration : RobotCalibration
        Where the search begins.
    units : dict
        Gains and offsets to move -> size of one unit.

    Returns
    -------
    Calibration, float
        The most likely values found, and their log likelihood.
    """
    areas = [field_area(log) for log in logs]

    def likelihood(trial: RobotCalibration) -> float:
        return sum(
            log_likelihood(run_log(log, trial, name, SETTINGS), area)
            for name in JUDGES
            for log, area in zip(logs, areas, strict=True)
        )

    best = likelihood(calibration)
    for stride in STRIDES:
        for name in (*NOISES, *units):
            steps = (-stride, stride)
            trials = {step: likelihood(moved(calibration, name, step, units)) for step in steps}
            summit = stride * _summit(trials[-stride], best, trials[stride])
            trials[summit] = likelihood(moved(calibration, name, summit, units))
            step = max(trials, key=lambda k: trials[k])
            if trials[step] > best:
                calibration, best = moved(calibration, name, step, units), trials[step]
    return calibration, best


def moved(calibration: RobotCalibration, name: str, step: float, units: dict[str, float]) -> RobotCalibration:
    """One value moved by ``step`` units; a sigma by a third of that in its logarithm."""
    value = getattr(calibration, name)
    new = value * np.exp(step / 3) if name in NOISES else value + step * units[name]
    return replace(calibration, **{name: float(new)})


def _summit(low: float, middle: float, high: float) -> float:
    """Where a parabola through values at -1, 0, 1 is highest, held to [-2, 2]; the better side if none."""
    curvature = low - 2 * middle + high
    if curvature >= 0:
        return 2.0 if high > low else -2.0
    return float(np.clip((low - high) / (2 * curvature), -2.0, 2.0))


def repeated_sightings(log: SlamLog, within: float = 0.5) -> dict[str, float | int]:
    """Spread of range and bearing of one landmark between neighbouring sightings, robust, over sqrt(2).

    It holds the motion in between too, so it is an upper bound on the part of the noise that changes
    from picture to picture.
    """
    last: dict[int, tuple[float, Array]] = {}
    steps = []
    for sighting in log.sightings:
        for identity, polar in zip(sighting.ids.tolist(), sighting.polar, strict=True):
            before = last.get(identity)
            if before is not None and sighting.time - before[0] <= within:
                steps.append(polar - before[1])
            last[identity] = (sighting.time, polar)
    if not steps:
        return {"pairs": 0}
    centred = np.array(steps) - np.median(steps, 0)
    spread = 1.4826 * np.median(np.abs(centred), 0) / np.sqrt(2)
    return {"pairs": len(steps), "range_m": float(spread[0]), "bearing_rad": float(spread[1])}


def identify(logs: Sequence[SlamLog], start: RobotCalibration, free: Sequence[str]) -> dict[str, Any]:
    """Both steps; returns the document that is committed."""
    after_batch, batches = fit_gains(logs, start, free)
    _, cov = pooled_gains(batches)
    units = dict(zip(free, np.sqrt(np.diag(cov)).tolist(), strict=True))
    calibration, likelihood = most_likely(logs, after_batch, units)
    return {
        "values": asdict(calibration),
        "method": "Two steps, " + " ".join((__doc__ or "").partition("Two steps, ")[2].split()),
        "evidence": {
            "truth_used": False,
            "log_likelihood": likelihood,
            "after_batch": asdict(after_batch),
            "standard_errors": units,
            "logs": [_evidence(log, calibration, batch) for log, batch in zip(logs, batches, strict=True)],
        },
    }


def _neutral(calibration: RobotCalibration, name: str) -> RobotCalibration:
    """Return the calibration with one gain at 1, or one offset at 0: what ignoring it costs."""
    return replace(calibration, **{name: 1.0 if name.endswith("_gain") else 0.0})


def _evidence(log: SlamLog, calibration: RobotCalibration, batch: Batch) -> dict[str, Any]:
    run = run_log(log, calibration, "ekf", SETTINGS)
    nis, area = run.seen.nis[run.seen.accepted], field_area(log)
    error = np.sqrt(np.diag(batch.free_cov))
    return {
        "log": log.name,
        "dropped": dict(log.dropped),
        "own_gains": {
            name: [float(getattr(batch.calibration, name)), float(e)]
            for name, e in zip(batch.free, error, strict=True)
        },
        "log_likelihood": log_likelihood(run, area),
        "innovations": len(run.seen.ids),
        "rejected": run.rejected,
        "log_likelihood_by_gate": {
            str(gate): log_likelihood(run_log(log, calibration, "ekf", replace(SETTINGS, gate=gate)), area)
            for gate in GATES
        },
        "log_likelihood_iekf": {
            moments: log_likelihood(run_log(log, calibration, build, SETTINGS), area)
            for moments, build in (("gaussian", iekf), ("first_order", iekf_first_order))
        },
        "log_likelihood_without": {
            name: log_likelihood(run_log(log, _neutral(calibration, name), "ekf", SETTINGS), area)
            for name in batch.free
        },
        "nis_mean_of_2": float(nis.mean()),
        "nis_quantiles_50_90_99": np.quantile(nis, [0.5, 0.9, 0.99]).tolist(),
        "repeated_sightings": repeated_sightings(log),
        "batch_sighting_rms": np.sqrt(np.mean(batch.sightings[batch.used] ** 2, 0)).tolist(),
        "batch_used_share": float(batch.used.mean()),
    }
