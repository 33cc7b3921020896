"""Landmarks on moving things: forbidden, as A wants it, against allowed."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext, verdict
from vslam_ref.experiments.moving.choice import MODES, ChoiceConfig, Run, Task, simulate_run
from vslam_ref.experiments.moving.readings import interval_of_means, null_rate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FOUND_OUT = 0.9
"""Share of landmarks, whose corner moved away before the robot's eyes, that must be withdrawn."""
GOOD_LOST = 0.1
"""Share of landmarks on what never moves that may be withdrawn."""


class Study(NamedTuple):
    """All runs: arrays (runs, modes), as in :class:`Run`."""

    config: ChoiceConfig
    rmse: Array
    chosen: Array
    on_things: Array
    wrong: Array
    found_out: Array
    good_lost: Array


def run(config: ChoiceConfig, context: RunContext) -> Result:
    """Run all worlds."""
    seeds = np.random.SeedSequence(config.seed).spawn(config.runs)
    done = context.map(simulate_run, [Task(config, seed) for seed in seeds], "carts")
    stacked = {n: np.array([getattr(r, n) for r in done]) for n in Run._fields}
    return Result(
        series={"modes": MODES, **{n: a.mean(axis=0) for n, a in stacked.items()}},
        seed=config.seed,
        runs=config.runs,
        arrays=stacked,
        payload=Study(config, **stacked),
    )


def claims(result: Result) -> list[Claim]:
    """Judge the rule, and the withdrawal."""
    study: Study = result.payload
    return [_better(study), _worth_it(study), _found_out(study), _kept(study)]


def _log_ratio(study: Study, mode: str) -> Array:
    """Logarithm of the error of a mode over that with landmarks on moving things forbidden (runs,)."""
    return np.asarray(np.log(study.rmse[:, MODES.index(mode)] / study.rmse[:, MODES.index("forbidden")]))


def _ratio_claim(study: Study, mode: str, id: str, text: str, draw: int) -> Claim:
    log_ratio = _log_ratio(study, mode)
    rng = np.random.default_rng([study.config.seed, draw])
    interval = [float(np.exp(v)) for v in interval_of_means(log_ratio, rng)]
    return Claim(
        id,
        "A§4.4",
        text,
        f"geometric mean of RMSE {mode} / forbidden, same runs: 95 % whole-run interval > 1",
        {"ratio": float(np.exp(log_ratio.mean()))},
        interval,
        null_rate(study.config.runs),
        float(np.mean(log_ratio > 0)),
        verdict(interval[0] > 1.0),
    )


def _better(study: Study) -> Claim:
    text = "Landmarks set on things that move make the position worse: they must be taken from S"
    return _ratio_claim(study, "allowed", "moving-landmarks-harm", text, 1)


def _worth_it(study: Study) -> Claim:
    text = "Localisation by landmarks from S is better than odometry"
    return _ratio_claim(study, "odometry", "landmarks-help", text, 2)


def _found_out(study: Study) -> Claim:
    """A landmark on something that is moved later is withdrawn."""
    wrong, out = study.wrong[:, 0].sum(), study.found_out[:, 0].sum()
    share = float(out / wrong) if wrong else None
    return Claim(
        "found-out",
        "A§4.4",
        "A landmark set on something that later moves away is found out",
        f"of landmarks whose corner left, and whose old place was looked through: >= {FOUND_OUT:g} withdrawn "
        "(pooled over runs; none such: not testable)",
        {"wrong": float(wrong), "withdrawn": float(out)},
        None,
        None,
        share,
        verdict(None if share is None else share >= FOUND_OUT),
    )


def _kept(study: Study) -> Claim:
    """Landmarks on walls stay."""
    good = (study.chosen - study.on_things)[:, 0].sum()
    share = float(study.good_lost[:, 0].sum() / good) if good else None
    return Claim(
        "good-ones-stay",
        "A§4.4",
        "Landmarks on what never moves are not withdrawn",
        f"share withdrawn of landmarks on walls and pillars <= {GOOD_LOST:g}, pooled over runs",
        {"on_fixed": float(good), "withdrawn": float(study.good_lost[:, 0].sum())},
        None,
        None,
        None if share is None else 1.0 - share,
        verdict(None if share is None else share <= GOOD_LOST),
    )


def figure(result: Result) -> Figure:
    """Errors of the modes run by run, and what became of the landmarks."""
    from vslam_ref.plot.floor_plan import choice_figure

    study: Study = result.payload
    counts = {
        n: getattr(study, n).sum(axis=0) for n in ("chosen", "on_things", "wrong", "found_out", "good_lost")
    }
    return choice_figure(study.rmse, counts, MODES)


def quick(config: ChoiceConfig) -> ChoiceConfig:
    """Three runs of 15 s."""
    return dataclasses.replace(config, runs=3, world=dataclasses.replace(config.world, duration=15.0))


EXPERIMENT = Experiment(
    id="grids-landmarks",
    title="Landmarks on moving things: forbidden against allowed",
    source="A, section 4.4",
    config_type=ChoiceConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
)
