"""A filter over a log: predict from cut to cut, update at sightings, record the pose.

Every landmark of a sighting is processed by itself, so that the gate of the second already knows what
the first has said.  The gate looks at the innovation y and its covariance S only: a sighting with
y^T S^-1 y above it is counted and left out.  (A gate that looked at the state would break the exact
reduction of seed B's filter, chapter 16.)

The gate is wide on purpose.  A misread barcode is metres off, with y^T S^-1 y in the hundreds.  A robot
that slipped while it saw nothing comes back with 20 or 40, and those sightings are *true*: a gate at the
chi-squared quantile throws away what would have put the filter right, and then the next ones too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters.carleman_ekf import carleman_ekf
from vslam_ref.filters.ekf_slam import AnchoredEkf, EkfSlam
from vslam_ref.filters.estimates import MapEstimate, SlamFilter
from vslam_ref.filters.vehicle import Increment
from vslam_ref.metrics.consistency import nis
from vslam_ref.systems.slam_log.calibration import RobotCalibration
from vslam_ref.systems.slam_log.log import SlamLog
from vslam_ref.systems.slam_log.timeline import Timeline, build_timeline

Build = Callable[[Array, Array, int], SlamFilter]


def iekf(mean: Array, cov: Array, capacity: int) -> SlamFilter:
    """Seed B's filter with its map, and with exact Gaussian moments, from ``mean (3,)`` and ``cov (3, 3)``.

    A heading that has become uncertain by e.g. 0.4 rad shortens the mean of the heading vector.  With
    first-order moments it keeps its length, and a linear correction then makes it, and every landmark's
    distance with it, too long.  :func:`iekf_first_order` shows what that costs.
    """
    return _carleman(mean, cov, capacity, "gaussian")


def iekf_first_order(mean: Array, cov: Array, capacity: int) -> SlamFilter:
    """Seed B's filter, map and all, from ``mean (3,)``, ``cov (3, 3)``; moments lifted to first order."""
    return _carleman(mean, cov, capacity, "first_order")


def _carleman(mean: Array, cov: Array, capacity: int, moments: str) -> SlamFilter:
    form = "reduced-map"
    return carleman_ekf(mean, cov, form=form, capacity=capacity, start=moments, control=moments)


FILTERS: Mapping[str, Build] = {"ekf": EkfSlam, "iekf": iekf, "ekf-anchored": AnchoredEkf}
"""Name in results -> how to build the filter from start mean (3,), covariance (3, 3) and capacity."""


def _setting(default: float, unit: str, reason: str) -> float:
    return field(default=default, metadata={"unit": unit, "reason": reason})


@dataclass(frozen=True)
class RunSettings:
    """How a log is run; nothing here depends on its truth."""

    start_sigma_position: float = _setting(0.02, "m", "how well the start pose is known")
    start_sigma_heading: float = _setting(0.02, "rad", "one degree: axle against motion-capture markers")
    gate: float = _setting(60.0, "", "largest normalised innovation squared; widest that stops misread ids")
    record_period: float = _setting(0.1, "s", "the trajectory is written and judged at this spacing")
    max_step: float = _setting(0.0, "s", "longest prediction; 0: one for every odometry sample")

    def __post_init__(self) -> None:
        """Refuse values no run can use."""
        for name in ("start_sigma_position", "start_sigma_heading", "max_step"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)}: must be >= 0")
        for name in ("gate", "record_period"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)}: must be > 0")

    @property
    def start_cov(self) -> Array:
        """Covariance of the start pose."""
        return np.diag([self.start_sigma_position, self.start_sigma_position, self.start_sigma_heading]) ** 2


class SeenLandmarks(NamedTuple):
    """Every sighting of a landmark already in the map, in order.

    Attributes
    ----------
    times : ndarray, shape (N,)
    ids : ndarray of int, shape (N,)
    polar : ndarray, shape (N, 2)
        As logged.
    innovation : ndarray, shape (N, 2)
        Measured less predicted, metres, vehicle frame.
    S : ndarray, shape (N, 2, 2)
    accepted : ndarray of bool, shape (N,)
    """

    times: Array
    ids: IntArray
    polar: Array
    innovation: Array
    S: Array
    accepted: NDArray[np.bool_]

    @property
    def nis(self) -> Array:
        """Normalised innovation squared of each, shape (N,)."""
        return nis(self.innovation, self.S).value


