"""Position error with and without the separation as the crowd grows, and what a wrong position does to D.

The aim, half the error, is judged twice: for the loop as it is, whose matcher gives up beams that end far
from what is static, and for least squares.  Beside it stands what perfect knowledge of what moves would give.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Study, between, judged
from vslam_ref.experiments.framework.statistics import interval_of_means, interval_of_ratio, null_rate
from vslam_ref.experiments.grids.following import (
    SPOILED,
    LocalisationConfig,
    Run,
    f_score,
    points,
    simulate,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


HALF = 0.5
"""Aim: RMSE with separation over RMSE with a plain grid in the densest crowd."""
FALLS = 0.05
"""Fall of D's F score that counts as spoiled."""
GROWS = 2.0
"""Growth of the position error that counts as spoiled."""


def measured(study: Study[Run]) -> dict[str, Array]:
    """Arrays by density, then runs; ``squares`` and ``spoiled`` of the one density that has them."""
    config, d = study.config, len(study.config.densities)
    fields = study.data._asdict()
    spoiled = fields.pop("spoiled")[next(i for i, p in enumerate(points(config)) if p.spoil)]
    found = {name: a[:d] for name, a in fields.items()}
    return found | {"squares": study.data.squares[d - 1], "spoiled": spoiled}


def series(study: Study[Run]) -> dict[str, object]:
    """Means over the runs."""
    m = measured(study)
    return {
        "density": study.config.densities,
        "rmse": m["rmse"].mean(axis=1),
        "final": m["final"].mean(axis=1),
        "rmse_squares": m["squares"].mean(axis=0),
        "f_score": f_score(m["beams"]).mean(axis=1),
        "on_people": m["on_people"].mean(axis=1),
        "error": study.config.errors,
        "f_score_spoiled": f_score(m["spoiled"]).mean(axis=0),
    }


def claims(study: Study[Run]) -> list[Claim]:
    """Judge the separation, and A's sentence with its converse."""
    m = measured(study)
    rmse, squares = m["rmse"], m["squares"]
    return [
        _half(rmse[-1], "halves-the-error", "", study.rng(1)),
        _half(squares, "halves-the-error-of-least-squares", ", with least squares", study.rng(5)),
        _without_mistakes(rmse, study.rng(6)),
        _cut_does_more(rmse[-1, :, 1], squares[:, 0], study.rng(7)),
        _helps(rmse[1:], study.rng(2)),
        _spoils_dynamic(study.config.errors, f_score(m["spoiled"]), study.rng(3)),
        _spoils_static(rmse[0, :, 1], rmse[-1, :, 1], study.rng(4)),
    ]


def _half(rmse: Array, id: str, how: str, rng: np.random.Generator) -> Claim:
    """The aim: half the error in the densest crowd."""
    separated, plain, _ = rmse.T
    ratio = float(separated.mean() / plain.mean())
    return judged(
        id,
        "A§4.4",
        f"In the densest crowd the separation halves the position error{how}",
        f"mean RMSE with separation / with a plain grid <= {HALF:g} (ci: of this ratio, over whole runs)",
        ratio <= HALF,
        f"In the densest crowd the position error is {separated.mean():.3g} m with the separation and "
        f"{plain.mean():.3g} m with a plain grid{how}, {ratio:.2f} times as large; the aim is {HALF:g}",
        {"ratio": ratio, "separated": float(separated.mean()), "plain": float(plain.mean())},
        ci=interval_of_ratio(separated, plain, rng),
        share=float(np.mean(separated <= HALF * plain)),
    )


def _without_mistakes(rmse: Array, rng: np.random.Generator) -> Claim:
    """What stands against the aim: a separation without mistakes would miss it, too."""
    _, plain, ideal = rmse[-1].T
    interval = interval_of_ratio(ideal, plain, rng)
    ratio = float(ideal.mean() / plain.mean())
    return judged(
        "no-mistakes-would-not-halve-it",
        "ours",
        "A separation without mistakes would not halve the position error in the densest crowd, either",
        f"RMSE with the truth's beams / with a plain grid: 95 % whole-run interval > {HALF:g}",
        interval[0] > HALF,
        f"A robot that knows which beams end on people has {ratio:.2f} times the error of a plain grid, "
        "with 95 % "
        f"{between(interval)}; to halve it would be {HALF:g}",
        {"ratio": ratio, "ideal": float(ideal.mean()), "plain": float(plain.mean())},
        ci=interval,
        null_rate=null_rate(len(plain)),
        share=float(np.mean(ideal > HALF * plain)),
    )


