"""A vehicle in the middle of its map, and what a filter's cycle costs there."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from vslam_ref.arrays import Array
from vslam_ref.filters import observation, vehicle
from vslam_ref.filters.carleman_ekf import carleman_ekf
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.estimates import SlamFilter
from vslam_ref.support.timing import paired

Slam = TypeVar("Slam", bound=SlamFilter)
SEEN = 5
"""Landmarks measured in a step."""
PAPER_POSE_RATIO = 23.05 / 19.26
"""B, table 1: time of the camera pose estimation, IEKF over EKF."""


class MappedVehicle:
    """A vehicle among n landmarks that are all in its map, with a dense covariance."""

    def __init__(self, n: int) -> None:
        rng = np.random.default_rng(n)
        self.n = n
        self.landmarks = rng.uniform(-10, 10, (n, 2))
        self.pose = np.array([0.0, 0.0, 0.1])
        self.seen = rng.permutation(n)[:SEEN]
        self.z = observation.vehicle_from_world(self.pose, self.landmarks)
        self.control = np.array([[1.0, 0.1]])
        self.cov_u, self.cov_z = np.diag([0.04, 0.003]), 0.01 * np.eye(2)

    def increment(self, batch: int = 1) -> vehicle.Increment:
        """A tenth of a second at 1 m/s, steering 0.1 rad."""
        return vehicle.ackermann_increment(np.tile(self.control, (batch, 1)), self.cov_u, 1.0, 0.1)

    def start(self, make: Callable[[Array, Array, int], Slam], batch: int = 1) -> Slam:
        """A filter, made by ``make(mean, cov, capacity)``, that has all n landmarks in its map."""
        slam = make(np.tile(self.pose, (batch, 1)), np.diag([0.1, 0.1, 0.01]), self.n)
        for first in range(0, self.n, 10):
            ids = np.arange(first, min(self.n, first + 10))
            slam.update(ids, np.tile(self.z[ids], (batch, 1, 1)), self.cov_z)
        return slam

    def cycle(self, slam: SlamFilter, batch: int = 1, read_pose: bool = False) -> Callable[[], None]:
        """Ten predictions, the pose read after each if asked for, and one update of five landmarks."""
        increment, z = self.increment(batch), np.tile(self.z[self.seen], (batch, 1, 1))

        def go() -> None:
            for _ in range(10):
                slam.predict(increment)
                if read_pose:
                    slam.pose()
            slam.update(self.seen, z, self.cov_z)

        return go


def cycle_ratios(batch: int, landmarks: int, repeats: int = 9, read_pose: bool = False) -> dict[str, float]:
    """Time of a cycle of each form of the IEKF over the EKF's: median of paired ratios, one thread."""
    world = MappedVehicle(landmarks)
    cycles = {"ekf": world.cycle(world.start(EkfSlam, batch), batch, read_pose)}
    for form in ("reduced", "reduced-map", "lifted"):
        make = partial(_carleman, form)
        cycles[form] = world.cycle(world.start(make, batch), batch, read_pose)
    with threadpool_limits(1):
        ratio = paired(cycles, repeats).ratio
    return {form: ratio[form] for form in cycles if form != "ekf"}


def _carleman(form: str, mean: Array, cov: Array, capacity: int) -> SlamFilter:
    return carleman_ekf(mean, cov, form, capacity)
