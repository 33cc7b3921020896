"""The scene of the filter benchmarks, and our EKF-SLAM step in it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.filters import observation, vehicle
from vslam_ref.filters.ekf_slam import EkfSlam, ekf_predict_in_place, ekf_update_in_place
from vslam_ref.filters.estimates import SlamFilter

SEEN = 5
"""Landmarks seen in a step."""


class World:
    """A vehicle among n landmarks with a dense covariance, and what one step is given."""

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

    def start(self, make: Callable[[Array, Array, int], SlamFilter], batch: int = 1) -> SlamFilter:
        """A filter that has all n landmarks in its map."""
        slam = make(np.tile(self.pose, (batch, 1)), np.diag([0.1, 0.1, 0.01]), self.n)
        for first in range(0, self.n, 10):
            ids = np.arange(first, min(self.n, first + 10))
            slam.update(ids, np.tile(self.z[ids], (batch, 1, 1)), self.cov_z)
        return slam

    def start_ekf(self) -> EkfSlam:
        """An :class:`EkfSlam` that has all n landmarks in its map."""
        slam = self.start(EkfSlam)
        assert isinstance(slam, EkfSlam)
        return slam


def class_step(world: World) -> Callable[[], object]:
    """One prediction and one joint update of five landmarks by :class:`EkfSlam`, all checks included."""
    slam, z = world.start_ekf(), world.z[None, world.seen]

    def step() -> None:
        slam.predict(world.increment())
        slam.update(world.seen, z, world.cov_z)

    return step


def array_step(world: World) -> Callable[[], object]:
    """The same step by the functions on plain arrays, without the class."""
    b = world.start_ekf().blocks
    columns, z, cov_z = b.columns(world.seen), world.z[None, world.seen], np.tile(world.cov_z, (SEEN, 1, 1))
    state, increment = b.state, world.increment()

    def step() -> None:
        ekf_predict_in_place(state, increment)
        ekf_update_in_place(state, columns, z, cov_z, np.inf)

    return step