def _cut_does_more(plain: Array, separated: Array, rng: np.random.Generator) -> Claim:
    """What helps instead: a matcher that gives up what lies far off."""
    interval = interval_of_ratio(plain, separated, rng)
    return judged(
        "a-cut-does-more",
        "ours",
        "A matcher that gives up distant beams does more in a plain grid than least squares do in S",
        "RMSE plain with the cut / separated with least squares, densest crowd: 95 % whole-run interval < 1",
        interval[1] < 1.0,
        f"A plain grid with the cut is off by {plain.mean():.3g} m, the separated one with least squares by "
        f"{separated.mean():.3g} m; their ratio lies {between(interval)} (95 %)",
        {"plain_cut": float(plain.mean()), "separated_squares": float(separated.mean())},
        ci=interval,
        null_rate=null_rate(len(plain)),
        share=float(np.mean(plain < separated)),
    )


def _helps(crowded: Array, rng: np.random.Generator) -> Claim:
    """The weaker sentence: it helps at all, over all crowds."""
    log_ratio = np.log(crowded[..., 0] / crowded[..., 1]).mean(axis=0)
    interval = np.exp(interval_of_means(log_ratio, rng)).tolist()
    ratio = float(np.exp(log_ratio.mean()))
    return judged(
        "helps",
        "A§4.4",
        "With people on the floor the separation makes the position error smaller",
        "geometric mean over crowds of RMSE separated / plain, per run: 95 % whole-run interval < 1",
        interval[1] < 1.0,
        f"Over all crowds the position error with the separation is {ratio:.2f} times that of a plain "
        "grid, with "
        f"95 % {between(interval)}",
        {"ratio": ratio},
        ci=interval,
        null_rate=null_rate(len(log_ratio)),
        share=float(np.mean(log_ratio < 0)),
    )


def _spoils_dynamic(errors: Sequence[float], f: Array, rng: np.random.Generator) -> Claim:
    """A's sentence: errors of the static positions make errors of the dynamic estimate."""
    true, spoiled = f[:, errors.index(0.0)], f[:, errors.index(SPOILED)]
    fall = true - spoiled
    interval = interval_of_means(fall, rng)
    return judged(
        "static-error-spoils-dynamic",
        "A§4.4",
        "Errors of the static positions lead to errors in the estimate of what moves",
        f"fall of D's F score per beam, poses wrong by {SPOILED:g} m against true: "
        f"95 % whole-run interval > {FALLS:g}",
        interval[0] > FALLS,
        f"D's F score falls from {true.mean():.3f} with true poses to {spoiled.mean():.3f} with poses "
        "wrong by "
        f"{SPOILED:g} m; the fall lies {between(interval)} (95 %), and {FALLS:g} counts as spoiled",
        {"true": float(true.mean()), "spoiled": float(spoiled.mean())},
        ci=interval,
        null_rate=null_rate(len(fall)),
        share=float(np.mean(fall > FALLS)),
    )


def _spoils_static(empty: Array, dense: Array, rng: np.random.Generator) -> Claim:
    """The converse: what moves spoils the static estimate, here the position in a plain grid."""
    interval = interval_of_ratio(dense, empty, rng)
    return judged(
        "moving-things-spoil-static",
        "A§4.4",
        "The converse: moving things that nobody separates lead to errors of the static positions",
        f"RMSE with a plain grid, densest crowd / empty floor: 95 % whole-run interval > {GROWS:g}",
        interval[0] > GROWS,
        f"In a plain grid the position is off by {empty.mean():.3g} m on an empty floor and by "
        f"{dense.mean():.3g} m in "
        f"the densest crowd; their ratio lies {between(interval)} (95 %), and {GROWS:g} is asked for",
        {"empty": float(empty.mean()), "dense": float(dense.mean())},
        ci=interval,
        null_rate=null_rate(len(empty)),
        share=float(np.mean(dense > GROWS * empty)),
    )


def figure(study: Study[Run]) -> Figure:
    """Position error over the crowd's density, and D over the error of the poses."""
    from vslam_ref.plot.floor_plan import localisation_figure

    m, config = measured(study), study.config
    return localisation_figure(
        np.asarray(config.densities),
        m["rmse"],
        m["squares"],
        np.asarray(config.errors),
        f_score(m["spoiled"]),
    )


EXPERIMENT = Experiment(
    id="grids-localisation",
    title="Localisation with and without the separation, as the crowd grows",
    source="A, section 4.4",
    config_type=LocalisationConfig,
    simulate=simulate,
    points=points,
    series=series,
    arrays=measured,
    claims=claims,
    figure=figure,
    about={
        "rmse": "root mean square position error, metres; (densities, runs, separated/plain/ideal)",
        "final": "position error at the end, metres; (densities, runs, separated/plain/ideal)",
        "squares": "as rmse, with least squares, in the densest crowd; (runs, separated/plain/ideal)",
        "beams": "beams rightly called moving, called moving, on moving things; (densities, runs, count)",
        "spoiled": "the same counts for maps from wrong poses; (runs, errors, count)",
        "on_people": "share of the beams that end on a person; (densities, runs)",
    },
    quick={
        "runs": 2, "densities": (0.0, 0.2), "errors": (0.0, SPOILED), "error_density": 0.2,
        "world.duration": 8.0,
    },
)  # fmt: skip
