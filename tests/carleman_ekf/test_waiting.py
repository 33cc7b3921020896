"""Increments that wait: when they are used changes nothing but rounding.

A few dozen products and sums of numbers of size 10 at most, with covariances of size 1: 1e-12 is a
hundred times their rounding and far below the effect of one forgotten increment.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from vslam_ref.filters.carleman_ekf import ReducedCarlemanEkf
from vslam_ref.filters.carleman_ekf.reduced import WAITING
from vslam_ref.filters.vehicle import Increment

ROUNDING = 1e-12
COV_Z = np.diag([0.02, 0.03])


def increments(count: int) -> list[Increment]:
    rng = np.random.default_rng(3)
    cov = np.array([[1e-3, 2e-4], [2e-4, 5e-4]])
    return [
        Increment(rng.uniform(0.0, 0.5, 2), rng.normal(0.0, 0.3, 2), np.stack([cov, 2 * cov]))
        for _ in range(count)
    ]


def start(control: str) -> ReducedCarlemanEkf:
    slam = ReducedCarlemanEkf([[0, 0, 0.3], [1, 2, -2.0]], 0.1 * np.eye(3), control=control)
    slam.update([0, 1, 2], [[[3, 1], [2, -1], [4, 0]], [[1, 1], [2, 2], [3, -1]]], COV_Z)
    return slam


def state(slam: ReducedCarlemanEkf) -> tuple[np.ndarray, ...]:
    slam.update([0, 2], [[[2.5, 0.5], [3.5, 0.1]], [[0.7, 0.8], [2.5, -0.8]]], COV_Z)
    return *slam.pose(), *slam.blocks.full()


def assert_same(a: tuple[np.ndarray, ...], b: tuple[np.ndarray, ...]) -> None:
    for x, y in zip(a, b, strict=True):
        assert np.abs(x - y).max() < ROUNDING


@pytest.mark.parametrize("control", ["first_order", "gaussian"])
@pytest.mark.parametrize("count", [1, 3, WAITING, 2 * WAITING + 5])
def test_reading_the_pose_between_predictions_changes_nothing(control: str, count: int) -> None:
    silent, read = start(control), start(control)
    for increment in increments(count):
        silent.predict(increment)
        read.predict(increment)
        read.pose()
    assert_same(state(silent), state(read))


def test_an_increment_may_be_overwritten_by_its_owner() -> None:
    slam, owner = start("first_order"), start("first_order")
    room = Increment(np.empty(2), np.empty(2), np.empty((2, 2, 2)))
    for increment in increments(5):
        slam.predict(increment)
        for mine, given in zip(room, increment, strict=True):
            mine[...] = given
        owner.predict(room)
        for mine in room:
            mine[...] = np.nan
    assert_same(state(slam), state(owner))


def test_a_copy_has_its_own_waiting_increments() -> None:
    first, *rest = increments(4)
    slam, alone = start("first_order"), start("first_order")
    slam.predict(first)
    alone.predict(first)
    twin: Any = copy.deepcopy(slam)
    for increment in rest:
        twin.predict(first)
        alone.predict(first)
        slam.predict(increment)
    assert_same(state(twin), state(alone))


def test_a_measurement_of_new_landmarks_only_meets_them_too() -> None:
    """No known landmark is seen: what waits still goes into the map before the new ones enter."""
    silent, read = start("first_order"), start("first_order")
    for slam in (silent, read):
        for increment in increments(3):
            slam.predict(increment)
            if slam is read:
                slam.pose()
        assert slam.update([7], [[[1.0, 2.0]], [[2.0, 1.0]]], COV_Z) is None
    assert_same(state(silent), state(read))
