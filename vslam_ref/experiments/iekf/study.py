"""The Monte Carlo study behind figures 2, 3 and 4 of seed B: runs in, arrays per run out.

::

    StudyConfig --> points (filter, P0) x batches of runs --simulate--> nees, errors: (runs, T + 1)

All filters and both P0 see the same noises, run by run.  Run r draws from its own child of one
SeedSequence, and the size of a batch is part of the config, so the arrays are the same bytes for any
number of workers.

The *consistent control* is the EKF in the same world with every standard deviation, P0's included,
multiplied by ``control_scale``: so small that the problem is linear.  A Kalman filter with the right
noises is then exactly consistent, and its NEES has the correlation in time of the real one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Study, batches
from vslam_ref.experiments.framework.driver import Unit, carry_out, gather, plan
from vslam_ref.filters.carleman_ekf import carleman_ekf
from vslam_ref.filters.ekf_slam import AnchoredEkf, EkfSlam, IdealEkf, Truth
from vslam_ref.filters.estimates import SlamFilter
from vslam_ref.metrics.consistency import nees_pose, nis, pose_error
from vslam_ref.worlds.drive import field_drive, follow
from vslam_ref.worlds.vehicle_field import (
    Course,
    Noise,
    VehicleField,
    VehicleFieldConfig,
    draw_noise,
    make_field,
)

FILTERS = ("ekf", "iekf", "ekf-anchored", "ekf-ideal")


@dataclass(frozen=True)
class StudyConfig:
    """Assumptions of the study; those of the world are in ``field``."""

    field: VehicleFieldConfig = dataclasses.field(default_factory=VehicleFieldConfig)
    p0_low: tuple[float, float, float] = dataclasses.field(
        default=(1.0, 1.0, 0.001),
        metadata={"unit": "m2, m2, rad2", "reason": "B§4.1: low initial uncertainty"},
    )
    p0_high: tuple[float, float, float] = dataclasses.field(
        default=(1.0, 1.0, 0.03),
        metadata={"unit": "m2, m2, rad2", "reason": "B§4.1: high initial uncertainty"},
    )
    runs: int = dataclasses.field(default=50, metadata={"reason": "B§4.1: 50 Monte Carlo runs"})
    population: int = dataclasses.field(
        default=400, metadata={"reason": "eight times B's runs: how often a sentence of B would hold again"}
    )
    control_runs: int = dataclasses.field(
        default=1000, metadata={"reason": "a consistent population for thresholds and null rates"}
    )
    control_scale: float = dataclasses.field(
        default=1e-4, metadata={"reason": "shrinks all noises of the control until the problem is linear"}
    )
    filters: tuple[str, ...] = dataclasses.field(
        default=("ekf", "iekf", "ekf-anchored", "ekf-ideal"),
        metadata={"reason": "B's two; two controls that tell what the inconsistency comes from"},
    )
    iekf_form: str = dataclasses.field(
        default="reduced",
        metadata={"reason": "same pose estimates as the lifted form (iekf-reduced shows it)"},
    )
    iekf_start: str = dataclasses.field(
        default="first_order", metadata={"reason": "not given; Jacobian and exact moments differ little"}
    )
    iekf_control: str = dataclasses.field(
        default="first_order", metadata={"reason": "not given; keeps (u2, u3) on the unit circle"}
    )
    batch: int = dataclasses.field(
        default=50, metadata={"reason": "runs computed together; part of the numbers' bytes"}
    )
    seed: int = dataclasses.field(default=2016, metadata={"reason": "B's year; chosen before it was run"})
    layout: int | None = dataclasses.field(
        default=None, metadata={"reason": "landmarks from the study's seed; a number: from that seed instead"}
    )

    def __post_init__(self) -> None:
        """Refuse studies that mean nothing."""
        if not 2 <= self.runs <= self.population:
            raise ValueError(
                f"runs={self.runs}: must be at least 2 and at most the population {self.population}"
            )
        if self.batch < 1 or self.control_runs < 0:
            raise ValueError(f"batch={self.batch} must be >= 1, control_runs={self.control_runs} >= 0")
        if not 0 < self.control_scale <= 1:
            raise ValueError(f"control_scale={self.control_scale}: must be in (0, 1]")
        if min(*self.p0_low, *self.p0_high) < 0:
            raise ValueError(f"p0_low={self.p0_low}, p0_high={self.p0_high}: variances must be >= 0")
        for name in self.filters:
            if name not in FILTERS:
                raise ValueError(f"filters: unknown {name!r}; known: {', '.join(FILTERS)}")

    def p0(self, name: str) -> Array:
        """Variances (3,) of the start pose for ``low`` or ``high``."""
        return np.array(self.p0_low if name == "low" else self.p0_high)


class RunArrays(NamedTuple):
    """Per run: NEES, position error [m] and heading error [rad] (M, T + 1); NIS per number (M, K)."""

    nees: Array
    position_error: Array
    heading_error: Array
    nis: Array


class StudyResult(NamedTuple):
    """Arrays of a study by ``filter/p0``; the control's keys are ``control/low`` and ``control/high``."""

    config: StudyConfig
    time: Array
    nees: dict[str, Array]
    position_error: dict[str, Array]
    heading_error: dict[str, Array]
    nis: dict[str, Array]


