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

from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Study, between, judged
from vslam_ref.experiments.framework.claims import LEAST_FOR_EVERY_RUN, LEAST_FOR_SHARE
from vslam_ref.experiments.framework.statistics import interval_of_means, interval_of_ratio
from vslam_ref.experiments.tukey.scene import (
    COSTS,
    FAR,
    Run,
    TukeyConfig,
    losses,
    make_scene,
    objective,
    simulate,
)

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


def cost_curves(config: TukeyConfig) -> dict[str, Array]:
    """Every cost over the norm of an error, ``x``, in sigma."""
    x = np.linspace(0.0, 1.6 * losses()["corrected"].c, 641)
    return {name: loss.cost(x) for name, loss in losses().items()} | {"x": x}


def found(study: Study[Run]) -> dict[str, Array]:
    """Share of poses found by each cost, (starts,)."""
    return {name: np.mean(study.data.error[:, i] < FOUND, axis=0) for i, name in enumerate(COSTS)}


def series(study: Study[Run]) -> dict[str, object]:
    """Costs, and shares of poses found."""
    cost = {name: study.once[name] for name in COSTS}
    return {"norm": study.once["x"], "cost": cost, "starts": study.config.starts, "found": found(study)}


def claims(study: Study[Run]) -> list[Claim]:
    """Judge what the erratum says of the print."""
    data = study.data
    return [
        _falls(study.once), _lost(data), _far(study), _worse(data.clean, study.rng(2)),
        _reweighted(data.reweighted), _robust(data),
    ]  # fmt: skip


def _falls(cost: dict[str, Array]) -> Claim:
    """Beyond c/sqrt 3 a larger error is cheaper."""
    x, printed, right = cost["x"], cost["printed"], cost["corrected"]
    c = losses()["corrected"].c
    top = float(x[np.argmax(printed)])
    beyond = (x > c / np.sqrt(3)) & (x < c)
    cheaper, dearer = np.diff(printed[beyond]) < 0, np.diff(right[beyond]) > 0
    return judged(
        "falls-beyond-its-top",
        "A, eq. 2.8",
        "The printed cost rewards making a moderate error larger; Tukey's never does",
        "top within 0.5 % of c of c/sqrt 3; from there to c every step lowers the print and raises the "
        "correction",
        abs(top / c - 1 / np.sqrt(3)) < 0.005 and bool(cheaper.all() and dearer.all()),
        f"The printed cost is largest at {top / c:.3f} c, where c/sqrt 3 is 0.577 c; beyond it "
        f"{cheaper.mean():.0%} of "
        f"all steps lower it, and {dearer.mean():.0%} raise Tukey's",
        {"top_over_c": top / c, "cheaper": float(cheaper.mean()), "dearer": float(dearer.mean())},
    )


def _lost(data: Run) -> Claim:
    """The printed objective prefers to see nothing."""
    holds = data.far_cost < data.true_cost
    return judged(
        "prefers-to-be-lost",
        "A, eqs. 2.6 and 2.8",
        "A pose that explains no sighting at all is better than the true one, by the printed objective",
        "printed objective 10 field radii away < at the true pose, in every run",
        bool(holds.all()),
        f"Far from everything the printed objective is at most {data.far_cost.max():.3g}, at the truth at "
        "least "
        f"{data.true_cost.min():.3g}; to be lost is cheaper in {holds.mean():.0%} of the runs",
        {"far": float(data.far_cost.max()), "truth": float(data.true_cost.min())},
        share=float(holds.mean()),
    )


def _far(study: Study[Run]) -> Claim:
    """From 4 sigma away the correction comes home and the print does not."""
    at = study.config.starts.index(FAR)
    printed, corrected = (
        (study.data.error[:, COSTS.index(name), at] < FOUND).astype(np.float64)
        for name in ("printed", "corrected")
    )
    return judged(
        "drives-away-from-the-truth",
        "A, eqs. 2.6 and 2.8",
        f"From {FAR:g} sigma off, between c/sqrt 3 and c, the correction finds the pose, the print does not",
        f"share of runs within {FOUND:g} sigma: corrected >= {SEEN:g}, printed <= {MISSED:g} "
        "(ci: their difference, over whole runs)",
        corrected.mean() >= SEEN and printed.mean() <= MISSED,
        f"From {FAR:g} sigma off the correction finds the pose in {corrected.mean():.0%} of the runs, the "
        "print in "
        f"{printed.mean():.0%}; at least {SEEN:.0%} and at most {MISSED:.0%} are asked for",
        {"printed": float(printed.mean()), "corrected": float(corrected.mean())},
        ci=interval_of_means(corrected - printed, study.rng(1)),
        share=float(np.mean(corrected * (1.0 - printed))),
        least_runs=LEAST_FOR_SHARE,
    )


