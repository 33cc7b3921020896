"""S and D against the truth as the crowd grows, beside a plain grid."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext, verdict
from vslam_ref.experiments.moving.readings import interval_of_means, null_rate
from vslam_ref.experiments.moving.separation import (
    JUDGED,
    Run,
    SeparationConfig,
    Task,
    precision_recall,
    simulate_run,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


STATIC_AIM, MOVING_AIM = 0.97, 0.85
"""Aims for precision and recall of static cells, and of cells that move now, at 20 % crowd."""


class Study(NamedTuple):
    """All runs: counts (densities, runs, ...), as in :class:`Run`."""

    config: SeparationConfig
    static: Array
    moving: Array
    on_people: Array


def run(config: SeparationConfig, context: RunContext) -> Result:
    """Run all densities; run r has the same seed, and so the same wishes of people, at each of them."""
    seeds = np.random.SeedSequence(config.seed).spawn(config.runs)
    tasks = [Task(config, density, seed) for density in config.densities for seed in seeds]
    done = context.map(simulate_run, tasks, "crowds")
    shape = (len(config.densities), config.runs)
    stacked = {n: np.array([getattr(r, n) for r in done]) for n in Run._fields}
    stacked = {n: a.reshape(*shape, *a.shape[1:]) for n, a in stacked.items()}
    study = Study(config, **stacked)
    return Result(
        series={
            "density": config.densities,
            "static": precision_recall(study.static).mean(axis=1),
            "moving": precision_recall(study.moving).mean(axis=1),
            "on_people": study.on_people.mean(axis=1),
        },
        seed=config.seed,
        runs=config.runs,
        arrays=stacked,
        payload=study,
    )


def claims(result: Result) -> list[Claim]:
    """Judge the aims at 20 % crowd, and the separation against the plain grid."""
    study: Study = result.payload
    j = study.config.densities.index(JUDGED)
    S, plain = precision_recall(study.static[j])[:, 0], precision_recall(study.static[j])[:, 1]
    D = precision_recall(study.moving[j])
    return [
        _aim(study, "static-precision", "Cells that S calls static are static", S[:, 0], STATIC_AIM, 1),
        _aim(study, "static-recall", "S holds the static cells that could be seen", S[:, 1], STATIC_AIM, 2),
        _aim(study, "moving-precision", "Cells that D calls moving are moving", D[:, 0], MOVING_AIM, 3),
        _aim(study, "moving-recall", "D holds the moving cells that can be seen", D[:, 1], MOVING_AIM, 4),
        _cleaner(study, S, plain),
        _no_loss(study, S, plain),
    ]


def _aim(study: Study, id: str, text: str, values: Array, aim: float, draw: int) -> Claim:
    rng = np.random.default_rng([study.config.seed, draw])
    return Claim(
        id,
        "A§4.1-4.3",
        f"{text}, in a crowd of {JUDGED:.0%}",
        f"mean over runs >= {aim:g} (ci: of this mean, over whole runs)",
        {"mean": float(values.mean()), "least": float(values.min()), "most": float(values.max())},
        interval_of_means(values, rng),
        None,
        float(np.mean(values >= aim)),
        verdict(bool(values.mean() >= aim)),
    )


def _cleaner(study: Study, S: Array, plain: Array) -> Claim:
    """S keeps fewer smears of people than a plain grid."""
    gain = S[:, 0] - plain[:, 0]
    rng = np.random.default_rng([study.config.seed, 5])
    interval = interval_of_means(gain, rng)
    return Claim(
        "cleaner-than-a-plain-grid",
        "A§4.2",
        f"In a crowd of {JUDGED:.0%} the separated static map holds fewer cells that are not static",
        "precision of S minus that of the plain grid, same runs: 95 % whole-run interval > 0",
        {"separated": float(S[:, 0].mean()), "plain": float(plain[:, 0].mean())},
        interval,
        null_rate(study.config.runs),
        float(np.mean(gain > 0)),
        verdict(interval[0] > 0),
    )


def _no_loss(study: Study, S: Array, plain: Array) -> Claim:
    """The price: S must find as many walls as the plain grid does."""
    loss = plain[:, 1] - S[:, 1]
    rng = np.random.default_rng([study.config.seed, 6])
    interval = interval_of_means(loss, rng)
    return Claim(
        "costs-no-walls",
        "A§4.2",
        f"In a crowd of {JUDGED:.0%} the separated map finds as many static cells as the plain grid does",
        "recall of the plain grid minus that of S, same runs: 95 % whole-run interval < 0.01",
        {"separated": float(S[:, 1].mean()), "plain": float(plain[:, 1].mean())},
        interval,
        null_rate(study.config.runs),
        float(np.mean(loss < 0.01)),
        verdict(interval[1] < 0.01),
    )


def figure(result: Result) -> Figure:
    """Precision and recall over the crowd's density."""
    from vslam_ref.plot.floor_plan import separation_figure

    study: Study = result.payload
    return separation_figure(
        np.asarray(study.config.densities),
        precision_recall(study.static),
        precision_recall(study.moving),
        aims=(STATIC_AIM, MOVING_AIM),
        judged=JUDGED,
    )


def quick(config: SeparationConfig) -> SeparationConfig:
    """Two runs of 12 s at two densities."""
    world = dataclasses.replace(config.world, duration=12.0)
    return dataclasses.replace(config, runs=2, densities=(0.0, JUDGED), world=world)


EXPERIMENT = Experiment(
    id="grids-separation",
    title="Static and dynamic grids against the truth, as the crowd grows",
    source="A, sections 4.1 to 4.3",
    config_type=SeparationConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
)
