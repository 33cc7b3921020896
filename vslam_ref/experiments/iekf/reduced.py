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
from vslam_ref.experiments.framework import Claim, Experiment, Study, batches, judged
from vslam_ref.experiments.framework.driver import Unit
from vslam_ref.experiments.iekf.study import StudyConfig, noises, run_seeds, study_field
from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf, ReducedCarlemanEkf, Variant
from vslam_ref.filters.estimates import SlamFilter
from vslam_ref.metrics.consistency import pose_error
from vslam_ref.worlds.drive import field_drive, follow
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


class Gap(NamedTuple):
    """Largest absolute differences from the lifted form over a batch.

    Attributes
    ----------
    over_time : ndarray, shape (1, cases, 4, T + 1)
        By case and ``QUANTITIES``, at each time.
    of_map : ndarray, shape (1, 2)
        Of the map's means and covariances at the end, with the map.
    """

    over_time: Array
    of_map: Array


def points(config: ReducedConfig) -> list[tuple[str, str]]:
    """How moments are lifted, and P0."""
    return [(moments, p0) for moments in ("first_order", "gaussian") for p0 in ("low", "high")]


def seeds(config: ReducedConfig, point: tuple[str, str]) -> list[Unit]:
    """Batches; exact moments have fewer runs."""
    runs = config.gaussian_runs if point[0] == "gaussian" else config.runs
    return batches(run_seeds(config.study, False, runs), config.batch)


def make_forms(kind: str, mean: Array, cov: Array, n: int) -> dict[str, SlamFilter]:
    """The lifted filter first, then what is compared with it."""
    forms: dict[str, SlamFilter] = {
        "lifted": LiftedCarlemanEkf(mean, cov, n, kind, kind),
        "reduced": ReducedCarlemanEkf(mean, cov, n, kind, kind),
        "reduced-map": ReducedCarlemanEkf(mean, cov, n, kind, kind, with_map=True),
    }
    if kind == "gaussian":
        wrong = Variant(product_of_means=True)
        forms["condition broken"] = LiftedCarlemanEkf(mean, cov, n, kind, kind, variant=wrong)
    return forms


def simulate(config: ReducedConfig, point: tuple[str, str], seeds: tuple[np.random.SeedSequence, ...]) -> Gap:
    """Take all forms along the same runs, side by side."""
    moments, start = point
    world = study_field(config.study)
    noise = noises(world, seeds)
    p0 = config.study.p0(start)
    mean = world.T_world_vehicle[0] + noise.start * np.sqrt(p0)
    forms = make_forms(moments, mean, np.diag(p0), len(world.landmarks))
    drive = field_drive(world, noise)
    gap = np.zeros((len(forms) - 1, len(QUANTITIES), len(world.T_world_vehicle)))
    for k, steps in enumerate(zip(*(follow(slam, drive) for slam in forms.values()), strict=True)):
        exact, *others = ((step.mean, step.cov, *(step.innovation or ())) for step in steps)
        for case, output in enumerate(others):
            for q, (a, b) in enumerate(zip(output, exact, strict=True)):
                gap[case, q, k] = np.abs(a - b if q else pose_error(a, b)).max()
    mine, theirs = forms["reduced-map"].landmarks(), forms["lifted"].landmarks()
    of_map = [np.abs(mine.mean - theirs.mean).max(), np.abs(mine.cov - theirs.cov).max()]
    return Gap(gap[None], np.array([of_map]))


def cycle_times(config: ReducedConfig) -> dict[str, float]:
    """Time of a cycle of each form over the EKF's, in this process; nothing if no clock is wanted."""
    return cycle_ratios(1, config.study.field.landmarks) if config.time_cycles else {}


Gaps = Study[dict[str, Gap]]


