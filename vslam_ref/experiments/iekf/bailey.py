"""The setup of Bailey's simulator: a car with a front-wheel speed, range and bearing, the start known.

Range and bearing are converted to relative Cartesian measurements without bias (``filters.range_bearing``);
the covariance of each depends on the measurement alone.  It differs from run to run, so runs are not
computed together.  The pose is that of the rear axle, which a front wheel at speed V moves at V cos G.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Study, batches
from vslam_ref.experiments.framework.driver import Unit, stack
from vslam_ref.experiments.iekf import neighbours
from vslam_ref.experiments.iekf.neighbours import Errors
from vslam_ref.experiments.iekf.study import noises
from vslam_ref.filters import vehicle
from vslam_ref.filters.range_bearing import cartesian_from_polar
from vslam_ref.worlds.drive import Drive
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


@lru_cache(maxsize=2)
def course_of(config: BaileyConfig) -> WaypointCourse:
    """The course; its landmarks come from the first child of the seed."""
    child = np.random.SeedSequence(config.seed).spawn(2)[0]
    return make_waypoint_course(config.world, np.random.default_rng(child))


def seeds(config: BaileyConfig, point: tuple[str, str]) -> list[Unit]:
    """Some runs for each task."""
    return batches(np.random.SeedSequence(config.seed).spawn(2)[1].spawn(config.runs), config.batch)


def simulate(
    config: BaileyConfig, point: tuple[str, str], seeds: tuple[np.random.SeedSequence, ...]
) -> Errors:
    """Run one filter from one start over some runs, one after the other."""
    return stack([_one(config, *point, seed) for seed in seeds], [seeds])  # type: ignore[no-any-return]


def _one(config: BaileyConfig, name: str, start: str, seed: np.random.SeedSequence) -> Errors:
    """One run, as a batch of one."""
    c, world = config.world, course_of(config)
    noise = noises(world, [seed])
    controls = world.controls + noise.controls[0] * [c.sigma_v, c.sigma_g]
    rear = rear_axle_control(controls, c.cov_u)
    steps = vehicle.ackermann_increment(rear.control, rear.cov, c.wheelbase, c.dt)
    seen = {}
    for s, e in zip(world.sightings, noise.sightings, strict=True):
        polar = s.z + e[0] * [c.sigma_range, c.sigma_bearing]
        z, cov_z = cartesian_from_polar(polar, c.sigma_range, c.sigma_bearing)
        seen[s.step] = (s.ids, z[None], cov_z)
    p0 = neighbours.initial(config, start)
    mean = world.T_world_vehicle[0] + noise.start * np.sqrt(p0)
    slam = neighbours.make_filter(name, mean, np.diag(p0), c.landmarks)
    drive = Drive(vehicle.Increment(steps.ds[None], steps.dalpha[None], steps.cov[None]), seen)
    return neighbours.errors_of(slam, drive, world.T_world_vehicle, c.sighting_steps)


def times(config: BaileyConfig) -> Array:
    """When poses are recorded."""
    return course_of(config).times[:: config.world.sighting_steps]


def series(study: Study[dict[str, Errors]]) -> dict[str, object]:
    """Curves over time."""
    return neighbours.series_of(times(study.config), study.data)


def claims(study: Study[dict[str, Errors]]) -> list[Claim]:
    """Judge the questions both setups are asked; nothing published can be compared."""
    config = study.config
    enough = config.runs >= neighbours.LEAST_RUNS and config.world.loops >= 2
    return neighbours.common_claims(SOURCE, study.data, enough, study.rng(1))


def figure(study: Study[dict[str, Errors]]) -> Figure:
    """Errors and NEES over time."""
    from vslam_ref.plot.neighbours import neighbours_figure

    return neighbours_figure(series(study), runs=study.config.runs, published={})


EXPERIMENT = Experiment(
    id="iekf-bailey",
    title="The setup of Bailey's simulator: front-wheel speed, range and bearing",
    source="Bailey's EKF-SLAM simulator, configuration file; course and landmarks declared",
    config_type=BaileyConfig,
    simulate=simulate,
    points=neighbours.points,
    name="/".join,
    seeds=seeds,
    series=series,
    arrays=lambda study: neighbours.arrays(times(study.config), study.data),
    claims=claims,
    figure=figure,
    about=neighbours.ABOUT,
    # one round with a fifth of the controls
    quick={"world.loops": 1, "world.dt": 0.1, "world.sighting_steps": 5, "runs": 3, "batch": 3},
)