def _worse(clean: Array, rng: np.random.Generator) -> Claim:
    """On honest data, from the truth, the print is less precise."""
    printed, corrected = (clean[:, COSTS.index(name)] for name in ("printed", "corrected"))
    interval = interval_of_ratio(printed, corrected, rng)
    ratio = float(printed.mean() / corrected.mean())
    return judged(
        "wastes-honest-data",
        "A, eq. 2.8",
        "Without one wrong sighting, started at the truth, the print is less precise than the correction",
        f"ratio of mean square errors, 95 % whole-run interval > {WORSE:g}",
        interval[0] > WORSE,
        f"On honest data the print's mean square error is {ratio:.3g} times the correction's, with 95 % "
        f"{between(interval)}; more than {WORSE:g} counts as worse",
        {"ratio": ratio},
        ci=interval,
    )


def _reweighted(apart: Array) -> Claim:
    """Read as what it is, the print is right."""
    return judged(
        "right-as-the-reweighted-residual",
        "A, eq. 2.8",
        "Read as the residual of the linear system, sqrt(w) times the error, the printed formula is Tukey's",
        f"two Gauss-Newtons, one with each, end less than {SAME:g} sigma apart in every run",
        apart.max() < SAME,
        f"The poses of the two readings lie at most {apart.max():.1e} sigma apart, and {SAME:g} is allowed",
        {"largest_difference": float(apart.max())},
        share=float(np.mean(apart < SAME)),
    )


def _robust(data: Run) -> Claim:
    """The correction does what A wants of it."""
    error = {name: float(np.median(data.error[:, COSTS.index(name), 0])) for name in COSTS}
    clean = float(np.median(np.sqrt(data.clean[:, COSTS.index("corrected")])))
    return judged(
        "corrected-is-robust",
        "A§2.2.1",
        "With the correction, wrong sightings cost little; least squares follows them",
        "median error with wrong sightings: corrected < 1.5 times its own without; l2 > 3 times corrected",
        error["corrected"] < 1.5 * clean and error["l2"] > 3.0 * error["corrected"],
        f"With wrong sightings the correction's median error is {error['corrected']:.3g} sigma against "
        f"{clean:.3g} "
        f"without them, and that of least squares {error['l2']:.3g}",
        error | {"corrected_without_wrong": clean},
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def figure(study: Study[Run]) -> Figure:
    """Costs, the two objectives along a line through the truth, and shares of poses found."""
    from vslam_ref.plot.robust import errata_figure

    config = study.config
    rng = np.random.default_rng(np.random.SeedSequence(config.seed).spawn(1)[0])
    scene, reach = make_scene(config, rng), config.radius / config.sigma
    along = np.linspace(-9.0, 9.0, 361)
    sums = {
        name: np.array([objective(scene, losses()[name], np.array([d, 0.0, 0.0]), reach) for d in along])
        for name in ("printed", "corrected")
    }
    return errata_figure(
        study.once,
        along,
        sums,
        np.asarray(config.starts),
        found(study),
        c=losses()["corrected"].c,
        runs=config.runs,
        wrong=config.wrong,
    )


EXPERIMENT = Experiment(
    id="tukey-errata",
    title="A's Tukey loss, minimised as printed",
    source="A, equations 2.6 and 2.8",
    config_type=TukeyConfig,
    simulate=simulate,
    once=cost_curves,
    series=series,
    claims=claims,
    figure=figure,
    about={
        "error": "mean displacement of the landmarks by the pose found, sigma; (runs, costs, starts)",
        "clean": "the same, squared, without wrong sightings; (runs, costs)",
        "far_cost": "the printed objective far away from every sighting; (runs,)",
        "true_cost": "the printed objective at the truth; (runs,)",
        "reweighted": "distance of the poses of the two readings of A2.8, sigma; (runs,)",
    },
    quick={"runs": 24, "starts": (0.0, 2.0, FAR, 6.0)},  # the effects are large
)
