r"""A car that steers through waypoints past landmarks: the setup of Bailey's simulator, with exact truth.

::

        x - - - x - - - x         x  waypoints, driven round twice; the wheel turns at most ``steer_rate``
       /   .         .   \\        .  landmarks, seen in the half-plane ahead within ``max_range``,
      x       .   .       x          as range and bearing
       \    .      .     /
        x - - o-> - - - x         speed: that of the steered FRONT wheel

Bailey's model moves the pose by V along theta + G and turns it by V sin(G) / L.  Here the pose is that of
the *rear* axle, so that B4 and every filter of the package apply: a front wheel at speed V moves the rear
axle at V cos(G), and the turn V cos(G) tan(G) / L is the same V sin(G) / L.  The sensor sits on the rear
axle, too.

Numbers: the configuration file of the simulator (V = 3 m/s, L = 4 m, 0.3 m/s, 3 degrees, 0.1 m, 1 degree,
30 m, 40 Hz controls, 5 Hz sightings, two loops, P0 = 0).  Waypoints and landmarks are this module's own: a
loop of some 380 m with bends to both sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.filters import observation, vehicle
from vslam_ref.geometry import so2
from vslam_ref.worlds.assumptions import assume, require
from vslam_ref.worlds.vehicle_field import Sighting

MIN_RANGE = 1.0
"""Metres; nearer landmarks are not reported, as the conversion from range and bearing needs r >> sigma_R."""


@dataclass(frozen=True)
class WaypointConfig:
    """Bailey's numbers, and the declared course."""

    speed: float = assume(3.0, "m/s", "Bailey: speed V of the front wheel")
    max_steer: float = assume(float(np.deg2rad(30.0)), "rad", "Bailey: 30 degrees")
    steer_rate: float = assume(float(np.deg2rad(20.0)), "rad/s", "Bailey: 20 degrees a second")
    wheelbase: float = assume(4.0, "m", "Bailey: 4 m")
    dt: float = assume(0.025, "s", "Bailey: 40 controls a second")
    sighting_steps: int = assume(8, "", "Bailey: a sighting every 8 controls")
    max_range: float = assume(30.0, "m", "Bailey: 30 m, in the half-plane ahead")
    sigma_v: float = assume(0.3, "m/s", "Bailey: 0.3 m/s")
    sigma_g: float = assume(float(np.deg2rad(3.0)), "rad", "Bailey: 3 degrees")
    sigma_range: float = assume(0.1, "m", "Bailey: 0.1 m")
    sigma_bearing: float = assume(float(np.deg2rad(1.0)), "rad", "Bailey: 1 degree")
    near: float = assume(1.0, "m", "Bailey: a waypoint is reached within 1 m")
    loops: int = assume(2, "", "Bailey: two rounds")
    waypoints: tuple[float, ...] = assume(
        (20, -2, 50, -6, 66, 14, 56, 38, 66, 62, 44, 78, 18, 64, -10, 76, -36, 62, -28, 34, -40, 10, -14, -4),
        "m",
        "not given as text; x, y of a loop of some 380 m, with bends to both sides",
    )
    landmarks: int = assume(35, "", "not given as text; one on every 11 m of the loop")
    margin: float = assume(15.0, "m", "not given; landmarks lie up to half the range outside the waypoints")

    def __post_init__(self) -> None:
        """Refuse values no course can be built from."""
        names = ("speed", "max_steer", "steer_rate", "wheelbase", "dt", "sighting_steps", "max_range")
        require(
            self,
            (*names, "sigma_range", "near", "loops", "landmarks", "margin"),
            ("sigma_v", "sigma_g", "sigma_bearing"),
        )
        if len(self.waypoints) % 2 or len(self.waypoints) < 6:
            raise ValueError(
                f"waypoints: need x, y of three points or more, got {len(self.waypoints)} numbers"
            )
        if not self.max_steer < np.pi / 2:
            raise ValueError(f"max_steer={self.max_steer}: must be less than pi / 2")

    @property
    def cov_u(self) -> Array:
        """Covariance of the noise on (V, G)."""
        return np.diag([self.sigma_v**2, self.sigma_g**2])


