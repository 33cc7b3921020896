"""The numbers on real logs, and broken filters that miss them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from vslam_ref.datasets import catalogue, mrclam, noise
from vslam_ref.datasets import victoria_park as park
from vslam_ref.filters import observation
from vslam_ref.filters.block_covariance import kalman_update_in_place
from vslam_ref.filters.carleman_ekf import carleman_ekf
from vslam_ref.filters.ekf_slam import EkfSlam, expected
from vslam_ref.filters.estimates import Innovation
from vslam_ref.filters.observation import ObservationJacobians
from vslam_ref.filters.vehicle import Increment
from vslam_ref.systems.slam_log import (
    FILTERS,
    LogRun,
    LogTruth,
    RunSettings,
    SlamLog,
    place,
    run_log,
    summary,
)

needs_mrclam = pytest.mark.skipif(
    catalogue.find("utias_mrclam") is None, reason="utias_mrclam is not in VSLAM_REF_DATA"
)
needs_park = pytest.mark.skipif(
    catalogue.find("victoria_park") is None, reason="victoria_park is not in VSLAM_REF_DATA"
)
TARGET = {1: 0.40, 3: 0.20}
"""Aligned position RMSE in metres, by robot, that a good filter stays under."""
MISSED = {("iekf", 3): 0.22}
"""Where a filter misses the target, and what it stays under instead: 0.202 m at odometry rate.

