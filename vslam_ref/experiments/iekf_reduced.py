"""The reduction of B's lifted filter: the same estimates from fewer states, and what they cost.

The lifted form (11 + 6 n states, B16-B28) and the reduced ones (4 + 2 n, and 4 + 4 n with the map) share
no code.  They run on the same noises; the largest difference of their poses, covariances, innovations and
maps is measured, and the time of a cycle of ten predictions and one update is set beside the EKF's.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext, verdict
from vslam_ref.experiments.iekf.study import StudyConfig, run_noise, study_field
from vslam_ref.filters import vehicle
from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf, ReducedCarlemanEkf, Variant
from vslam_ref.filters.estimates import SlamFilter
from vslam_ref.metrics.consistency import pose_error
from vslam_ref.worlds.mapped_vehicle import PAPER_POSE_RATIO, cycle_ratios

if TYPE_CHECKING:
    from matplotlib.figure import Figure


BOUND = 1e-10
"""Metres, radians and their squares: the goal of the reduction."""
BROKEN = 1e-4
"""A difference past this is no rounding."""
QUANTITIES = ("pose", "covariance", "innovation", "S")
CASES = ("reduced", "reduced-map", "condition broken")


@dataclass(frozen=True)
class ReducedConfig:
    """Which runs; the world is that of figures 2-4."""

    study: StudyConfig = dataclasses.field(default_factory=StudyConfig)
    runs: int = dataclasses.field(default=50, metadata={"reason": "B's number of runs"})
    gaussian_runs: int = dataclasses.field(
        default=5,
        metadata={"reason": "the lifted form is slow with exact moments: eight noise columns a step"},
    )
    batch: int = dataclasses.field(default=10, metadata={"reason": "runs computed together"})
    time_cycles: bool = dataclasses.field(
        default=True, metadata={"reason": "off where a loaded machine makes times meaningless"}
    )

    def __post_init__(self) -> None:
        """Refuse studies that mean nothing."""
        if min(self.runs, self.gaussian_runs, self.batch) < 1:
            raise ValueError(
                f"runs={self.runs}, gaussian_runs={self.gaussian_runs}, batch={self.batch}: must be >= 1"
            )


class Task(NamedTuple):
    """One batch at one P0, and how moments are lifted."""

    config: ReducedConfig
    p0: str
    moments: str
    first: int
    size: int


def make_forms(task: Task, mean: Array, cov: Array, n: int) -> dict[str, SlamFilter]:
    """The lifted filter first, then what is compared with it."""
    kind = task.moments
    forms: dict[str, SlamFilter] = {
        "lifted": LiftedCarlemanEkf(mean, cov, n, kind, kind),
        "reduced": ReducedCarlemanEkf(mean, cov, n, kind, kind),
        "reduced-map": ReducedCarlemanEkf(mean, cov, n, kind, kind, with_map=True),
    }
    if kind == "gaussian":
        wrong = Variant(product_of_means=True)
        forms["condition broken"] = LiftedCarlemanEkf(mean, cov, n, kind, kind, variant=wrong)
    return forms


def simulate(task: Task) -> dict[str, Array]:
    """Largest absolute difference over the batch at each time, by ``case/quantity``, shape (T + 1,)."""
    config = task.config
    world, c = study_field(config.study), config.study.field
    noise = run_noise(config.study, False, task.first, task.size)
    p0 = config.study.p0(task.p0)
    forms = make_forms(
        task, world.T_world_vehicle[0] + noise.start * np.sqrt(p0), np.diag(p0), len(world.landmarks)
    )
    controls = world.controls + noise.controls * np.array([c.sigma_v, c.sigma_phi])
    seen = {s.step: (s, c.sigma_z * e) for s, e in zip(world.sightings, noise.sightings, strict=True)}
    T = controls.shape[1]
    gap = {f"{case}/{q}": np.zeros(T + 1) for case in forms if case != "lifted" for q in QUANTITIES}
    for k in range(T + 1):
        outputs: dict[str, tuple[Array, ...]] = {}
        for case, slam in forms.items():
            if k:
                slam.predict(vehicle.ackermann_increment(controls[:, k - 1], c.cov_u, c.wheelbase, c.dt))
            innovation = None
            if k in seen:
                sighting, error = seen[k]
                innovation = slam.update(sighting.ids, sighting.z + error, c.cov_z)
            outputs[case] = (*slam.pose(), *(innovation or ()))
        exact = outputs.pop("lifted")
        for case, output in outputs.items():
            for q, a, b in zip(QUANTITIES, output, exact, strict=False):
                gap[f"{case}/{q}"][k] = np.abs(pose_error(a, b) if q == "pose" else a - b).max()
    mine, theirs = forms["reduced-map"].landmarks(), forms["lifted"].landmarks()
    gap["map/mean"] = np.array([np.abs(mine.mean - theirs.mean).max()])
    gap["map/covariance"] = np.array([np.abs(mine.cov - theirs.cov).max()])
    return gap


def run(config: ReducedConfig, context: RunContext) -> Result:
    """Measure differences in all runs, and times in this process."""
    tasks = [
        Task(config, p0, moments, first, min(config.batch, runs - first))
        for moments, runs in (("first_order", config.runs), ("gaussian", config.gaussian_runs))
        for p0 in ("low", "high")
        for first in range(0, runs, config.batch)
    ]
    done = context.map(simulate, tasks, "reduction")
    gap: dict[str, Array] = {}
    for task, part in zip(tasks, done, strict=True):
        for key, values in part.items():
            name = f"{key}/{task.moments}/{task.p0}"
            gap[name] = np.maximum(gap.get(name, 0.0), values)
    ratios = cycle_ratios(batch=1, landmarks=config.study.field.landmarks) if config.time_cycles else {}
    return Result(
        series={"time": study_field(config.study).times, "difference": gap},
        seed=config.study.seed,
        runs=config.runs,
        arrays={key.replace("/", "."): values for key, values in gap.items()},
        payload=(config, gap, ratios),
    )


def claims(result: Result) -> list[Claim]:
    """Judge the reduction."""
    _, gap, ratios = result.payload

    def largest(*prefixes: str) -> float:
        return float(max(v.max() for key, v in gap.items() if key.startswith(prefixes)))

    def equal(id: str, text: str, *prefixes: str) -> Claim:
        worst = largest(*prefixes)
        rule = f"largest absolute difference over all runs and times <= {BOUND:g}"
        return Claim(
            id, "chapter 16", text, rule, {"largest": worst}, None, None, None, verdict(worst <= BOUND)
        )

    broken = largest("condition broken/pose")
    judged = [
        equal(
            "reduced-pose",
            "4 + 2 n states give the lifted filter's poses, covariances, innovations and S",
            "reduced/",
        ),
        equal("reduced-map-pose", "4 + 4 n states give them too", "reduced-map/"),
        equal("reduced-map-map", "4 + 4 n states give the lifted filter's map and its covariances", "map/"),
        Claim(
            "condition-matters",
            "chapter 16",
            "With products of means in the quadratic rows (|u| < 1) the lifted filter is another one",
            f"largest difference of the poses > {BROKEN:g}",
            {"largest": broken},
            None,
            None,
            None,
            verdict(broken > BROKEN),
        ),
    ]
    measured = {f"cycle_{form}": ratio for form, ratio in ratios.items()} | {"paper": PAPER_POSE_RATIO}
    cheap = ratios["reduced"] <= 1.1 if ratios else None
    judged.append(
        Claim(
            "cost",
            "B, table 1 and conclusion",
            "Consistency need not cost time: a cycle of the 4 + 2 n form takes at most 1.1 EKF cycles",
            "median of 9 paired ratios, ten predictions and one update of five landmarks, <= 1.1",
            measured,
            None,
            None,
            None,
            verdict(cheap),
        )
    )
    return judged


def figure(result: Result) -> Figure:
    """Differences over time, first-order and Gaussian moments."""
    from vslam_ref.plot.reduction import reduction_figure

    _, gap, _ = result.payload
    return reduction_figure(np.asarray(result.series["time"]), gap, bound=BOUND)


def quick(config: ReducedConfig) -> ReducedConfig:
    """Two runs, half the landmarks, one lap, and no clock."""
    field = dataclasses.replace(config.study.field, laps=1, landmarks=15)
    study = dataclasses.replace(config.study, field=field)
    return dataclasses.replace(config, study=study, runs=2, gaussian_runs=1, batch=2, time_cycles=False)


EXPERIMENT = Experiment(
    id="iekf-reduced",
    title="The lifted filter and its exact reduction: differences and cost",
    source="B 2.2-2.3 and table 1; chapter 16",
    config_type=ReducedConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
)
