"""A run through the floor: what the robot measured, and everything that was true meanwhile."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.geometry import se2, so2
from vslam_ref.worlds.floor_plan.config import FloorPlanConfig
from vslam_ref.worlds.floor_plan.crowd import Crowd, nearest_on_segments
from vslam_ref.worlds.floor_plan.plan import PLANS, Box, FloorPlan, Schedule, schedule
from vslam_ref.worlds.floor_plan.rays import cast
from vslam_ref.worlds.floor_plan.robot import Odometry, drive, measure, true_increments

FIXED = 0
"""Number of the object that never moves: walls and furniture together."""


class Surfaces(NamedTuple):
    """What stands on the floor at one scan, and whose it is.

    Attributes
    ----------
    segments, discs : ndarray, shapes (m, 4), (k, 3)
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
    poses : ndarray, shape (n, 3)
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
    poses: Array
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

    @property
    def share_on_people(self) -> float:
        """Share of the beams that end on a person, of those that end on anything."""
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
    poses = drive(start, increments)
    times: Array = config.robot.scan_period * np.arange(n + 1, dtype=np.float64)
    segments = np.stack([np.concatenate([plan.fixed, plan.moved(t)]) for t in times])
    _check_route(poses, times, segments, config.robot.radius)
    people, discs, moved = _walk(plan, config, times, poses, for_crowd)
    owners = _owners(plan, people.shape[1], discs.shape[1])
    moving = np.concatenate([_scheduled_moving(plan, times, config.memory), moved], axis=1)
    ranges, exact, owner = _look(config, poses, segments, discs, owners, for_laser)
    return Recording(
        config, plan, times, poses, measure(increments, config.robot, for_odometry), config.laser.angles,
        ranges, exact, owner, segments, owners[0], discs, owners[1], people, moving,
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


def _check_route(poses: Array, times: Array, segments: Array, radius: float) -> None:
    for k, pose in enumerate(poses):
        near = float(nearest_on_segments(pose[None, :2], segments[k])[1].min())
        if near < radius:
            raise ValueError(
                f"route: at {times[k]:.1f} s the robot at ({pose[0]:.2f}, {pose[1]:.2f}) is {near:.2f} m "
                f"from a wall, box or door; its radius is {radius} m"
            )


def _walk(
    plan: FloorPlan, config: FloorPlanConfig, times: Array, poses: Array, rng: np.random.Generator
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
        here, there = poses[max(k, 0)], poses[min(max(k + 1, 0), len(poses) - 1)]
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
    schedules = [door.angle for door in plan.doors] + [box.pose for box in plan.things]
    rows = [[False, *(s.changed(t, memory) for s in schedules)] for t in times]
    return np.array(rows, dtype=bool)


def _look(
    config: FloorPlanConfig,
    poses: Array,
    segments: Array,
    discs: Array,
    owners: tuple[IntArray, IntArray],
    rng: np.random.Generator,
) -> tuple[Array, Array, IntArray]:
    """Measured ranges, exact ranges, and the object that each beam ends on; (n, b) each."""
    laser, owner_of = config.laser, np.concatenate(owners)
    exact = np.empty((len(poses), laser.beams))
    owner = np.empty(exact.shape, dtype=np.int64)
    for k, pose in enumerate(poses):
        hits = cast(pose[:2], so2.wrap(pose[2] + laser.angles), segments[k], discs[k])
        far = hits.range > laser.max_range
        exact[k] = np.where(far, np.inf, hits.range)
        owner[k] = np.where(far, -1, owner_of[hits.which])
    noisy = np.maximum(exact + laser.sigma * rng.standard_normal(exact.shape), 0.0)
    ranges = np.where(rng.uniform(size=exact.shape) < laser.dropout, np.nan, noisy)
    return ranges, exact, owner


CART = (0.8, 0.5)
"""Metres; its corners lie 0.47 m from its middle."""
CART_GAP = 0.1
"""Metres between the circle around a cart and walls, things, other carts, and the robot."""


def with_carts(
    plan: FloorPlan, carts: int, rng: np.random.Generator, robot_radius: float = 0.3, speed: float = 0.3
) -> FloorPlan:
    """Add boxes on wheels, each pushed to and fro on a free straight line.

    A cart stands for 12 to 25 s (the first time 4 to 15 s), then moves by 1 to 2.5 m, and so on.

    Raises
    ------
    ValueError
        If no free line is found for a cart in 5000 draws.
    """
    things = list(plan.things)
    swept = [
        box.segments(t) for box in plan.things for t in np.linspace(box.pose.times[0], box.pose.times[-1], 9)
    ]
    swept += [door.segment(t)[None] for door in plan.doors for t in np.linspace(0.0, 60.0, 61)]
    fixed = np.concatenate([plan.fixed, *swept])
    route = np.concatenate([plan.route[:-1], plan.route[1:]], axis=1)
    radius = float(np.hypot(*CART)) / 2 + CART_GAP
    lines = np.zeros((0, 4))
    for _ in range(carts):
        keep_off = ((fixed, radius), (lines, 2 * radius), (route, radius + robot_radius))
        line = _free_line(plan, keep_off, rng)
        lines = np.concatenate([lines, line.reshape(1, 4)])
        things.append(Box(CART, _to_and_fro(line, speed, rng)))
    return dataclasses.replace(plan, things=tuple(things))


def _to_and_fro(line: Array, speed: float, rng: np.random.Generator, until: float = 200.0) -> Schedule:
    """Poses of a cart on a line (2, 2)."""
    way = line[1] - line[0]
    heading, duration = float(np.arctan2(way[1], way[0])), float(np.hypot(*way)) / speed
    t, at = float(rng.uniform(4.0, 15.0)), 0
    times, values = [0.0], [[*line[0], heading]]
    while t < until:
        times += [t, t + duration]
        values += [[*line[at], heading], [*line[1 - at], heading]]
        at, t = 1 - at, times[-1] + float(rng.uniform(12.0, 25.0))
    return schedule(times, values)


def _free_line(plan: FloorPlan, keep_off: tuple[tuple[Array, float], ...], rng: np.random.Generator) -> Array:
    """Ends (2, 2) of a line in one zone that stays away from segments by the given distances."""
    for _ in range(5000):
        zone = plan.zones[rng.integers(len(plan.zones))]
        start = rng.uniform(zone[:2], zone[2:])
        angle = rng.uniform(-np.pi, np.pi)
        end = start + rng.uniform(1.0, 2.5) * np.array([np.cos(angle), np.sin(angle)])
        if not ((end > zone[:2]).all() and (end < zone[2:]).all()):
            continue
        points = start + np.linspace(0.0, 1.0, 26)[:, None] * (end - start)
        if all(nearest_on_segments(points, s)[1].min(initial=np.inf) > d for s, d in keep_off):
            return np.stack([start, end])
    raise ValueError(
        "carts: no free straight line was found for one more; ask for fewer, or give a larger plan"
    )


def turned(recording: Recording, angle: float) -> Recording:
    """Return the same run in a world turned about the origin by ``angle`` (rad): rasters lie askew in it."""
    pose = np.array([0.0, 0.0, angle])
    segments = recording.segments.reshape(*recording.segments.shape[:-1], 2, 2)
    discs = recording.discs.copy()
    discs[..., :2] = se2.act(pose, discs[..., :2])
    return dataclasses.replace(
        recording,
        poses=se2.compose(pose, recording.poses),
        segments=se2.act(pose, segments).reshape(recording.segments.shape),
        discs=discs,
        people=se2.act(pose, recording.people),
    )
