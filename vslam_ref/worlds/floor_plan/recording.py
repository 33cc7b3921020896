"""A run through the floor: what the robot measured, and everything that was true meanwhile."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.filters import vehicle
from vslam_ref.geometry import se2, so2
from vslam_ref.worlds.floor_plan.carts import with_carts
from vslam_ref.worlds.floor_plan.config import FloorPlanConfig
from vslam_ref.worlds.floor_plan.crowd import Crowd, nearest_on_segments
from vslam_ref.worlds.floor_plan.plan import PLANS, FloorPlan
from vslam_ref.worlds.floor_plan.rays import cast
from vslam_ref.worlds.floor_plan.robot import Odometry, drive, measure, true_increments

FIXED = 0
"""Number of the object that never moves: walls and furniture together."""


class LaserScan(NamedTuple):
    """One scan: ``angles`` (b,), rad, ``ranges`` (b,), m, in the robot's frame; maximum range, m; time, s."""

    angles: Array
    ranges: Array
    max_range: float
    time: float


class Surfaces(NamedTuple):
    """What stands on the floor at one scan, and whose it is.

    Attributes
    ----------
    segments, discs : ndarray, shapes (m, 4), (k, 3)
        Ends (x, y, x, y) and middle with radius, metres.
    segment_owner, disc_owner : ndarray of int, shapes (m,), (k,)
        Number of the object: 0 fixed, then doors, then things, then people.
    """

    segments: Array
    segment_owner: IntArray
    discs: Array
    disc_owner: IntArray


@dataclass(frozen=True)
class Recording:
    """One run of n scans with b beams among o objects.

    Attributes
    ----------
    config : FloorPlanConfig
    plan : FloorPlan
        With the carts that were drawn.
    times : ndarray, shape (n,)
        Seconds from the start.
    T_world_robot : ndarray, shape (n, 3)
        True poses ``T_world_robot`` (x, y, theta).
    odometry : Odometry
        n - 1 measured increments.
    angles : ndarray, shape (b,)
        Directions of the beams in the robot's frame, radians.
    ranges : ndarray, shape (n, b)
        Measured, metres; ``inf``: nothing within the maximum range; ``nan``: no reading.
    exact_ranges : ndarray, shape (n, b)
        Without noise and dropouts; ``inf`` beyond the maximum range.
    owner : ndarray of int, shape (n, b)
        Object that the beam ends on; -1 for none.
    segments : ndarray, shape (n, m, 4)
        All segments, the fixed ones first.
    segment_owner : ndarray of int, shape (m,)
    discs : ndarray, shape (n, k, 3)
    disc_owner : ndarray of int, shape (k,)
    people : ndarray, shape (n, p, 2)
        Middles of the bodies, metres.
    moving : ndarray of bool, shape (n, o)
        Whether the object's pose changed within the last T seconds.
    """

    config: FloorPlanConfig
    plan: FloorPlan
    times: Array
    T_world_robot: Array
    odometry: Odometry
    angles: Array
    ranges: Array
    exact_ranges: Array
    owner: IntArray
    segments: Array
    segment_owner: IntArray
    discs: Array
    disc_owner: IntArray
    people: Array
    moving: BoolArray

    def __len__(self) -> int:
        return len(self.times)

    def surfaces(self, k: int) -> Surfaces:
        """What stands on the floor at scan k."""
        return Surfaces(self.segments[k], self.segment_owner, self.discs[k], self.disc_owner)

    def scan(self, k: int) -> LaserScan:
        """Scan k as it was measured."""
        return LaserScan(self.angles, self.ranges[k], self.config.laser.max_range, float(self.times[k]))

    def increment(self, k: int) -> vehicle.Increment | None:
        """What the odometry says of the way to scan k; None for the first one."""
        if k == 0:
            return None
        u, cov = self.odometry.increment[k - 1], self.odometry.cov[k - 1]
        return vehicle.Increment(u[:1].copy(), u[1:].copy(), cov[None].copy())

    def way(self) -> Iterator[tuple[vehicle.Increment | None, LaserScan]]:
        """Yield increment and scan of every moment, as the robot meets them."""
        return ((self.increment(k), self.scan(k)) for k in range(len(self)))

    @property
    def share_on_people(self) -> float:
        """Share of the beams that end on a person, of those that end on a surface."""
        first = 1 + len(self.plan.doors) + len(self.plan.things)
        return float(np.mean(self.owner[self.owner >= 0] >= first))


def simulate(config: FloorPlanConfig, rng: np.random.Generator, plan: FloorPlan | None = None) -> Recording:
    """Let the crowd walk and the robot drive and look.

    The crowd walks for T seconds before the first scan, so that "moved within the last T seconds" has a
    meaning from the start.  Crowd, odometry and laser draw from generators of their own, spawned from
    ``rng`` in this order: another laser sees the same people.

    Parameters
    ----------
    config : FloorPlanConfig
    rng : numpy.random.Generator
        All randomness comes from it.
    plan : FloorPlan, optional
        Instead of the one that ``config.plan`` names.

    Raises
    ------
    ValueError
        If the plan's name is unknown, or the route comes nearer to a wall, a box or a door than the
        robot's radius.
    """
    for_carts, for_crowd, for_odometry, for_laser = rng.spawn(4)
    if plan is None:
        if config.plan not in PLANS:
            raise ValueError(f"plan {config.plan!r}: need one of {', '.join(PLANS)}")
        plan = PLANS[config.plan]()
    plan = with_carts(plan, config.carts, for_carts, config.robot.radius, config.cart_speed)
    start, increments = true_increments(plan.route, config.robot)
    n = min(len(increments), int(config.duration / config.robot.scan_period))
    increments = increments[:n]
    T_world_robot = drive(start, increments)
    times: Array = config.robot.scan_period * np.arange(n + 1, dtype=np.float64)
    segments = np.stack([np.concatenate([plan.fixed, plan.moved(t)]) for t in times])
    _check_route(T_world_robot, times, segments, config.robot.radius)
    people, discs, moved = _walk(plan, config, times, T_world_robot, for_crowd)
    owners = _owners(plan, people.shape[1], discs.shape[1])
    moving = np.concatenate([_scheduled_moving(plan, times, config.memory), moved], axis=1)
    ranges, exact, owner = _look(config, T_world_robot, segments, discs, owners, for_laser)
    odometry = measure(increments, config.robot, for_odometry)
    return Recording(
        config, plan, times, T_world_robot, odometry, config.laser.angles, ranges, exact,
        owner, segments, owners[0], discs, owners[1], people, moving,
    )  # fmt: skip


