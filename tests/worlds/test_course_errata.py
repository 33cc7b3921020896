"""Seconds and metres of B§4.1: the lap closes at 80 s, and 80 m is another moment."""

from __future__ import annotations

import numpy as np

from vslam_ref.worlds import vehicle_field


def test_the_loop_closes_after_80_seconds_and_not_after_80_metres() -> None:
    config = vehicle_field.VehicleFieldConfig()
    poses, controls = vehicle_field.course(config)
    lap = round(80.0 / config.dt)
    metres = np.concatenate([[0.0], np.cumsum(controls[:, 0] * config.dt)])
    # 1600 additions of positions up to 10 m: rounding stays below 1600 * 10 * eps.
    assert np.abs(poses[lap] - poses[0])[:2].max() < 1600 * 10 * np.finfo(float).eps
    # The corners are rounded, so a lap is shorter than the square's 80 m by 8 r - 2 pi r, within one step.
    short = (8 - 2 * np.pi) * config.corner_radius
    assert abs(metres[lap] - (4 * config.side - short)) < controls[:, 0].max() * config.dt
    at_80_metres = int(np.searchsorted(metres, 80.0))
    assert at_80_metres * config.dt > 84.0  # as printed, the closure would come four seconds late
    assert np.hypot(*(poses[at_80_metres] - poses[0])[:2]) > 4.0