class WaypointCourse(NamedTuple):
    """Truth of a course.

    Attributes
    ----------
    config : WaypointConfig
    times : ndarray, shape (T + 1,)
        Seconds.
    T_world_vehicle : ndarray, shape (T + 1, 3)
        Poses (x, y, theta) of the rear axle, metres and radians.
    controls : ndarray, shape (T, 2)
        Front wheel speed V (m/s) and steering angle G (rad).
    landmarks : ndarray, shape (n, 2)
        World frame, metres.
    sightings : tuple of Sighting
        Range and bearing (m, 2), metres and radians, without noise.
    """

    config: WaypointConfig
    times: Array
    T_world_vehicle: Array
    controls: Array
    landmarks: Array
    sightings: tuple[Sighting, ...]


class RearControl(NamedTuple):
    """Rear axle control (..., 2) = (v, phi) and its covariance (..., 2, 2)."""

    control: Array
    cov: Array


def rear_axle_control(control: ArrayLike, cov_u: ArrayLike) -> RearControl:
    """Turn front wheel controls (V, G) into rear axle controls (V cos G, G), the covariance to first order.

    Parameters
    ----------
    control : array_like, shape (..., 2)
        Front wheel speed V (m/s) and steering angle G (rad).
    cov_u : array_like, shape (2, 2)
        Covariance of (V, G).
    """
    u = np.asarray(control, dtype=np.float64)
    V, G = u[..., 0], u[..., 1]
    J = np.zeros((*u.shape, 2))
    J[..., 0, 0], J[..., 0, 1], J[..., 1, 1] = np.cos(G), -V * np.sin(G), 1.0
    cov = J @ np.asarray(cov_u, dtype=np.float64) @ J.swapaxes(-1, -2)
    return RearControl(np.stack([V * np.cos(G), G], -1), cov)


def make_waypoint_course(config: WaypointConfig, rng: np.random.Generator) -> WaypointCourse:
    """Drive through the waypoints, draw the landmarks and list what is seen when.

    Raises
    ------
    ValueError
        If a waypoint is never reached: the car circles round it.
    """
    points = np.array(config.waypoints, dtype=np.float64).reshape(-1, 2)
    poses, controls = _drive(config, points)
    low, high = points.min(0) - config.margin, points.max(0) + config.margin
    landmarks: Array = rng.uniform(low, high, (config.landmarks, 2))
    sightings = []
    for k in range(config.sighting_steps, len(poses), config.sighting_steps):
        z = observation.vehicle_from_world(poses[k], landmarks)
        r = np.hypot(z[:, 0], z[:, 1])
        ids = np.flatnonzero((r < config.max_range) & (r > MIN_RANGE) & (z[:, 0] > 0))
        if len(ids):
            polar = np.stack([r[ids], np.arctan2(z[ids, 1], z[ids, 0])], -1)
            sightings.append(Sighting(k, ids, polar))
    times: Array = config.dt * np.arange(len(poses), dtype=np.float64)
    return WaypointCourse(config, times, poses, controls, landmarks, tuple(sightings))


def _drive(config: WaypointConfig, points: Array) -> tuple[Array, Array]:
    """Poses (T + 1, 3) and controls (T, 2); starts at the last waypoint, headed for the first."""
    start, d = points[-1], points[0] - points[-1]
    pose, steer = np.array([*start, np.arctan2(d[1], d[0])]), 0.0
    poses, controls = [pose], []
    ways = np.tile(points, (config.loops, 1))
    turn = config.steer_rate * config.dt
    for target, origin in zip(ways, np.roll(ways, 1, axis=0), strict=True):
        allowed = int(3 * np.linalg.norm(target - origin) / (config.speed * config.dt)) + 1
        while np.linalg.norm(target - pose[:2]) > config.near:
            if allowed == 0:
                raise ValueError(f"waypoints: {target.tolist()} is never reached; bend the course less")
            allowed -= 1
            ahead = float(so2.wrap(np.arctan2(*(target - pose[:2])[::-1]) - pose[2]))
            steer = float(
                np.clip(ahead, max(steer - turn, -config.max_steer), min(steer + turn, config.max_steer))
            )
            controls.append((config.speed, steer))
            rear = config.speed * np.cos(steer)
            pose = vehicle.propagate(pose, vehicle.ackermann((rear, steer), config.wheelbase, config.dt))
            poses.append(pose)
    return np.array(poses), np.array(controls)