@lru_cache(maxsize=4)
def study_field(config: StudyConfig) -> VehicleField:
    """The world of a study; its landmarks come from the first child of the seed, or of ``layout``."""
    root = np.random.SeedSequence(config.seed if config.layout is None else config.layout)
    return make_field(config.field, np.random.default_rng(root.spawn(3)[0]))


def run_seeds(config: StudyConfig, control: bool, count: int) -> list[np.random.SeedSequence]:
    """One seed per run; the control has runs of its own."""
    return np.random.SeedSequence(config.seed).spawn(3)[2 if control else 1].spawn(count)


def noises(world: Course, seeds: Sequence[np.random.SeedSequence]) -> Noise:
    """Noises of some runs, each from its own seed."""
    return draw_noise(world, [np.random.default_rng(seed) for seed in seeds])


def run_noise(config: StudyConfig, control: bool, first: int, count: int) -> Noise:
    """Noises of runs ``first`` to ``first + count``."""
    return noises(study_field(config), run_seeds(config, control, first + count)[first:])


def make_filter(name: str, mean: Array, cov: Array, config: StudyConfig, world: VehicleField) -> SlamFilter:
    """A filter of the study by name, started at N(mean (B, 3), cov (3, 3))."""
    n = len(world.landmarks)
    if name == "iekf":
        return carleman_ekf(mean, cov, config.iekf_form, n, config.iekf_start, config.iekf_control)
    if name == "ekf-anchored":
        return AnchoredEkf(mean, cov, n)
    if name == "ekf-ideal":
        return IdealEkf(mean, cov, Truth(world.T_world_vehicle, world.landmarks), n)
    return EkfSlam(mean, cov, n)


def points(config: StudyConfig) -> list[tuple[str, str]]:
    """Filters, and the control if it is asked for, each with both P0."""
    names = [*config.filters, *(["control"] if config.control_runs else [])]
    return [(name, p0) for name in names for p0 in ("low", "high")]


def seeds(config: StudyConfig, point: tuple[str, str]) -> list[Unit]:
    """Batches of a fixed size, the same runs for every filter."""
    control = point[0] == "control"
    return batches(
        run_seeds(config, control, config.control_runs if control else config.population), config.batch
    )


def simulate(
    config: StudyConfig, point: tuple[str, str], seeds: tuple[np.random.SeedSequence, ...]
) -> RunArrays:
    """Run one filter from one P0 over one batch of runs."""
    name, control = point[0], point[0] == "control"
    world = study_field(config)
    noise = noises(world, seeds)
    scale = config.control_scale if control else 1.0
    p0 = config.p0(point[1]) * scale**2
    start = world.T_world_vehicle[0] + noise.start * np.sqrt(p0)
    slam = make_filter("ekf" if control else name, start, np.diag(p0), config, world)
    return errors_of(slam, world, noise, scale)


def errors_of(slam: SlamFilter, world: VehicleField, noise: Noise, scale: float = 1.0) -> RunArrays:
    """Take a filter, started for B runs, through the whole course and keep its errors."""
    steps = list(follow(slam, field_drive(world, noise, scale)))
    mean, cov = np.array([s.mean for s in steps]), np.array([s.cov for s in steps])
    error = pose_error(world.T_world_vehicle[:, None], mean)
    square = nees_pose(np.broadcast_to(world.T_world_vehicle[:, None], mean.shape), mean, cov).value
    position = np.hypot(error[..., 0], error[..., 1])
    updates = [s.innovation for s in steps if s.innovation is not None]
    per_number = np.array([nis(*u).value / u.innovation.shape[1] for u in updates])
    return RunArrays(square.T.copy(), position.T.copy(), error[..., 2].T.copy(), per_number.T)


def columns(study: Study[dict[str, RunArrays]]) -> StudyResult:
    """Sort the arrays of a study by what they are."""
    by_name = {name: {k: getattr(r, name) for k, r in study.data.items()} for name in RunArrays._fields}
    return StudyResult(study.config, study_field(study.config).times, **by_name)


def run_study(config: StudyConfig) -> StudyResult:
    """Run the whole study in this process."""
    work = plan(simulate, config, points(config), seeds)
    done = [carry_out(task) for task in work.tasks]
    return columns(Study(config, gather(work, done, points(config), "/".join)))


QUICK = {"runs": 10, "population": 40, "control_runs": 80, "batch": 20}
"""A small study of the same kind: seconds, and too few runs for its verdicts to mean much."""