def _owners(plan: FloorPlan, people: int, discs: int) -> tuple[IntArray, IntArray]:
    """Objects of all segments, and of all discs."""
    doors, things = len(plan.doors), len(plan.things)
    of_segments = np.concatenate(
        [
            np.full(len(plan.fixed), FIXED),
            FIXED + 1 + np.arange(doors),
            FIXED + 1 + doors + np.repeat(np.arange(things), 4),
        ]
    )
    each = discs // people if people else 1
    return of_segments, FIXED + 1 + doors + things + np.repeat(np.arange(people), each)


def _check_route(T_world_robot: Array, times: Array, segments: Array, radius: float) -> None:
    for k, pose in enumerate(T_world_robot):
        near = float(nearest_on_segments(pose[None, :2], segments[k])[1].min())
        if near < radius:
            raise ValueError(
                f"route: at {times[k]:.1f} s the robot at ({pose[0]:.2f}, {pose[1]:.2f}) is {near:.2f} m "
                f"from a wall, box or door; its radius is {radius} m"
            )


def _walk(
    plan: FloorPlan, config: FloorPlanConfig, times: Array, T_world_robot: Array, rng: np.random.Generator
) -> tuple[Array, Array, BoolArray]:
    """People (n, p, 2), their discs (n, k, 3), and who moved within the last T seconds (n, p)."""
    period, dt = config.robot.scan_period, config.crowd.step
    substeps = max(round(period / dt), 1)
    crowd_config = dataclasses.replace(config.crowd, step=period / substeps)
    before = int(np.ceil(config.memory / period))
    crowd = Crowd(plan, crowd_config, -before * period, rng)
    trail, discs = [], []
    for k in range(-before, len(times)):
        if k >= 0:
            discs.append(crowd.discs())
        trail.append(crowd.position.copy())
        here, there = T_world_robot[max(k, 0)], T_world_robot[min(max(k + 1, 0), len(T_world_robot) - 1)]
        for i in range(substeps):
            robot = here[:2] + (i + 1) / substeps * (there[:2] - here[:2])
            crowd.step((k + i / substeps) * period, robot, config.robot.radius)
    history = np.stack(trail)
    people = history[before:]
    moved = np.zeros(people.shape[:2], dtype=bool)
    for back in range(1, before + 1):
        shift = history[before - back : len(history) - back] - people
        moved |= np.hypot(shift[..., 0], shift[..., 1]) >= config.moved_least
    return people, np.stack(discs), moved


def _scheduled_moving(plan: FloorPlan, times: Array, memory: float) -> BoolArray:
    """Whether fixed objects, doors and things changed within the last T seconds, (n, 1 + doors + things)."""
    schedules = [door.angle for door in plan.doors] + [box.T_world_box for box in plan.things]
    rows = [[False, *(s.changed(t, memory) for s in schedules)] for t in times]
    return np.array(rows, dtype=bool)


def _look(
    config: FloorPlanConfig,
    T_world_robot: Array,
    segments: Array,
    discs: Array,
    owners: tuple[IntArray, IntArray],
    rng: np.random.Generator,
) -> tuple[Array, Array, IntArray]:
    """Measured ranges, exact ranges, and the object that each beam ends on; (n, b) each."""
    laser, owner_of = config.laser, np.concatenate(owners)
    exact = np.empty((len(T_world_robot), laser.beams))
    owner = np.empty(exact.shape, dtype=np.int64)
    for k, pose in enumerate(T_world_robot):
        hits = cast(pose[:2], so2.wrap(pose[2] + laser.angles), segments[k], discs[k])
        far = hits.range > laser.max_range
        exact[k] = np.where(far, np.inf, hits.range)
        owner[k] = np.where(far, -1, owner_of[hits.which])
    noisy = np.maximum(exact + laser.sigma * rng.standard_normal(exact.shape), 0.0)
    ranges = np.where(rng.uniform(size=exact.shape) < laser.dropout, np.nan, noisy)
    return ranges, exact, owner


def turned(recording: Recording, angle: float) -> Recording:
    """Return the same run in a world turned about the origin by ``angle`` (rad): rasters lie askew in it."""
    T_new_old = np.array([0.0, 0.0, angle])
    segments = recording.segments.reshape(*recording.segments.shape[:-1], 2, 2)
    discs = recording.discs.copy()
    discs[..., :2] = se2.act(T_new_old, discs[..., :2])
    return dataclasses.replace(
        recording,
        T_world_robot=se2.compose(T_new_old, recording.T_world_robot),
        segments=se2.act(T_new_old, segments).reshape(recording.segments.shape),
        discs=discs,
        people=se2.act(T_new_old, recording.people),
    )
