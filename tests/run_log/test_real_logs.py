"""The numbers on real logs, and broken filters that miss them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from vslam_ref.datasets import catalogue, mrclam, noise
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.vehicle import Increment
from vslam_ref.systems.slam_log import FILTERS, LogRun, RunSettings, SlamLog, Truth, run_log, summary

needs_mrclam = pytest.mark.skipif(
    catalogue.find("utias_mrclam") is None, reason="utias_mrclam is not in VSLAM_REF_DATA"
)
needs_park = pytest.mark.skipif(
    catalogue.find("victoria_park") is None, reason="victoria_park is not in VSLAM_REF_DATA"
)
TARGET = {1: 0.40, 3: 0.20}
"""Aligned position RMSE in metres, by robot, that both filters must stay under."""
QUICK = RunSettings(max_step=0.1)
"""Sums of odometry over 0.1 s: a fifth of the time; the difference is asserted below."""


@cache
def robot(number: int) -> tuple[SlamLog, Truth]:
    folder = mrclam.set_folder(catalogue.require("utias_mrclam"))
    log = mrclam.read_log(folder, number)
    return log, mrclam.read_truth(folder, number, log)


@cache
def run(number: int, name: str) -> LogRun:
    return run_log(robot(number)[0], noise.calibration("mrclam"), name, QUICK)


class SignFlip(EkfSlam):
    """F with the wrong sign in its last column: the mean moves rightly, the covariance does not."""

    def predict(self, increment: Increment) -> None:
        x = self.blocks.x_p
        heading = x[:, 2].copy()
        super().predict(Increment(-increment.ds, increment.dalpha, increment.cov))
        x[:, 0] += 2 * increment.ds * np.cos(heading)
        x[:, 1] += 2 * increment.ds * np.sin(heading)


class NoCrossTerms(EkfSlam):
    """A new landmark enters uncorrelated with pose and map."""

    def _augment(self, ids: Any, z: Any, cov_z: Any) -> None:
        before = 2 * self.blocks.n
        super()._augment(ids, z, cov_z)
        self.blocks.P_pm[:, :, before:] = 0.0
        self.blocks.P_mm[:, :before, before:] = 0.0
        self.blocks.P_mm[:, before:, :before] = 0.0


@needs_mrclam
@pytest.mark.parametrize("number", [1, 3])
@pytest.mark.parametrize("name", list(FILTERS))
def test_the_filters_reach_the_target_on_mrclam(number: int, name: str) -> None:
    got = summary(run(number, name), robot(number)[1])
    assert got["landmarks"] == 15
    assert got["rmse_position_m"] < TARGET[number]


@needs_mrclam
@pytest.mark.parametrize("number", [1, 3])
@pytest.mark.parametrize("broken", [SignFlip, NoCrossTerms])
def test_a_broken_filter_misses_the_target(number: int, broken: type[EkfSlam]) -> None:
    log, truth = robot(number)
    got = summary(run_log(log, noise.calibration("mrclam"), broken, QUICK), truth)
    assert got["rmse_position_m"] > TARGET[number]


@needs_mrclam
def test_summed_odometry_changes_no_result(number: int = 3) -> None:
    """The whole trajectory at odometry rate and in steps of 0.1 s."""
    log, truth = robot(number)
    fine = summary(run_log(log, noise.calibration("mrclam"), "ekf"), truth)
    coarse = summary(run(number, "ekf"), truth)
    assert abs(fine["rmse_position_m"] - coarse["rmse_position_m"]) < 0.01
    assert fine["rejected"] == coarse["rejected"]
