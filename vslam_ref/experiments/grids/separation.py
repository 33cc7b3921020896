"""S and D against the truth as the crowd grows, beside a plain grid."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.experiments.framework.statistics import interval_of_means, null_rate
from vslam_ref.experiments.grids.counting import (
    JUDGED,
    CellCounts,
    SeparationConfig,
    measure,
    precision_recall,
)
from vslam_ref.worlds import floor_plan

if TYPE_CHECKING:
    from matplotlib.figure import Figure


STATIC_AIM, MOVING_AIM = 0.97, 0.85
"""Aims for precision and recall of static cells, and of cells that move now, at 20 % crowd."""
CROWD = f"in a crowd of {JUDGED:.0%}"


def simulate(config: SeparationConfig, density: float, seed: np.random.SeedSequence) -> CellCounts:
    """One run at one density; run r has the same seed, and so the same wishes of people, at each of them."""
    crowd = dataclasses.replace(config.world.crowd, density=density)
    world = dataclasses.replace(config.world, crowd=crowd)
    recording = floor_plan.simulate(world, np.random.default_rng(seed))
    return measure(floor_plan.turned(recording, config.turn) if config.turn else recording, config)


def series(study: Study[CellCounts]) -> dict[str, object]:
    """Means over the runs, by density."""
    return {
        "density": study.config.densities,
        "static": precision_recall(study.data.static).mean(axis=1),
        "moving": precision_recall(study.data.moving).mean(axis=1),
        "on_people": study.data.on_people.mean(axis=1),
    }


def claims(study: Study[CellCounts]) -> list[Claim]:
    """Judge the aims at 20 % crowd, and the separation against the plain grid."""
    j = study.config.densities.index(JUDGED)
    S, plain = np.swapaxes(precision_recall(study.data.static[j]), 0, 1)
    D = precision_recall(study.data.moving[j])
    return [
        _aim(study, "static-precision", "Cells that S calls static are static", S[:, 0], STATIC_AIM, 1),
        _aim(study, "static-recall", "S holds the static cells that could be seen", S[:, 1], STATIC_AIM, 2),
        _aim(study, "moving-precision", "Cells that D calls moving are moving", D[:, 0], MOVING_AIM, 3),
        _aim(study, "moving-recall", "D holds the moving cells that can be seen", D[:, 1], MOVING_AIM, 4),
        _cleaner(study, S, plain),
        _no_loss(study, S, plain),
    ]


def _aim(study: Study[CellCounts], id: str, text: str, values: Array, aim: float, draw: int) -> Claim:
    mean = float(values.mean())
    which, what = id.split("-")
    return judged(
        id,
        "A§4.1-4.3",
        f"{text}, {CROWD}",
        f"mean over runs >= {aim:g} (ci: of this mean, over whole runs)",
        mean >= aim,
        f"{CROWD.capitalize()} the {what} of {which} cells is {mean:.1%} over {len(values)} runs; "
        f"the aim is {aim:.0%}",
        {"mean": mean, "least": float(values.min()), "most": float(values.max())},
        ci=interval_of_means(values, study.rng(draw)),
        share=float(np.mean(values >= aim)),
    )


def _cleaner(study: Study[CellCounts], S: Array, plain: Array) -> Claim:
    """S keeps fewer smears of people than a plain grid."""
    gain = S[:, 0] - plain[:, 0]
    interval = interval_of_means(gain, study.rng(5))
    means = {"separated": float(S[:, 0].mean()), "plain": float(plain[:, 0].mean())}
    return judged(
        "cleaner-than-a-plain-grid",
        "A§4.2",
        f"In a crowd of {JUDGED:.0%} the separated static map holds fewer cells that are not static",
        "precision of S minus that of the plain grid, same runs: 95 % whole-run interval > 0",
        interval[0] > 0,
        f"Of the cells that S calls static {means['separated']:.1%} are static, of a plain grid's "
        f"{means['plain']:.1%}; the gain lies between {interval[0]:.1%} and {interval[1]:.1%} (95 %)",
        means,
        ci=interval,
        null_rate=null_rate(len(gain)),
        share=float(np.mean(gain > 0)),
    )


def _no_loss(study: Study[CellCounts], S: Array, plain: Array) -> Claim:
    """The price: S must find as many walls as the plain grid does."""
    loss = plain[:, 1] - S[:, 1]
    interval = interval_of_means(loss, study.rng(6))
    means = {"separated": float(S[:, 1].mean()), "plain": float(plain[:, 1].mean())}
    return judged(
        "costs-no-walls",
        "A§4.2",
        f"In a crowd of {JUDGED:.0%} the separated map finds as many static cells as the plain grid does",
        "recall of the plain grid minus that of S, same runs: 95 % whole-run interval < 0.01",
        interval[1] < 0.01,
        f"S finds {means['separated']:.1%} of the static cells, a plain grid {means['plain']:.1%}; the "
        "loss is "
        f"at most {interval[1]:.2%} (95 %), and 1 % is allowed",
        means,
        ci=interval,
        null_rate=null_rate(len(loss)),
        share=float(np.mean(loss < 0.01)),
    )


def figure(study: Study[CellCounts]) -> Figure:
    """Precision and recall over the crowd's density."""
    from vslam_ref.plot.floor_plan import separation_figure

    return separation_figure(
        np.asarray(study.config.densities),
        precision_recall(study.data.static),
        precision_recall(study.data.moving),
        aims=(STATIC_AIM, MOVING_AIM),
        judged=JUDGED,
    )


EXPERIMENT = Experiment(
    id="grids-separation",
    title="Static and dynamic grids against the truth, as the crowd grows",
    source="A, sections 4.1 to 4.3",
    config_type=SeparationConfig,
    simulate=simulate,
    points=lambda config: config.densities,
    series=series,
    claims=claims,
    figure=figure,
    about={
        "static": "cells of S and of the plain grid: decided and right, decided, asked for, asked for and "
        "decided; (densities, runs, map, count)",
        "moving": "the same counts for D; (densities, runs, count)",
        "on_people": "share of the beams that end on a person; (densities, runs)",
    },
    quick={"runs": 2, "densities": (0.0, JUDGED), "world.duration": 12.0},
)
