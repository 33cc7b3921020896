"""The setup of Bailey's simulator: a car with a front-wheel speed, range and bearing, the start known.

Range and bearing are converted to relative Cartesian measurements without bias (``filters.range_bearing``);
the covariance of each depends on the measurement alone.  It differs from run to run, so runs are not
computed together.  The pose is that of the rear axle, which a front wheel at speed V moves at V cos G.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext
from vslam_ref.experiments.iekf import neighbours
from vslam_ref.experiments.iekf.neighbours import FILTERS, STARTS, Drive, Errors
from vslam_ref.filters import vehicle
from vslam_ref.filters.range_bearing import cartesian_from_polar
from vslam_ref.worlds.vehicle_field import draw_noise
from vslam_ref.worlds.waypoint_course import (
    WaypointConfig,
    WaypointCourse,
    make_waypoint_course,
    rear_axle_control,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE = "setup of Bailey's EKF-SLAM simulator; course and landmarks ours"


@dataclass(frozen=True)
class BaileyConfig:
    """Which runs, on which course."""

    world: WaypointConfig = dataclasses.field(default_factory=WaypointConfig)
    p0_high: tuple[float, float, float] = dataclasses.field(
        default=(1.0, 1.0, 0.03),
        metadata={
            "unit": "m2, m2, rad2",
            "reason": "B's high initial uncertainty, beside the published zero",
        },
    )
    runs: int = dataclasses.field(default=50, metadata={"reason": "B's number of runs"})
    batch: int = dataclasses.field(default=5, metadata={"reason": "runs of one task, one after the other"})
    seed: int = dataclasses.field(
        default=2004, metadata={"reason": "the simulator's year; chosen before it was run"}
    )

    def __post_init__(self) -> None:
        """Refuse studies that mean nothing."""
        if self.runs < 2 or self.batch < 1:
            raise ValueError(f"runs={self.runs} must be >= 2, batch={self.batch} >= 1")


class Task(NamedTuple):
    """Some runs of one filter."""

    config: BaileyConfig
    filter: str
    start: str
    first: int
    size: int


@lru_cache(maxsize=2)
def course_of(config: BaileyConfig) -> WaypointCourse:
    """The course; its landmarks come from the first child of the seed."""
    child = np.random.SeedSequence(config.seed).spawn(2)[0]
    return make_waypoint_course(config.world, np.random.default_rng(child))


def simulate(task: Task) -> Errors:
    """Run one filter over some runs."""
    children = np.random.SeedSequence(task.config.seed).spawn(2)[1].spawn(task.first + task.size)
    return neighbours.join([_one(task, child) for child in children[task.first :]])


def _one(task: Task, child: np.random.SeedSequence) -> Errors:
    """One run, as a batch of one."""
    c, world = task.config.world, course_of(task.config)
    noise = draw_noise(world, [np.random.default_rng(child)])
    controls = world.controls + noise.controls[0] * [c.sigma_v, c.sigma_g]
    rear = rear_axle_control(controls, c.cov_u)
    steps = vehicle.ackermann_increment(rear.control, rear.cov, c.wheelbase, c.dt)
    increments = vehicle.Increment(steps.ds[None], steps.dalpha[None], steps.cov[None])
    seen = {}
    for s, e in zip(world.sightings, noise.sightings, strict=True):
        polar = s.z + e[0] * [c.sigma_range, c.sigma_bearing]
        z, cov_z = cartesian_from_polar(polar, c.sigma_range, c.sigma_bearing)
        seen[s.step] = (s.ids, z[None], cov_z)
    p0 = np.array(task.config.p0_high if task.start == "high" else (0.0, 0.0, 0.0))
    mean = world.T_world_vehicle[0] + noise.start * np.sqrt(p0)
    slam = neighbours.make_filter(task.filter, mean, np.diag(p0), c.landmarks)
    return neighbours.follow(slam, Drive(increments, seen, world.T_world_vehicle, c.sighting_steps))


def run(config: BaileyConfig, context: RunContext) -> Result:
    """Run all filters from both starts."""
    tasks = [
        Task(config, name, start, first, min(config.batch, config.runs - first))
        for start in STARTS
        for name in FILTERS
        for first in range(0, config.runs, config.batch)
    ]
    names = [f"{task.filter}/{task.start}" for task in tasks]
    errors = neighbours.collect(names, context.map(simulate, tasks, "Bailey's setup"))
    arrays = neighbours.per_run_arrays(errors)
    time = course_of(config).times[:: config.world.sighting_steps]
    return Result(
        neighbours.series_of(time, errors),
        config.seed,
        config.runs,
        arrays | {"time": time},
        (config, errors),
    )


def claims(result: Result) -> list[Claim]:
    """Judge the questions both setups are asked; nothing published can be compared."""
    config, errors = result.payload
    enough = config.runs >= 50 and config.world.loops >= 2
    return neighbours.common_claims(SOURCE, errors, enough, np.random.default_rng([config.seed, 1]))


def figure(result: Result) -> Figure:
    """Errors and NEES over time."""
    from vslam_ref.plot.neighbours import neighbours_figure

    config, _ = result.payload
    return neighbours_figure(result.series, runs=config.runs, published={})


def quick(config: BaileyConfig) -> BaileyConfig:
    """Two runs of one round with a fifth of the controls."""
    world = dataclasses.replace(config.world, loops=1, dt=0.1, sighting_steps=5)
    return dataclasses.replace(config, world=world, runs=3, batch=3)


EXPERIMENT = Experiment(
    id="iekf-bailey",
    title="The setup of Bailey's simulator: front-wheel speed, range and bearing",
    source="Bailey's EKF-SLAM simulator, configuration file; course and landmarks declared",
    config_type=BaileyConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
)
