"""Landmarks on moving things: forbidden, as A wants it, against allowed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.experiments.framework import Claim, Experiment, Study, between, judged
from vslam_ref.experiments.framework.statistics import interval_of_means, null_rate
from vslam_ref.experiments.grids.choice import MODES, ChoiceConfig, Run, simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FOUND_OUT = 0.9
"""Share of landmarks, whose corner moved away before the robot's eyes, that must be withdrawn."""
GOOD_LOST = 0.1
"""Share of landmarks on what never moves that may be withdrawn."""


def claims(study: Study[Run]) -> list[Claim]:
    """Judge the rule, and the withdrawal."""
    return [
        _ratio_claim(
            study, "allowed", "moving-landmarks-harm",
            "Landmarks set on things that move make the position worse: they must be taken from S", 1,
        ),
        _ratio_claim(
            study, "odometry", "landmarks-help", "Localisation by landmarks from S is better than odometry", 2
        ),
        _found_out(study.data),
        _kept(study.data),
    ]  # fmt: skip


def _ratio_claim(study: Study[Run], mode: str, id: str, text: str, draw: int) -> Claim:
    """Error of a mode over that with landmarks on moving things forbidden."""
    rmse = study.data.rmse
    log_ratio = np.log(rmse[:, MODES.index(mode)] / rmse[:, MODES.index("forbidden")])
    interval = np.exp(interval_of_means(log_ratio, study.rng(draw))).tolist()
    ratio = float(np.exp(log_ratio.mean()))
    what = {"allowed": "With landmarks on moving things allowed", "odometry": "By odometry alone"}[mode]
    return judged(
        id,
        "A§4.4",
        text,
        f"geometric mean of RMSE {mode} / forbidden, same runs: 95 % whole-run interval > 1",
        interval[0] > 1.0,
        f"{what} the position error is {ratio:.2f} times that with landmarks from S, with 95 % "
        f"{between(interval)}",
        {"ratio": ratio},
        ci=interval,
        null_rate=null_rate(len(rmse)),
        share=float(np.mean(log_ratio > 0)),
    )


def _found_out(data: Run) -> Claim:
    """A landmark on something that is moved later is withdrawn."""
    wrong, out = float(data.wrong[:, 0].sum()), float(data.found_out[:, 0].sum())
    share = out / wrong if wrong else None
    return judged(
        "found-out",
        "A§4.4",
        "A landmark set on something that later moves away is found out",
        f"of landmarks whose corner left, and whose old place was looked through: >= {FOUND_OUT:g} withdrawn "
        "(pooled over runs; none such: not testable)",
        None if share is None else share >= FOUND_OUT,
        f"Of {wrong:.0f} landmarks whose corner moved away in view, {out:.0f} were withdrawn; "
        f"{FOUND_OUT:.0%} are "
        "asked for",
        {"wrong": wrong, "withdrawn": out},
        share=share,
    )


def _kept(data: Run) -> Claim:
    """Landmarks on walls stay."""
    good, lost = float((data.chosen - data.on_things)[:, 0].sum()), float(data.good_lost[:, 0].sum())
    share = lost / good if good else None
    return judged(
        "good-ones-stay",
        "A§4.4",
        "Landmarks on what never moves are not withdrawn",
        f"share withdrawn of landmarks on walls and pillars <= {GOOD_LOST:g}, pooled over runs",
        None if share is None else share <= GOOD_LOST,
        f"Of {good:.0f} landmarks on walls and pillars, {lost:.0f} were withdrawn; {GOOD_LOST:.0%} are "
        "allowed",
        {"on_fixed": good, "withdrawn": lost},
        share=None if share is None else 1.0 - share,
    )


def figure(study: Study[Run]) -> Figure:
    """Errors of the modes run by run, and what became of the landmarks."""
    from vslam_ref.plot.floor_plan import choice_figure

    counts = {name: a.sum(axis=0) for name, a in study.data._asdict().items() if name != "rmse"}
    return choice_figure(study.data.rmse, counts, MODES)


EXPERIMENT = Experiment(
    id="grids-landmarks",
    title="Landmarks on moving things: forbidden against allowed",
    source="A, section 4.4",
    config_type=ChoiceConfig,
    simulate=simulate,
    series=lambda study: {"modes": MODES, **{n: a.mean(axis=0) for n, a in study.data._asdict().items()}},
    claims=claims,
    figure=figure,
    about={
        "rmse": "root mean square position error, metres; (runs, forbidden/allowed/odometry)",
        "chosen": "landmarks chosen; (runs, mode)",
        "on_things": "of these, on corners of things that move some time; (runs, mode)",
        "wrong": "landmarks whose corner moved away in view; (runs, mode)",
        "found_out": "of these, withdrawn; (runs, mode)",
        "good_lost": "landmarks on what never moves that were withdrawn; (runs, mode)",
    },
    quick={"runs": 3, "world.duration": 15.0},
)