class LogRun(NamedTuple):
    """What a filter made of a log, in its own frame: the start pose is the origin.

    Attributes
    ----------
    filter : str
    times : ndarray, shape (R,)
        Records, seconds.
    T_run_vehicle : ndarray, shape (R, 3)
        Estimated poses (x, y, theta), metres and radians, in the frame of the start.
    covs : ndarray, shape (R, 3, 3)
        Their covariances.
    map : MapEstimate
        Batch of one.
    seen : SeenLandmarks
    """

    filter: str
    times: Array
    T_run_vehicle: Array
    covs: Array
    map: MapEstimate
    seen: SeenLandmarks

    @property
    def rejected(self) -> int:
        """Sightings left out by the gate."""
        return int(np.sum(~self.seen.accepted))


def record_times(log: SlamLog, settings: RunSettings) -> Array:
    """Times of the records: the log's start, then every ``record_period``.

    Parameters
    ----------
    log : SlamLog
    settings : RunSettings

    Returns
    -------
    ndarray, shape (R,)
        Seconds.
    """
    count = int((log.times[-1] - log.times[0]) / settings.record_period + 1e-9)
    return np.asarray(log.times[0] + settings.record_period * np.arange(count + 1))


def run_log(
    log: SlamLog,
    calibration: RobotCalibration,
    filter: str | Build,
    settings: RunSettings | None = None,
) -> LogRun:
    """Run one filter over a log.

    Parameters
    ----------
    log : SlamLog
    calibration : RobotCalibration
    filter : str or callable
        A name of :data:`FILTERS`, or a function that builds a filter like those.
    settings : RunSettings, optional

    Raises
    ------
    ValueError
        On an unknown filter name, or a log without sightings.
    """
    settings = settings or RunSettings()
    if isinstance(filter, str) and filter not in FILTERS:
        raise ValueError(f"unknown filter {filter!r}; known: {', '.join(FILTERS)}")
    if not log.sightings:
        raise ValueError(f"{log.name}: no sighting of a landmark in the whole log")
    build = FILTERS[filter] if isinstance(filter, str) else filter
    capacity = len({int(i) for s in log.sightings for i in s.ids})
    line = build_timeline(log, calibration, record_times(log, settings), settings.max_step)
    runner = _Runner(build(np.zeros(3), settings.start_cov, capacity), settings.gate)
    _drive(runner, log, calibration, line)
    name = filter if isinstance(filter, str) else getattr(filter, "__name__", "custom")
    poses, covs = (np.concatenate(part) for part in zip(*runner.records, strict=True))
    return LogRun(name, line.times[line.record_at], poses, covs, runner.filter.landmarks(), runner.seen())


def _drive(runner: _Runner, log: SlamLog, calibration: RobotCalibration, line: Timeline) -> None:
    """Walk through the cuts: sightings before records, then the step to the next cut."""
    ds, dalpha, cov = line.increments[:, :1], line.increments[:, 1:], line.cov[:, None]
    sightings, records = line.sighting_at.tolist(), line.record_at.tolist()
    s = r = 0
    for k in range(len(line.times)):
        while s < len(sightings) and sightings[s] == k:
            sighting = log.sightings[s]
            z, cov_z = calibration.measure(sighting.polar)
            for j, identity in enumerate(sighting.ids.tolist()):
                runner.see(sighting.time, identity, sighting.polar[j], z[j], cov_z[j])
            s += 1
        while r < len(records) and records[r] == k:
            runner.records.append(runner.filter.pose())
            r += 1
        if k < len(ds):
            runner.filter.predict(Increment(ds[k], dalpha[k], cov[k]))


class _Runner:
    """A filter, the landmarks it knows, and what it has seen and recorded."""

    def __init__(self, filter: SlamFilter, gate: float) -> None:
        self.filter = filter
        self.gate = gate
        self.records: list[Any] = []
        self._seen: list[tuple[float, int, Array, Array, Array, bool]] = []

    def see(self, time: float, identity: int, polar: Array, z: Array, cov_z: Array) -> None:
        """Use a sighting if the gate lets its innovation pass; a new landmark has none."""
        found = self.filter.update([identity], z[None, None], cov_z, self.gate)
        if found is not None:
            y, S = found.innovation[0], found.S[0]
            passed = bool(y @ np.linalg.solve(S, y) <= self.gate)
            self._seen.append((time, identity, polar, y, S, passed))

    def seen(self) -> SeenLandmarks:
        """Everything seen, as arrays."""
        columns = list(zip(*self._seen, strict=True)) if self._seen else [()] * 6
        shapes = [(-1,), (-1,), (-1, 2), (-1, 2), (-1, 2, 2), (-1,)]
        kinds = [float, np.int64, float, float, float, bool]
        arrays = [np.array(c, dtype=k).reshape(s) for c, k, s in zip(columns, kinds, shapes, strict=True)]
        return SeenLandmarks(*arrays)
