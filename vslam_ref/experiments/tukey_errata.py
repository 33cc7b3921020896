"""A2.8 minimised as printed, beside its correction: what a solver does with it.

A vehicle stands among known landmarks and sees all of them, each with a Gaussian error; a fifth of the
sightings are wrong.  Its pose is estimated by minimising a sum of costs of error *norms*, as A2.6 does for a
camera.  Four cost functions, one solver that only ever goes downhill (Nelder and Mead's), the same starts:

* ``printed``: the formula of A2.8, taken as the cost that A2.6 minimises;
* ``corrected``: Tukey's cost with the same constant;
* ``huber`` and ``l2`` for comparison.

The scale of the errors is known here, so that nothing but the cost differs.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext, verdict
from vslam_ref.experiments.tukey.scene import (
    COSTS,
    FAR,
    Run,
    Task,
    TukeyConfig,
    losses,
    make_scene,
    objective,
    simulate,
)
from vslam_ref.metrics.consistency import percentile_interval, resample_weights

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FOUND = 1.0
"""Mean displacement of the landmarks, in sigma, up to which a pose is found."""
SEEN, MISSED = 0.95, 0.05
"""A cost that works finds this share of poses; one that does not, at most that share."""
WORSE = 1.1
"""Ratio of mean square errors on honest data from which the print counts as worse."""
SAME = 1e-6
"""Difference of two poses, in sigma, that counts as none."""


class Study(NamedTuple):
    """All runs: arrays with the runs first."""

    config: TukeyConfig
    error: Array
    clean: Array
    far_cost: Array
    true_cost: Array
    reweighted: Array
    cost: dict[str, Array]


def run(config: TukeyConfig, context: RunContext) -> Result:
    """Run every scene."""
    seeds = np.random.SeedSequence(config.seed).spawn(config.runs)
    done = context.map(simulate, [Task(config, s) for s in seeds], "tukey")
    stacked = {name: np.array([getattr(r, name) for r in done]) for name in Run._fields}
    c = losses()["corrected"].c
    x = np.linspace(0.0, 1.6 * c, 641)
    cost = {name: loss.cost(x) for name, loss in losses().items()} | {"x": x}
    study = Study(config=config, cost=cost, **stacked)
    found = {name: np.mean(study.error[:, i] < FOUND, axis=0) for i, name in enumerate(COSTS)}
    return Result(
        series={"norm": x, "cost": {n: cost[n] for n in COSTS}, "starts": config.starts, "found": found},
        seed=config.seed,
        runs=config.runs,
        arrays=stacked,
        payload=study,
    )


def claims(result: Result) -> list[Claim]:
    """Judge what the erratum says of the print."""
    study: Study = result.payload
    return [_falls(study), _lost(study), _far(study), _worse(study), _reweighted(study), _robust(study)]


def _falls(study: Study) -> Claim:
    """Beyond c/sqrt 3 a larger error is cheaper."""
    x, printed, right = study.cost["x"], study.cost["printed"], study.cost["corrected"]
    c = losses()["corrected"].c
    top = float(x[np.argmax(printed)])
    beyond = (x > c / np.sqrt(3)) & (x < c)
    cheaper, dearer = np.diff(printed[beyond]) < 0, np.diff(right[beyond]) > 0
    holds = abs(top / c - 1 / np.sqrt(3)) < 0.005 and bool(cheaper.all() and dearer.all())
    return Claim(
        "falls-beyond-its-top",
        "A, eq. 2.8",
        "The printed cost rewards making a moderate error larger; Tukey's never does",
        "top within 0.5 % of c of c/sqrt 3; from there to c every step lowers the print and raises the "
        "correction",
        {"top_over_c": top / c, "cheaper": float(cheaper.mean()), "dearer": float(dearer.mean())},
        None,
        None,
        None,
        verdict(holds),
    )


def _lost(study: Study) -> Claim:
    """The printed objective prefers to see nothing."""
    holds = study.far_cost < study.true_cost
    return Claim(
        "prefers-to-be-lost",
        "A, eqs. 2.6 and 2.8",
        "A pose that explains no sighting at all is better than the true one, by the printed objective",
        "printed objective 10 field radii away < at the true pose, in every run",
        {"far": float(study.far_cost.max()), "truth": float(study.true_cost.min())},
        None,
        None,
        float(holds.mean()),
        verdict(bool(holds.all())),
    )


def _share(study: Study, name: str, start: float) -> Array:
    column = study.error[:, COSTS.index(name), study.config.starts.index(start)]
    return (column < FOUND).astype(np.float64)


def _far(study: Study) -> Claim:
    """From 4 sigma away the correction comes home and the print does not."""
    shares = {name: _share(study, name, FAR) for name in ("printed", "corrected")}
    rng = np.random.default_rng([study.config.seed, 1])
    draws = resample_weights(study.config.runs, 2000, rng) @ (shares["corrected"] - shares["printed"])
    holds = shares["corrected"].mean() >= SEEN and shares["printed"].mean() <= MISSED
    return Claim(
        "drives-away-from-the-truth",
        "A, eqs. 2.6 and 2.8",
        f"From {FAR:g} sigma off, between c/sqrt 3 and c, the correction finds the pose, the print does not",
        f"share of runs within {FOUND:g} sigma: corrected >= {SEEN:g}, printed <= {MISSED:g} "
        "(ci: their difference, over whole runs)",
        {name: float(s.mean()) for name, s in shares.items()},
        list(percentile_interval(draws)),
        None,
        float(np.mean(shares["corrected"] * (1.0 - shares["printed"]))),
        verdict(bool(holds)),
    )


def _worse(study: Study) -> Claim:
    """On honest data, from the truth, the print is less precise."""
    pair = study.clean[:, [COSTS.index("printed"), COSTS.index("corrected")]]
    rng = np.random.default_rng([study.config.seed, 2])
    sums = resample_weights(study.config.runs, 2000, rng) @ pair
    interval = percentile_interval(sums[:, 0] / sums[:, 1])
    return Claim(
        "wastes-honest-data",
        "A, eq. 2.8",
        "Without one wrong sighting, started at the truth, the print is less precise than the correction",
        f"ratio of mean square errors, 95 % whole-run interval > {WORSE:g}",
        {"ratio": float(pair[:, 0].mean() / pair[:, 1].mean())},
        list(interval),
        None,
        None,
        verdict(interval[0] > WORSE),
    )


def _reweighted(study: Study) -> Claim:
    """Read as what it is, the print is right."""
    largest = float(study.reweighted.max())
    return Claim(
        "right-as-the-reweighted-residual",
        "A, eq. 2.8",
        "Read as the residual of the linear system, sqrt(w) times the error, the printed formula is Tukey's",
        f"two Gauss-Newtons, one with each, end less than {SAME:g} sigma apart in every run",
        {"largest_difference": largest},
        None,
        None,
        float(np.mean(study.reweighted < SAME)),
        verdict(largest < SAME),
    )


def _robust(study: Study) -> Claim:
    """The correction does what A wants of it."""
    error = {name: float(np.median(study.error[:, COSTS.index(name), 0])) for name in COSTS}
    clean = float(np.median(np.sqrt(study.clean[:, COSTS.index("corrected")])))
    holds = error["corrected"] < 1.5 * clean and error["l2"] > 3.0 * error["corrected"]
    return Claim(
        "corrected-is-robust",
        "A§2.2.1",
        "With the correction, wrong sightings cost little; least squares follows them",
        "median error with wrong sightings: corrected < 1.5 times its own without; l2 > 3 times corrected",
        error | {"corrected_without_wrong": clean},
        None,
        None,
        None,
        verdict(holds),
    )


def figure(result: Result) -> Figure:
    """Costs, the two objectives along a line through the truth, and shares of poses found."""
    from vslam_ref.plot.robust import errata_figure

    study: Study = result.payload
    config = study.config
    rng = np.random.default_rng(np.random.SeedSequence(config.seed).spawn(1)[0])
    scene, reach = make_scene(config, rng), config.radius / config.sigma
    along = np.linspace(-9.0, 9.0, 361)
    sums = {
        name: np.array([objective(scene, losses()[name], np.array([d, 0.0, 0.0]), reach) for d in along])
        for name in ("printed", "corrected")
    }
    return errata_figure(
        study.cost,
        along,
        sums,
        np.asarray(config.starts),
        {name: np.asarray(result.series["found"][name]) for name in COSTS},
        c=losses()["corrected"].c,
        runs=config.runs,
        wrong=config.wrong,
    )


def quick(config: TukeyConfig) -> TukeyConfig:
    """Fewer runs and starts; the effects are large."""
    return dataclasses.replace(config, runs=24, starts=(0.0, 2.0, FAR, 6.0))


EXPERIMENT = Experiment(
    id="tukey-errata",
    title="A's Tukey loss, minimised as printed",
    source="A, equations 2.6 and 2.8",
    config_type=TukeyConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
)
