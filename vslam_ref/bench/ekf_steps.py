"""Our EKF-SLAM step among mapped landmarks, as :class:`EkfSlam` and on plain arrays."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.ekf_step import ekf_step
from vslam_ref.filters.estimates import room_for_innovation
from vslam_ref.worlds.mapped_vehicle import SEEN, MappedVehicle


def class_step(world: MappedVehicle) -> Callable[[], object]:
    """One prediction and one joint update of five landmarks by :class:`EkfSlam`, all checks included."""
    slam, z = world.start(EkfSlam), world.z[None, world.seen]

    def step() -> None:
        slam.predict(world.increment())
        slam.update(world.seen, z, world.cov_z)

    return step


def array_step(world: MappedVehicle) -> Callable[[], object]:
    """The same step by :func:`ekf_step` on plain arrays."""
    b = world.start(EkfSlam).blocks
    columns, z, cov_z = b.columns(world.seen), world.z[None, world.seen], np.tile(world.cov_z, (SEEN, 1, 1))
    state = (b.x_p, b.x_m, b.P_pp, b.P_pm, b.P_mm)
    return partial(ekf_step, *state, *world.increment(), columns, z, cov_z, *room_for_innovation(z))