Its noises were not made wider or narrower for it.  What is left is blind driving: 0.29 m more than 5 s behind
the last sighting, 0.17 m before, and a linear correction of a heading that is then 0.4 rad off.
"""
NEES_BOUND = 40.0
"""Mean NEES on robot 1 that the filters stay under and broken ones do not; 3 would be consistent."""
QUICK = RunSettings(max_step=0.2, record_period=0.2)
"""Sums of odometry over 0.2 s: a tenth of the steps; the difference is asserted below."""


@cache
def robot(number: int) -> tuple[SlamLog, LogTruth]:
    folder = mrclam.set_folder(catalogue.require("utias_mrclam"))
    log = mrclam.read_log(folder, number)
    return log, mrclam.read_truth(folder, number, log)


@cache
def run(number: int, name: str) -> LogRun:
    return run_log(robot(number)[0], noise.calibration("mrclam"), name, QUICK)


class WrongMotionSign(EkfSlam):
    """F with the wrong sign in its last column: the mean moves rightly, the covariance does not."""

    def predict(self, increment: Increment) -> None:
        x = self.blocks.x_p
        heading = x[:, 2].copy()
        super().predict(Increment(-increment.ds, increment.dalpha, increment.cov))
        x[:, 0] += 2 * increment.ds * np.cos(heading)
        x[:, 1] += 2 * increment.ds * np.sin(heading)


class WrongMeasurementSign(EkfSlam):
    """H with the wrong sign in its heading column."""

    def _jacobians(self, columns: Any) -> ObservationJacobians:
        b = self.blocks
        landmarks = np.stack([b.x_m[:, columns], b.x_m[:, columns + 1]], -1)
        H = observation.vehicle_from_world_with_jacobians(b.x_p[:, None], landmarks)
        H.J_pose[..., 2] *= -1
        return H

    def _update_known(self, columns: Any, z: Any, cov_z: Any, gate: float) -> Innovation:
        seen = expected(self.blocks.state, columns, z, cov_z, self._jacobians(columns))
        kalman_update_in_place(self.blocks.state, seen, gate)
        return Innovation(seen.innovation, seen.S)


class NoCrossTerms(EkfSlam):
    """A new landmark enters uncorrelated with pose and map."""

    def _augment(self, ids: Any, z: Any, cov_z: Any) -> None:
        before = 2 * self.blocks.n
        super()._augment(ids, z, cov_z)
        self.blocks.P_pm[:, :, before:] = 0.0
        self.blocks.P_mm[:, :before, before:] = 0.0
        self.blocks.P_mm[:, before:, :before] = 0.0


class NeverCrossTerms(EkfSlam):
    """Cross covariances of pose and map are forgotten after every update."""

    def update(self, ids: Any, z: Any, cov_z: Any, gate: float = np.inf) -> Innovation | None:
        seen = super().update(ids, z, cov_z, gate)
        self.blocks.P_pm[:] = 0.0
        return seen


@needs_mrclam
@pytest.mark.parametrize("number", [1, 3])
@pytest.mark.parametrize("name", list(FILTERS))
def test_the_filters_reach_the_target_on_mrclam(number: int, name: str) -> None:
    got = summary(run(number, name), robot(number)[1])
    assert got["landmarks"] == 15
    assert got["rmse_position_m"] < MISSED.get((name, number), TARGET[number])


@needs_mrclam
@pytest.mark.parametrize("number", [1, 3])
def test_a_wrong_sign_in_the_measurement_misses_the_target_by_far(number: int) -> None:
    log, truth = robot(number)
    got = summary(run_log(log, noise.calibration("mrclam"), WrongMeasurementSign, QUICK), truth)
    assert got["rmse_position_m"] > 3 * TARGET[number]


@needs_mrclam
@pytest.mark.parametrize("broken", [WrongMotionSign, NoCrossTerms, NeverCrossTerms])
def test_a_broken_covariance_misses_the_consistency_of_the_ekf(broken: type[EkfSlam]) -> None:
    """In a small room, with good gains, these three have the right *mean*; their covariance is a fiction.

    Position errors alone do not show it (they stay under the target), which is why NEES stands beside them.
    """
    log, truth = robot(1)
    got = summary(run_log(log, noise.calibration("mrclam"), broken, QUICK), truth)
    assert got["nees_mean"] > NEES_BOUND
    for name in FILTERS:
        assert summary(run(1, name), truth)["nees_mean"] < NEES_BOUND


@pytest.mark.slow
@needs_mrclam
def test_the_iekf_and_the_anchored_ekf_do_not_care_how_uncertain_the_start_is() -> None:
    """The mechanism of chapter 16 on a real log: P0, which no measurement can reduce, moves the EKF only.

    Both are the same to rounding; for the IEKF with P0 lifted by the Jacobian (exact moments of a start
    that is 0.2 rad uncertain shorten the heading vector, and the whole way with it, by 2 %).
    """
    log, truth = robot(3)
    wide = replace(QUICK, start_sigma_position=0.1, start_sigma_heading=0.2)

    def lifted_by_jacobian(mean: Any, cov: Any, capacity: int) -> Any:
        moments = {"start": "first_order", "control": "gaussian"}
        return carleman_ekf(mean, cov, form="reduced-map", capacity=capacity, **moments)

    change = {}
    for name, build in {**FILTERS, "iekf": lifted_by_jacobian}.items():
        runs = [run_log(log, noise.calibration("mrclam"), build, s) for s in (QUICK, wide)]
        a, b = (place(r, truth, aligned=True) for r in runs)
        assert a is not None
        assert b is not None
        change[name] = np.hypot(*(a.T_run_vehicle - b.T_run_vehicle)[:, :2].T).max()
    assert change["ekf-anchored"] < 1e-6
    assert change["iekf"] < 1e-6
    assert change["ekf"] > 0.1


@pytest.mark.slow
@needs_mrclam
def test_summed_odometry_changes_no_result() -> None:
    """The whole trajectory at odometry rate and in steps of 0.2 s."""
    log, truth = robot(3)
    fine = summary(run_log(log, noise.calibration("mrclam"), "ekf"), truth)
    coarse = summary(run(3, "ekf"), truth)
    assert abs(fine["rmse_position_m"] - coarse["rmse_position_m"]) < 0.01
    assert fine["rejected"] == coarse["rejected"]


@needs_mrclam
@pytest.mark.parametrize("number", [1, 3])
def test_the_batch_solution_is_the_bound(number: int) -> None:
    pytest.importorskip("scipy.sparse", reason="the batch solution")
    from vslam_ref.experiments.slam_log import compare
    from vslam_ref.systems.slam_log.batch import solve_batch

    log, truth = robot(number)
    start = run(number, "ekf")
    batch = solve_batch(log, noise.calibration("mrclam"), start)
    assert batch.converged
    bound = summary(compare.as_run(batch, log, start.times), truth)
    assert bound["rmse_position_m"] < 0.10
    for name in FILTERS:
        assert bound["rmse_position_m"] < summary(run(number, name), truth)["rmse_position_m"]


@needs_park
@pytest.mark.parametrize(
    "name", ["ekf", *(pytest.param(n, marks=pytest.mark.slow) for n in FILTERS if n != "ekf")]
)
def test_victoria_park_stays_with_its_gps(name: str) -> None:
    """Metre level: 3.5 m over 4 km, GPS errors included; dead reckoning alone is tens of metres off."""
    folder = catalogue.require("victoria_park")
    log = park.read_log(folder)
    truth = park.read_truth(folder, log)
    fine = replace(QUICK, max_step=0.05)  # at 3 m/s a step of 0.2 s is half a metre
    got = summary(run_log(log, noise.calibration("victoria_park"), name, fine), truth)
    assert got["landmarks"] == 151
    assert got["rmse_position_m"] < 3.5
    assert got["rmse_position_unaligned_m"] is None
    assert got["nees_mean"] is None
