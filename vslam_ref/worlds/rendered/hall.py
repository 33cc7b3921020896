r"""``hall``: the lobby of a building, and a vehicle that drives once around it with a camera on it.

::

        +---------------------------+   28 m from wall to wall, 3.8 m high: walls with posters and doors,
        |  o p   o   b   o   p   o  |   columns o, benches and plants, a counter in the middle.
        |   .-------------------.   |   The vehicle drives the course of seed B against the clock, a square
        |  o|  o     o       o  |o  |   of 20 m with rounded corners: one lap is 79.6 s, 2388 steps of 1/30 s
        |   |     [counter]     |b  |   by B4, so that frame 2388 would be frame 0 again.
        |  o|  o     o       o  |o  |
        |   '--------o->--------'   |   ``hall`` looks to the right of the vehicle (outwards), ``hall-ahead``
        |  o b   o   p   o   b   o  |   along it; level, 1.2 m above the floor, f = 525 px for 640 x 480.
        +---------------------------+

Landmarks are the corners of posters and of what is printed on them, on columns and on furniture.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters import vehicle
from vslam_ref.geometry import so3
from vslam_ref.geometry.camera_pose import pose_from_centre
from vslam_ref.worlds.rendered import hall_things, motion
from vslam_ref.worlds.rendered.quads import Built
from vslam_ref.worlds.vehicle_field import VehicleFieldConfig, course

Rng = np.random.Generator
RATE = 30.0
"""Steps of the vehicle a second; pictures are taken at them."""
COURSE = VehicleFieldConfig(lap_seconds=79.6, laps=1, dt=1 / RATE)
FRAMES = 2387
SECONDS = FRAMES / RATE
EYE = 1.2
"""Metres from the floor to the camera."""
FOCAL = 525.0 / 640.0
AHEAD = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""R_cam_vehicle of a camera that looks along x of the vehicle; its rows are the camera's axes there."""
RIGHT = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]])
"""R_cam_vehicle of a camera that looks along -y of the vehicle."""


def build(rng: Rng) -> Built:
    """The lobby: quads in metres, textures, and landmarks in metres."""
    return hall_things.build(rng)


@cache
def _lap() -> tuple[Array, Array]:
    """Poses (2389, 3) at the steps, metres and radians, and (ds, dalpha) (2388, 2) between them."""
    poses, controls = course(COURSE)
    return poses, vehicle.ackermann(controls, COURSE.wheelbase, COURSE.dt)


def steps_of_lap() -> int:
    """Steps of one lap."""
    return len(_lap()[1])


def vehicle_at(times: ArrayLike) -> Array:
    """Poses (x, y, theta) of the vehicle (..., 3), metres and radians, at times (...), seconds.

    Between two steps it has done that share of the step's way, and then of its turn; a lap follows a lap.

    Examples
    --------
    >>> vehicle_at([0.0, 79.6]).round(3).tolist()
    [[-0.032, -10.0, 0.0], [-0.032, -10.0, 0.0]]
    """
    poses, increments = _lap()
    s = np.asarray(times, np.float64) * RATE
    whole = np.rint(s)
    s = np.where(np.abs(s - whole) < 1e-9, whole, s)  # k / 30 * 30 is k, nearly
    floor = np.floor(s)
    k: IntArray = floor.astype(np.int64) % len(increments)
    return vehicle.propagate(poses[k], (s - floor)[..., None] * increments[k])


def _path(R_cam_vehicle: Array) -> motion.Path:
    def path(t: Array) -> Array:
        at = vehicle_at(t)
        turn = np.zeros_like(at)
        turn[..., 2] = at[..., 2]
        R_world_vehicle = so3.exp(turn)
        centre = np.concatenate([at[..., :2], np.full((*at.shape[:-1], 1), EYE)], -1)
        return pose_from_centre(R_cam_vehicle @ np.swapaxes(R_world_vehicle, -1, -2), centre)

    return path


def path_right(rng: Rng) -> motion.Path:
    """The camera that looks to the right; ``rng`` is not used, as the course is given."""
    return _path(RIGHT)


def path_ahead(rng: Rng) -> motion.Path:
    """The camera that looks ahead; ``rng`` is not used, as the course is given."""
    return _path(AHEAD)
