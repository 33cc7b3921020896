"""The arrow matrix of bundle adjustment and its Schur complement, drawn from a real problem, and counted.

A real problem (BAL, 16 views and 22106 points; a simulation where it is not found) gives the arrow: the
normal matrix of all its views and forty of its points, differenced column by column, so that every zero is
measured.
A camera that walks along a wall, its pictures shuffled, gives the band.  Costs are multiplications counted on
the factors of a sparse solver that knows nothing of views and points.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.experiments.bundle.sparsity import (
    Arrow,
    Counts,
    SparsityConfig,
    Walk,
    arrow,
    count_orders,
    count_walk,
    real_problem,
    views_system,
    walk,
)
from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext, verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure


PREDICTED = 1e-9
"""Relative difference of a count and its formula: none but rounding of large sums."""
CHEAPER = 10.0
"""Times that the wrong order costs more."""
LINEAR, CUBIC = (1.8, 2.3), 7.0
"""Factors of a cost when a long walk becomes twice as long: linear up to its ends; cubic is 8."""
SAME = 1e-9
"""Relative difference of two solutions of one system."""


class Study(NamedTuple):
    """Everything drawn and counted."""

    config: SparsityConfig
    arrow: Arrow
    counts: Counts
    walks: tuple[Walk, ...]


class Task(NamedTuple):
    """One length of the walk."""

    views: int
    config: SparsityConfig


def _count(task: Task) -> Walk:
    return count_walk(task.views, task.config)


def run(config: SparsityConfig, context: RunContext) -> Result:
    """Draw and count."""
    problem, real = real_problem(config)
    walks = tuple(context.map(_count, [Task(v, config) for v in config.views], "bundle-sparsity"))
    study = Study(config, arrow(problem, real, config), count_orders(problem, config), walks)
    arrays = {
        "H": study.arrow.H,
        "sees": study.arrow.sees,
        **{name: np.array([getattr(w, name) for w in walks]) for name in Walk._fields},
    }
    series = {
        "real": real,
        "views": problem.sizes[0],
        "points": problem.sizes[1],
        "observations": problem.sizes[2],
        "orders": study.counts._asdict(),
        "walks": [w._asdict() for w in walks],
    }
    return Result(series=series, seed=config.seed, runs=len(walks), arrays=arrays, payload=study)


SOURCE = "A§1.3.1"


def claims(result: Result) -> list[Claim]:
    """Judge A's sentence that the sparse structure of the linear equations makes it quick."""
    study: Study = result.payload
    return [_arrow(study), _fill(study), _order(study), _growth(study), _band(study)]


def blocks(arrow: Arrow) -> NDArray[np.bool_]:
    """Which blocks of H hold a number, (V + N, V + N)."""
    V, N = arrow.sees.shape
    edges = np.concatenate([arrow.d * np.arange(V), arrow.d * V + 3 * np.arange(N)])
    return np.add.reduceat(np.add.reduceat(np.abs(arrow.H), edges, axis=0), edges, axis=1) > 0.0


def _arrow(study: Study) -> Claim:
    V, N = study.arrow.sees.shape
    full = blocks(study.arrow)
    views = int(np.sum(full[:V, :V])) - V
    points = int(np.sum(full[V:, V:])) - N
    wrong = int(np.sum(full[:V, V:] != study.arrow.sees))
    return Claim(
        "the-matrix-is-an-arrow",
        SOURCE,
        "Views meet points, where they see them; no view meets another view and no point another point",
        "blocks of J^T J, J differenced: none between two views or two points, and between a view and a "
        "point exactly where there is an observation",
        {
            "between_views": views, "between_points": points, "wrong": wrong,
            "observations": int(study.arrow.sees.sum()), "real": study.arrow.real,
        },
        None,
        None,
        None,
        verdict(views == points == wrong == 0),
    )  # fmt: skip


