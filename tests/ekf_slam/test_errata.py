"""Two slips in the words of B: what L measures (B6), and whose coordinates a sighting has (B20)."""

from __future__ import annotations

import numpy as np

from vslam_ref.filters import observation, vehicle
from vslam_ref.geometry import se2

EPS = np.finfo(float).eps
AXLES, WHEELS = 2.7, 1.5  # wheelbase and track width of an ordinary car, metres
SPEED, STEERING, DT = 4.0, 0.3, 0.01


def direction_of_the_front_wheel(length: float) -> float:
    """Angle of the front axle's velocity in the vehicle, when B4 is given ``length`` as L."""
    _, turn = vehicle.ackermann([SPEED, STEERING], wheelbase=length, dt=DT)
    return float(np.arctan2(turn / DT * AXLES, SPEED))  # a rigid body: v + omega x (AXLES, 0)


def test_wheels_roll_without_slip_only_with_the_wheelbase() -> None:
    # One quotient, one product, one tangent and its inverse: a few roundings of numbers near 1.
    assert abs(direction_of_the_front_wheel(AXLES) - STEERING) < 8 * EPS
    assert abs(direction_of_the_front_wheel(WHEELS) - STEERING) > 0.1  # as printed: 12 degrees of slip


def test_a_sighting_is_relative_and_not_global() -> None:
    pose, landmark = np.array([3.0, -2.0, -1.2]), np.array([5.0, 4.0])
    elsewhere = np.array([-40.0, 25.0, 2.1])  # the same scene, somewhere else in the world
    moved_pose, moved_landmark = se2.compose(elsewhere, pose), se2.act(elsewhere, landmark)
    seen = observation.vehicle_from_world(pose, landmark)
    # Coordinates up to 50 m, two rotations and a sum each way: rounding stays below 16 eps times 50.
    assert np.abs(observation.vehicle_from_world(moved_pose, moved_landmark) - seen).max() < 16 * 50 * EPS
    # As printed, "global coordinates" would move with the scene and be the landmark itself.
    assert np.abs(moved_landmark - landmark).max() > 10.0
    assert np.abs(seen - landmark).max() > 1.0