def gaps(study: Gaps) -> dict[str, Array]:
    """Largest differences over all runs, by ``case/quantity/moments/p0``, (T + 1,); of the map (1,)."""
    found: dict[str, Array] = {}
    for key, part in study.data.items():
        over_time, of_map = part.over_time.max(axis=0), part.of_map.max(axis=0)
        for case, rows in zip(CASES, over_time, strict=False):
            found |= {f"{case}/{q}/{key}": row for q, row in zip(QUANTITIES, rows, strict=True)}
        found |= {f"map/mean/{key}": of_map[:1], f"map/covariance/{key}": of_map[1:]}
    return found


def series(study: Gaps) -> dict[str, object]:
    """Differences over time."""
    return {"time": study_field(study.config.study).times, "difference": gaps(study)}


def claims(study: Gaps) -> list[Claim]:
    """Judge the reduction."""
    gap = gaps(study)

    def largest(*prefixes: str) -> float:
        return float(max(v.max() for key, v in gap.items() if key.startswith(prefixes)))

    def equal(id: str, text: str, prefix: str) -> Claim:
        worst = largest(prefix)
        return judged(
            id, "chapter 16", text, f"largest absolute difference over all runs and times <= {BOUND:g}",
            worst <= BOUND,
            f"The two forms differ by at most {worst:.1e} over all runs and times; {BOUND:g} is allowed "
            "for rounding",
            {"largest": worst},
        )  # fmt: skip

    text = "4 + 2 n states give the lifted filter's poses, covariances, innovations and S"
    return [
        equal("reduced-pose", text, "reduced/"),
        equal("reduced-map-pose", "4 + 4 n states give them too", "reduced-map/"),
        equal("reduced-map-map", "4 + 4 n states give the lifted filter's map and its covariances", "map/"),
        _matters(largest("condition broken/pose")),
        _cost(study.once),
    ]


def _matters(broken: float) -> Claim:
    return judged(
        "condition-matters",
        "chapter 16",
        "With products of means in the quadratic rows (|u| < 1) the lifted filter is another one",
        f"largest difference of the poses > {BROKEN:g}",
        broken > BROKEN,
        f"With the condition broken the poses differ by up to {broken:.2g} m or rad; rounding would stay "
        "under "
        f"{BROKEN:g}",
        {"largest": broken},
    )


def _cost(ratios: dict[str, float]) -> Claim:
    found = "No time was measured"
    if ratios:
        found = f"A cycle of the 4 + 2 n form takes {ratios['reduced']:.2f} EKF cycles, and 1.1 are allowed"
    return judged(
        "cost",
        "B, table 1 and conclusion",
        "Consistency need not cost time: a cycle of the 4 + 2 n form takes at most 1.1 EKF cycles",
        "median of 9 paired ratios, ten predictions and one update of five landmarks, <= 1.1",
        ratios["reduced"] <= 1.1 if ratios else None,
        f"{found}; the paper reports {PAPER_POSE_RATIO:.2f} for its own form",
        {f"cycle_{form}": ratio for form, ratio in ratios.items()} | {"paper": PAPER_POSE_RATIO},
    )


def figure(study: Gaps) -> Figure:
    """Differences over time, first-order and Gaussian moments."""
    from vslam_ref.plot.reduction import reduction_figure

    return reduction_figure(study_field(study.config.study).times, gaps(study), bound=BOUND)


WHAT = "largest absolute difference from the lifted form over all runs, by quantity, moments and P0; "

EXPERIMENT = Experiment(
    id="iekf-reduced",
    title="The lifted filter and its exact reduction: differences and cost",
    source="B 2.2-2.3 and table 1; chapter 16",
    config_type=ReducedConfig,
    simulate=simulate,
    points=points,
    name="/".join,
    seeds=seeds,
    once=cycle_times,
    series=series,
    arrays=lambda study: {key.replace("/", "."): values for key, values in gaps(study).items()},
    claims=claims,
    figure=figure,
    about=dict.fromkeys(CASES, WHAT + "(times,)") | {"map": WHAT + "at the end, (1,)"},
    # no clock on a machine that does other things
    quick={
        "study.field.laps": 1, "study.field.landmarks": 15, "runs": 2, "gaussian_runs": 1, "batch": 2,
        "time_cycles": False,
    },
)  # fmt: skip
