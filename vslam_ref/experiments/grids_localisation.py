"""Position error with and without the separation as the crowd grows, and what a wrong position does to D.

The aim, half the error, is judged twice: for the loop as it is, whose matcher gives up beams that end far
from what is static, and for least squares.  Beside it stands what perfect knowledge of what moves would give.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext, verdict
from vslam_ref.experiments.moving.localisation import (
    SPOILED,
    LocalisationConfig,
    Run,
    Task,
    f_score,
    simulate_run,
)
from vslam_ref.experiments.moving.readings import interval_of_means, interval_of_ratio, null_rate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


HALF = 0.5
"""Aim: RMSE with separation over RMSE with a plain grid in the densest crowd."""
FALLS = 0.05
"""Fall of D's F score that counts as spoiled."""
GROWS = 2.0
"""Growth of the position error that counts as spoiled."""


class Study(NamedTuple):
    """All runs: arrays with densities, then runs first; ``squares``, ``spoiled`` with runs first."""

    config: LocalisationConfig
    rmse: Array
    final: Array
    squares: Array
    beams: Array
    spoiled: Array
    on_people: Array


def run(config: LocalisationConfig, context: RunContext) -> Result:
    """Run all densities, and the wrong poses at ``error_density``."""
    seeds = np.random.SeedSequence(config.seed).spawn(config.runs)
    tasks = [Task(config, density, seed, False) for density in config.densities for seed in seeds]
    densest = config.densities[-1]
    tasks = [t._replace(spoil=t.density == config.error_density, squares=t.density == densest) for t in tasks]
    if config.error_density not in config.densities:
        tasks += [Task(config, config.error_density, seed, True) for seed in seeds]
    done = context.map(simulate_run, tasks, "crowds")
    shape, first = (len(config.densities), config.runs), len(config.densities) * config.runs
    stacked = {n: np.array([getattr(r, n) for r in done]) for n in Run._fields}
    spoiled = stacked.pop("spoiled")[np.array([t.spoil for t in tasks])]
    stacked = {n: a[:first].reshape(*shape, *a.shape[1:]) for n, a in stacked.items()}
    stacked["squares"] = stacked["squares"][-1]
    study = Study(config, spoiled=spoiled, **stacked)
    return Result(
        series={
            "density": config.densities,
            "rmse": study.rmse.mean(axis=1),
            "final": study.final.mean(axis=1),
            "rmse_squares": study.squares.mean(axis=0),
            "f_score": f_score(study.beams).mean(axis=1),
            "on_people": study.on_people.mean(axis=1),
            "error": config.errors,
            "f_score_spoiled": f_score(spoiled).mean(axis=0),
        },
        seed=config.seed,
        runs=config.runs,
        arrays={**stacked, "spoiled": spoiled},
        payload=study,
    )


def claims(result: Result) -> list[Claim]:
    """Judge the separation, and A's sentence with its converse."""
    study: Study = result.payload
    return [
        _half(study, study.rmse[-1], "halves-the-error", "", 1),
        _half(study, study.squares, "halves-the-error-of-least-squares", ", with least squares", 5),
        _without_mistakes(study),
        _cut_does_more(study),
        _helps(study),
        _spoils_dynamic(study),
        _spoils_static(study),
    ]


def _half(study: Study, rmse: Array, id: str, how: str, draw: int) -> Claim:
    """The aim: half the error in the densest crowd."""
    separated, plain, _ = rmse.T
    ratio = float(separated.mean() / plain.mean())
    rng = np.random.default_rng([study.config.seed, draw])
    return Claim(
        id,
        "A§4.4",
        f"In the densest crowd the separation halves the position error{how}",
        f"mean RMSE with separation / with a plain grid <= {HALF:g} (ci: of this ratio, over whole runs)",
        {"ratio": ratio, "separated": float(separated.mean()), "plain": float(plain.mean())},
        interval_of_ratio(separated, plain, rng),
        None,
        float(np.mean(separated <= HALF * plain)),
        verdict(ratio <= HALF),
    )


def _without_mistakes(study: Study) -> Claim:
    """What stands against the aim: a separation without mistakes would miss it, too."""
    _, plain, ideal = study.rmse[-1].T
    rng = np.random.default_rng([study.config.seed, 6])
    interval = interval_of_ratio(ideal, plain, rng)
    return Claim(
        "no-mistakes-would-not-halve-it",
        "ours",
        "A separation without mistakes would not halve the position error in the densest crowd, either",
        f"RMSE with the truth's beams / with a plain grid: 95 % whole-run interval > {HALF:g}",
        {
            "ratio": float(ideal.mean() / plain.mean()),
            "ideal": float(ideal.mean()),
            "plain": float(plain.mean()),
        },
        interval,
        null_rate(study.config.runs),
        float(np.mean(ideal > HALF * plain)),
        verdict(interval[0] > HALF),
    )


