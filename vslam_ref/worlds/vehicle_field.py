r"""A vehicle on a square course among point landmarks, with exact truth (seed B, section 4.1).

::

        +-----------------+        a square of the given side, corners rounded;
       /                   \       the true path is B4 itself, noise-free: one lap closes
      |   .        .        |      to rounding, and every lap is the same
      |       .        .    |
      |  .        o-->      |      landmarks uniform in a square; seen within max_range at
       \       .           /       every measurement period, the identity of each known
        +-----------------+

What is random in one run: the start estimate, drawn from P0; the control noise; the measurement
noise.  The true path and the landmarks are the same for all runs.

Positions are in metres, angles in radians, speeds in m/s, times in seconds.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters import observation, vehicle
from vslam_ref.worlds.assumptions import assume, require


@dataclass(frozen=True)
class VehicleFieldConfig:
    """The declared assumptions of the simulated course; the paper gives side, laps and lap time only."""

    side: float = assume(20.0, "m", "B§4.1: a scene of 20 m x 20 m")
    lap_seconds: float = assume(80.0, "s", "B§4.1: each loop takes 80 s")
    laps: int = assume(2, "", "B§4.1: two loops")
    corner_radius: float = assume(2.5, "m", "not given; an Ackermann vehicle cannot turn on the spot")
    dt: float = assume(0.1, "s", "not given; 800 steps a lap")
    wheelbase: float = assume(1.0, "m", "not given; steering stays at 22 degrees in the corners")
    landmarks: int = assume(30, "", "not given")
    landmark_half_width: float = assume(12.0, "m", "not given; the scene and a rim of 2 m outside it")
    measurement_period: float = assume(1.0, "s", "not given")
    max_range: float = assume(6.0, "m", "not given; a few landmarks in view, none all the way")
    sigma_v: float = assume(0.2, "m/s", "not given; one fifth of the speed")
    sigma_phi: float = assume(float(np.deg2rad(3.0)), "rad", "not given; 3 degrees of steering")
    sigma_z: float = assume(0.1, "m", "not given; per coordinate of a relative measurement")

    def __post_init__(self) -> None:
        """Refuse values no world can be built from."""
        lengths = ("side", "corner_radius", "wheelbase", "landmark_half_width", "max_range", "sigma_z")
        positive = (*lengths, "lap_seconds", "dt", "measurement_period", "laps", "landmarks")
        require(self, positive, ("sigma_v", "sigma_phi"))
        if 2 * self.corner_radius > self.side:
            raise ValueError(f"corner_radius={self.corner_radius}: must be at most half the side {self.side}")
        if self.quarter_steps < 2:
            raise ValueError(f"dt={self.dt}: a lap of {self.lap_seconds} s needs at least 8 steps")

    @property
    def quarter_steps(self) -> int:
        """Time steps of a quarter lap."""
        return round(self.lap_seconds / self.dt / 4)

    @property
    def steps(self) -> int:
        """Time steps T of the whole course."""
        return 4 * self.quarter_steps * self.laps

    @property
    def measurement_steps(self) -> int:
        """Time steps from one measurement to the next."""
        return max(1, round(self.measurement_period / self.dt))

    @property
    def cov_u(self) -> Array:
        """Covariance of the control noise on (v, phi)."""
        return np.diag([self.sigma_v**2, self.sigma_phi**2])

    @property
    def cov_z(self) -> Array:
        """Covariance of one relative measurement."""
        return np.diag([self.sigma_z**2, self.sigma_z**2])


class Sighting(NamedTuple):
    """At time step ``step`` (its pose index), the landmarks ``ids`` (m,) at relative places ``z`` (m, 2)."""

    step: int
    ids: IntArray
    z: Array


class VehicleField(NamedTuple):
    """Truth of a course.

    Attributes
    ----------
    config : VehicleFieldConfig
    times : ndarray, shape (T + 1,)
        Seconds.
    T_world_vehicle : ndarray, shape (T + 1, 3)
        Poses (x, y, theta), metres and radians.
    controls : ndarray, shape (T, 2)
        Speed v (m/s) and steering angle phi (rad).
    landmarks : ndarray, shape (n, 2)
        World frame, metres.
    sightings : tuple of Sighting
        What is seen when, without noise.
    """

    config: VehicleFieldConfig
    times: Array
    T_world_vehicle: Array
    controls: Array
    landmarks: Array
    sightings: tuple[Sighting, ...]


class Course(Protocol):
    """What noises are drawn for: controls (T, 2) and sightings; every world with a known path has them."""

    @property
    def controls(self) -> Array:
        """True controls (T, 2)."""

    @property
    def sightings(self) -> tuple[Sighting, ...]:
        """What is seen when."""


class Noise(NamedTuple):
    """Standard normal draws of B runs: start (B, 3), controls (B, T, 2), one (B, m, 2) array per sighting."""

    start: Array
    controls: Array
    sightings: tuple[Array, ...]


def course(config: VehicleFieldConfig) -> tuple[Array, Array]:
    """True poses (T + 1, 3) and controls (T, 2) of the rounded square.

    A quarter lap is ``k`` straight steps, then ``c`` steps that turn by pi/(2c) each.  Its polygon has
    four-fold symmetry, so the lap closes exactly; the speed is set so that the polygon is ``side``
    wide.  The start is in the middle of the lower side, heading along +x.
    """
    q = config.quarter_steps
    arc_share = np.pi / 2 * config.corner_radius / (config.side - (2 - np.pi / 2) * config.corner_radius)
    c = min(q - 1, max(1, round(q * arc_share)))
    turn = np.pi / 2 / c
    # width of the polygon in steps: the straight ones, then what the turning ones add ahead (cos)
    # and, from the next corner's mirror image, sideways (sin)
    angles = turn * np.arange(1, c + 1)
    width = (q - c) + np.cos(angles).sum() + np.sin(angles).sum()
    v = config.side / (width * config.dt)
    phi = np.arctan2(turn * config.wheelbase, v * config.dt)
    turning = np.concatenate([np.arange(q - c), np.arange(c)]) * 0.0
    turning[q - c :] = phi
    lap = np.roll(np.tile(turning, 4), -((q - c) // 2))
    controls = np.stack([np.full(config.steps, v), np.tile(lap, config.laps)], -1)
    increments = vehicle.ackermann(controls, config.wheelbase, config.dt)
    poses = np.zeros((config.steps + 1, 3))
    poses[0] = [0.0, -config.side / 2, 0.0]
    for k in range(config.steps):
        poses[k + 1] = vehicle.propagate(poses[k], increments[k])
    poses[:, 0] -= (poses[:, 0].max() + poses[:, 0].min()) / 2
    return poses, controls


def make_field(config: VehicleFieldConfig, rng: np.random.Generator) -> VehicleField:
    """Build the course, draw the landmarks and list what is seen when."""
    poses, controls = course(config)
    w = config.landmark_half_width
    landmarks: Array = rng.uniform(-w, w, (config.landmarks, 2))
    looks = range(0, config.steps + 1, config.measurement_steps)
    sightings = seen_within(config.max_range, looks, poses, landmarks)
    times: Array = config.dt * np.arange(config.steps + 1, dtype=np.float64)
    return VehicleField(config, times, poses, controls, landmarks, sightings)


def seen_within(
    max_range: float, steps: Iterable[int], T_world_vehicle: Array, landmarks: Array
) -> tuple[Sighting, ...]:
    """List which landmarks (n, 2) lie within ``max_range`` of T_world_vehicle (T, 3), at the given steps."""
    sightings = []
    for step in steps:
        z = observation.vehicle_from_world(T_world_vehicle[step], landmarks)
        ids = np.flatnonzero(np.hypot(z[:, 0], z[:, 1]) <= max_range)
        if len(ids):
            sightings.append(Sighting(step, ids, z[ids]))
    return tuple(sightings)


def draw_noise(world: Course, generators: list[np.random.Generator]) -> Noise:
    """Draw the noises of B runs, each from its own generator: the same bytes in any batch."""
    start = np.stack([g.standard_normal(3) for g in generators])
    controls = np.stack([g.standard_normal(world.controls.shape) for g in generators])
    sightings = [[g.standard_normal(s.z.shape) for s in world.sightings] for g in generators]
    return Noise(start, controls, tuple(np.stack(z) for z in zip(*sightings, strict=True)))
