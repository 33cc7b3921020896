"""A simulated recording as the maps and the filter want it."""

from __future__ import annotations

from vslam_ref.filters.vehicle import Increment
from vslam_ref.grids import Scan
from vslam_ref.worlds.floor_plan import Recording


def scan_of(recording: Recording, k: int) -> Scan:
    """Scan k as it was measured."""
    return Scan(
        recording.angles, recording.ranges[k], recording.config.laser.max_range, float(recording.times[k])
    )


def increment_of(recording: Recording, k: int) -> Increment | None:
    """What the odometry says of the way to scan k; None for the first one."""
    if k == 0:
        return None
    u, cov = recording.odometry.increment[k - 1], recording.odometry.cov[k - 1]
    return Increment(u[:1].copy(), u[1:].copy(), cov[None].copy())
