r"""A robot that drives in circles past landmarks: a public setup of consistency studies, with exact truth.

::

            .   .   .            landmarks evenly spaced on a circle concentric with the path,
         .    _____    .         ``landmark_offset`` outside it
        .   /       \   .
        .  |    +    |  .        differential drive: v and omega constant; the start is at the origin,
        .   \       /   .        heading along +x, so the centre is (0, v / omega)
         .   `-o->-'   .
            .   .   .

The numbers are those of the observability-constrained EKF study of Huang, Mourikis and Roumeliotis (IJRR
2010), as the public code of UKF-M runs them (Brossard, Barrau and Bonnabel; repository
CAOR-MINES-ParisTech/ukfm, python/benchmarks/slam2d.py and python/ukfm/model/slam2d.py): odometry noise
0.05 v / sqrt(2) in speed and 0.05 v 2 sqrt(2) in turn rate, for wheels that err by 5 % of the speed on an
axle of 0.5 m; relative landmark positions; P0 = 0.  Nothing but the noises is random.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.filters import vehicle
from vslam_ref.worlds.assumptions import assume, require
from vslam_ref.worlds.vehicle_field import Sighting, seen_within


@dataclass(frozen=True)
class CircleConfig:
    """The published numbers of the circle."""

    speed: float = assume(0.25, "m/s", "published: 0.25 m/s")
    turn_rate: float = assume(float(np.deg2rad(1.5)), "rad/s", "published: 1.5 degrees a second")
    dt: float = assume(1.0, "s", "published: odometry at 1 Hz")
    steps: int = assume(2499, "", "published: 2500 times, the start included; some ten circles")
    landmarks: int = assume(20, "", "published: 20")
    landmark_offset: float = assume(3.0, "m", "public code: least range, 1 m, plus 2 m")
    max_range: float = assume(5.0, "m", "published: 5 m")
    sigma_v: float = assume(0.05 * 0.25 / np.sqrt(2), "m/s", "public code: 0.05 v / sqrt(2)")
    sigma_omega: float = assume(0.05 * 0.25 * 2 * np.sqrt(2), "rad/s", "public code: 0.05 v 2 sqrt(2)")
    sigma_z: float = assume(0.1, "m", "published: 0.1 m per coordinate")

    def __post_init__(self) -> None:
        """Refuse values no world can be built from."""
        positive = ("speed", "turn_rate", "dt", "steps", "landmarks", "max_range", "sigma_z")
        require(self, positive, ("landmark_offset", "sigma_v", "sigma_omega"))

    @property
    def radius(self) -> float:
        """Radius of the path, metres."""
        return self.speed / self.turn_rate

    @property
    def cov_u(self) -> Array:
        """Covariance of the noise on (v, omega)."""
        return np.diag([self.sigma_v**2, self.sigma_omega**2])


class Circle(NamedTuple):
    """Truth of a course.

    Attributes
    ----------
    config : CircleConfig
    times : ndarray, shape (T + 1,)
        Seconds.
    T_world_vehicle : ndarray, shape (T + 1, 3)
        Poses (x, y, theta), metres and radians.
    controls : ndarray, shape (T, 2)
        v (m/s) and omega (rad/s).
    landmarks : ndarray, shape (n, 2)
        World frame, metres.
    sightings : tuple of Sighting
        What is seen when, without noise.
    """

    config: CircleConfig
    times: Array
    T_world_vehicle: Array
    controls: Array
    landmarks: Array
    sightings: tuple[Sighting, ...]


def make_circle(config: CircleConfig) -> Circle:
    """Build the path by the filters' own motion model, and list what is seen; the start sees nothing.

    The model moves along the old heading and turns then, so the path is a polygon; its corners lie a
    little outside the circle of radius v / omega about (0, v / omega).
    """
    controls = np.tile([config.speed, config.turn_rate], (config.steps, 1))
    poses = np.zeros((config.steps + 1, 3))
    increment = controls[0] * config.dt
    for k in range(config.steps):
        poses[k + 1] = vehicle.propagate(poses[k], increment)
    angle = 2 * np.pi * np.arange(config.landmarks) / config.landmarks
    rho = config.radius + config.landmark_offset
    landmarks = np.stack([rho * np.cos(angle), config.radius + rho * np.sin(angle)], -1)
    sightings = seen_within(config.max_range, range(1, config.steps + 1), poses, landmarks)
    times: Array = config.dt * np.arange(config.steps + 1, dtype=np.float64)
    return Circle(config, times, poses, controls, landmarks, sightings)