def _fill(study: Study) -> Claim:
    missing, extra = sum(w.missing for w in study.walks), sum(w.extra for w in study.walks)
    return Claim(
        "two-views-meet-where-they-share-a-point",
        SOURCE,
        "Eliminating the points makes two views meet if and only if they see a point in common",
        "blocks of S in every walk: none missing, none too many",
        {"missing": missing, "extra": extra},
        None,
        None,
        None,
        verdict(missing == extra == 0),
    )


def _order(study: Study) -> Claim:
    c = study.counts
    off = abs(c.points_first / c.predicted - 1.0)
    return Claim(
        "points-first",
        SOURCE,
        "Points first costs what the arrow says; views first fills the matrix",
        f"counted over predicted operations within {PREDICTED:g} of 1; views first costs > {CHEAPER:g} times "
        "as much",
        {
            "predicted": c.predicted,
            "points_first": c.points_first,
            "views_first": c.views_first,
            "dense": c.whole,
        },
        None,
        None,
        None,
        verdict(off < PREDICTED and c.views_first > CHEAPER * c.points_first),
    )


def _doubled(study: Study, total: Array) -> float:
    """Factor of a cost when the longest walk is reached from half of it, by the last two lengths."""
    lengths = np.array([w.views for w in study.walks], dtype=np.float64)
    power = np.log(total[-1] / total[-2]) / np.log(lengths[-1] / lengths[-2])
    return float(2.0**power)


def _growth(study: Study) -> Claim:
    w = study.walks
    cost = {
        "points_and_band": np.array([x.points + x.banded for x in w]),
        "dense_views": np.array([x.dense for x in w]),
        "dense_whole": np.array([x.whole for x in w]),
    }
    factors = {name: _doubled(study, total) for name, total in cost.items()}
    band = LINEAR[0] < factors["points_and_band"] < LINEAR[1]
    return Claim(
        "a-walk-costs-what-it-is-long",
        SOURCE,
        "Along a walk the cost is linear with points first and a band, and cubic for dense matrices",
        f"factor when the walk is twice as long: points and band in {LINEAR}, dense ones > {CUBIC:g}",
        factors,
        None,
        None,
        None,
        verdict(band and factors["dense_views"] > CUBIC and factors["dense_whole"] > CUBIC),
    )


def _band(study: Study) -> Claim:
    w = study.walks[-1]
    inside = 0.5 * w.predicted <= w.banded <= w.predicted
    measured = {
        "predicted": w.predicted,
        "banded": w.banded,
        "file_order": w.shuffled,
        "dense": w.dense,
        "difference": max(x.difference for x in study.walks),
    }
    holds = inside and min(w.shuffled, w.dense) > 5.0 * w.banded and measured["difference"] < SAME
    return Claim(
        "order-makes-the-band",
        "house",
        "Reverse Cuthill-McKee finds the walk's order again: the band costs little and gives the same answer",
        "longest walk: counted within [0.5, 1] of the full band's formula; the file's order and a dense "
        f"matrix cost > 5 times as much; dense and banded solutions agree to {SAME:g}",
        measured,
        None,
        None,
        None,
        verdict(holds),
    )


def figure(result: Result) -> Figure:
    """The arrow, its two factors, the walk's S in two orders, and operations against length."""
    from vslam_ref.plot.bundle_sparsity import sparsity_figure

    study: Study = result.payload
    views = study.config.views[min(1, len(study.config.views) - 1)]
    S, by_rank = views_system(walk(views, study.config))
    return sparsity_figure(
        study.arrow.H,
        study.arrow.points_first,
        study.arrow.views_first,
        study.arrow.d * len(study.arrow.sees),
        (S, S[np.ix_(by_rank, by_rank)]),
        {name: np.array([getattr(w, name) for w in study.walks], dtype=np.float64) for name in Walk._fields},
        real=study.arrow.real,
    )


def quick(config: SparsityConfig) -> SparsityConfig:
    """Shorter walks."""
    return dataclasses.replace(config, views=(15, 30, 60))


EXPERIMENT = Experiment(
    id="bundle-sparsity",
    title="The arrow matrix and its Schur complement",
    source="A, section 1.3.1",
    config_type=SparsityConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
)