def _cut_does_more(study: Study) -> Claim:
    """What helps instead: a matcher that gives up what lies far off."""
    plain, separated = study.rmse[-1, :, 1], study.squares[:, 0]
    rng = np.random.default_rng([study.config.seed, 7])
    interval = interval_of_ratio(plain, separated, rng)
    return Claim(
        "a-cut-does-more",
        "ours",
        "A matcher that gives up distant beams does more in a plain grid than least squares do in S",
        "RMSE plain with the cut / separated with least squares, densest crowd: 95 % whole-run interval < 1",
        {"plain_cut": float(plain.mean()), "separated_squares": float(separated.mean())},
        interval,
        null_rate(study.config.runs),
        float(np.mean(plain < separated)),
        verdict(interval[1] < 1.0),
    )


def _helps(study: Study) -> Claim:
    """The weaker sentence: it helps at all, over all crowds."""
    crowded = study.rmse[1:]
    log_ratio = np.log(crowded[..., 0] / crowded[..., 1]).mean(axis=0)
    rng = np.random.default_rng([study.config.seed, 2])
    interval = [float(np.exp(v)) for v in interval_of_means(log_ratio, rng)]
    return Claim(
        "helps",
        "A§4.4",
        "With people on the floor the separation makes the position error smaller",
        "geometric mean over crowds of RMSE separated / plain, per run: 95 % whole-run interval < 1",
        {"ratio": float(np.exp(log_ratio.mean()))},
        interval,
        null_rate(study.config.runs),
        float(np.mean(log_ratio < 0)),
        verdict(interval[1] < 1.0),
    )


def _spoils_dynamic(study: Study) -> Claim:
    """A's sentence: errors of the static positions make errors of the dynamic estimate."""
    errors = study.config.errors
    f = f_score(study.spoiled)
    fall = f[:, errors.index(0.0)] - f[:, errors.index(SPOILED)]
    rng = np.random.default_rng([study.config.seed, 3])
    interval = interval_of_means(fall, rng)
    return Claim(
        "static-error-spoils-dynamic",
        "A§4.4",
        "Errors of the static positions lead to errors in the estimate of what moves",
        f"fall of D's F score per beam, poses wrong by {SPOILED:g} m against true: "
        f"95 % whole-run interval > {FALLS:g}",
        {"true": float(f[:, errors.index(0.0)].mean()), "spoiled": float(f[:, errors.index(SPOILED)].mean())},
        interval,
        null_rate(study.config.runs),
        float(np.mean(fall > FALLS)),
        verdict(interval[0] > FALLS),
    )


def _spoils_static(study: Study) -> Claim:
    """The converse: what moves spoils the static estimate, here the position in a plain grid."""
    empty, dense = study.rmse[0, :, 1], study.rmse[-1, :, 1]
    rng = np.random.default_rng([study.config.seed, 4])
    interval = interval_of_ratio(dense, empty, rng)
    return Claim(
        "moving-things-spoil-static",
        "A§4.4",
        "The converse: moving things that nobody separates lead to errors of the static positions",
        f"RMSE with a plain grid, densest crowd / empty floor: 95 % whole-run interval > {GROWS:g}",
        {"empty": float(empty.mean()), "dense": float(dense.mean())},
        interval,
        null_rate(study.config.runs),
        float(np.mean(dense > GROWS * empty)),
        verdict(interval[0] > GROWS),
    )


def figure(result: Result) -> Figure:
    """Position error over the crowd's density, and D over the error of the poses."""
    from vslam_ref.plot.floor_plan import localisation_figure

    study: Study = result.payload
    return localisation_figure(
        np.asarray(study.config.densities),
        study.rmse,
        study.squares,
        np.asarray(study.config.errors),
        f_score(study.spoiled),
    )


def quick(config: LocalisationConfig) -> LocalisationConfig:
    """Two runs of 8 s, an empty floor and one crowd."""
    world = dataclasses.replace(config.world, duration=8.0)
    return dataclasses.replace(
        config, runs=2, densities=(0.0, 0.2), errors=(0.0, SPOILED), error_density=0.2, world=world
    )


EXPERIMENT = Experiment(
    id="grids-localisation",
    title="Localisation with and without the separation, as the crowd grows",
    source="A, section 4.4",
    config_type=LocalisationConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
)
