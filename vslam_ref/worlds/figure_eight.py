r"""A robot on wheels that drives an eight among landmarks, with exact truth.

::

          .      .       .
         _____       _____         two circles, one to the left, one to the right, driven in turn
      . /     \  .  /     \  .     (differential drive: v constant, omega of alternating sign),
       |       | o |       |       again and again; the start is in the middle
        \_____/     \_____/        landmarks all around; a camera that looks ahead reports range
          .      .       .         and bearing of those within its field and its reach

Nothing here is random but the places of the landmarks.  :func:`vslam_ref.systems.slam_log.simulated.log`
makes of it what a robot would have logged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters import observation, vehicle

START = (0.3, -0.2, 0.4)
"""Pose at time 0: metres, metres, radians."""


@dataclass(frozen=True)
class EightConfig:
    """Course and camera; metres, seconds, radians.

    ``side_seconds`` is the time of a turn to one side: with 2 pi / ``turn_rate`` the eight closes.
    """

    seconds: float = 60.0
    dt: float = 0.05
    speed: float = 0.5
    turn_rate: float = 0.25
    side_seconds: float = 8 * np.pi
    steps_between_sightings: int = 10
    field: float = 1.0
    reach: float = 6.0

    def __post_init__(self) -> None:
        """Refuse values no world can be built from."""
        for name, value in vars(self).items():
            if not value > 0:
                raise ValueError(f"{name}={value!r}: must be > 0")
        if self.seconds < 2 * self.dt:
            raise ValueError(f"seconds={self.seconds}: need two steps of {self.dt} s or more")


class Eight(NamedTuple):
    """Truth of a drive.

    Attributes
    ----------
    config : EightConfig
    times : ndarray, shape (T,)
        Seconds from 0.
    controls : ndarray, shape (T, 2)
        (v, omega) in m/s and rad/s; row k holds from times[k] to times[k + 1].
    poses : ndarray, shape (T, 3)
        (x, y, theta) of the robot in the world.
    landmarks : ndarray, shape (n, 2)
        World positions, metres.
    """

    config: EightConfig
    times: Array
    controls: Array
    poses: Array
    landmarks: Array

    def seen(self, step: int, ahead: float = 0.0) -> tuple[IntArray, Array]:
        """Landmarks that a camera sees at a step, ``ahead`` metres in front of the robot's origin.

        Returns
        -------
        ids : ndarray of int, shape (m,)
        polar : ndarray, shape (m, 2)
            Exact range (m) and bearing (rad, to the left) from the camera.
        """
        z = observation.vehicle_from_world(self.poses[step], self.landmarks) - np.array([ahead, 0.0])
        polar = np.stack([np.hypot(z[:, 0], z[:, 1]), np.arctan2(z[:, 1], z[:, 0])], axis=-1)
        ids = np.flatnonzero((np.abs(polar[:, 1]) < self.config.field) & (polar[:, 0] < self.config.reach))
        return ids, polar[ids]


def drive(config: EightConfig, landmarks: Array) -> Eight:
    """Drive past landmarks (n, 2), metres, by the filters' own motion model, :func:`.vehicle.propagate`."""
    times = np.arange(0, config.seconds, config.dt)
    side = np.floor(times / config.side_seconds)
    omega = np.where(side % 2 == 0, config.turn_rate, -config.turn_rate)
    controls = np.column_stack([np.full(len(times), config.speed), omega])
    poses = np.zeros((len(times), 3))
    poses[0] = START
    for k in range(len(times) - 1):
        poses[k + 1] = vehicle.propagate(poses[k], controls[k] * config.dt)
    return Eight(config, times, controls, poses, np.asarray(landmarks, dtype=np.float64))


def scatter(count: int, rng: np.random.Generator, half_width: float = 4.5, apart: float = 0.8) -> Array:
    """Landmarks (count, 2), uniform in a square about the origin, no two nearer than ``apart`` metres.

    Raises
    ------
    ValueError
        If they do not find room in 10,000 draws.
    """
    found = np.zeros((0, 2))
    for _ in range(10_000):
        if len(found) == count:
            return found
        place = rng.uniform(-half_width, half_width, 2)
        if np.hypot(*(found - place).T).min(initial=np.inf) >= apart:
            found = np.vstack([found, place])
    raise ValueError(f"{count} landmarks {apart} m apart in {2 * half_width} m: no room; ask for fewer")
