"""The arrow matrix of bundle adjustment and its Schur complement, drawn from a real problem, and counted.

A real problem (BAL, 16 views and 22106 points; a simulation where it is not found) gives the arrow: the
normal matrix of all its views and forty of its points, differenced column by column, so that every zero is
measured.
A camera that walks along a wall, its pictures shuffled, gives the band.  Costs are multiplications counted on
the factors of a sparse solver that knows nothing of views and points.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.experiments.bundle.counts import (
    DrawnSystem,
    OperationCounts,
    SparsityConfig,
    Walk,
    arrow,
    count_orders,
    real_problem,
    simulate,
    views_system,
    walk,
)
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged

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


class DrawnProblem(NamedTuple):
    """What is drawn and counted of the one problem: sizes are views, points and observations."""

    sizes: tuple[int, int, int]
    arrow: DrawnSystem
    counts: OperationCounts


def drawn(config: SparsityConfig) -> DrawnProblem:
    """Draw and count."""
    problem, real = real_problem(config)
    return DrawnProblem(problem.sizes, arrow(problem, real, config), count_orders(problem, config))


def walks(study: Study[Walk]) -> Walk:
    """All counts of the walks, each field (walks,)."""
    return Walk(*(column[:, 0] for column in study.data))


def series(study: Study[Walk]) -> dict[str, object]:
    """Sizes and counts."""
    rows = zip(*(column.tolist() for column in walks(study)), strict=True)
    return {
        "real": study.once.arrow.real,
        **dict(zip(("views", "points", "observations"), study.once.sizes, strict=True)),
        "orders": study.once.counts._asdict(),
        "walks": [Walk(*row)._asdict() for row in rows],
    }


SOURCE = "A§1.3.1"


def claims(study: Study[Walk]) -> list[Claim]:
    """Judge A's sentence that the sparse structure of the linear equations makes it quick."""
    w = walks(study)
    return [_arrow(study.once.arrow), _fill(w), _order(study.once.counts), _growth(w), _band(w)]


def blocks(arrow: DrawnSystem) -> NDArray[np.bool_]:
    """Which blocks of H hold a number, (V + N, V + N)."""
    V, N = arrow.sees.shape
    edges = np.concatenate([arrow.d * np.arange(V), arrow.d * V + 3 * np.arange(N)])
    return np.add.reduceat(np.add.reduceat(np.abs(arrow.H), edges, axis=0), edges, axis=1) > 0.0


def _arrow(arrow: DrawnSystem) -> Claim:
    V, N = arrow.sees.shape
    full = blocks(arrow)
    views = int(np.sum(full[:V, :V])) - V
    points = int(np.sum(full[V:, V:])) - N
    wrong = int(np.sum(full[:V, V:] != arrow.sees))
    return judged(
        "the-matrix-is-an-arrow",
        SOURCE,
        "Views meet points, where they see them; no view meets another view and no point another point",
        "blocks of J^T J, J differenced: none between two views or two points, and between a view and a "
        "point exactly where there is an observation",
        views == points == wrong == 0,
        f"Of the matrix of {V} views and {N} points {views} blocks lie between two views, {points} between "
        "two points, "
        f"and {wrong} are not where an observation is",
        {
            "between_views": views, "between_points": points, "wrong": wrong,
            "observations": int(arrow.sees.sum()), "real": arrow.real,
        },
    )  # fmt: skip


def _fill(w: Walk) -> Claim:
    missing, extra = int(np.sum(w.missing)), int(np.sum(w.extra))
    return judged(
        "two-views-meet-where-they-share-a-point",
        SOURCE,
        "Eliminating the points makes two views meet if and only if they see a point in common",
        "blocks of S in every walk: none missing, none too many",
        missing == extra == 0,
        f"In all walks {missing} blocks of S are missing and {extra} are too many",
        {"missing": missing, "extra": extra},
    )


def _order(c: OperationCounts) -> Claim:
    off = abs(c.points_first / c.predicted - 1.0)
    return judged(
        "points-first",
        SOURCE,
        "Points first costs what the arrow says; views first fills the matrix",
        f"counted over predicted operations within {PREDICTED:g} of 1; views first costs > {CHEAPER:g} times "
        "as much",
        off < PREDICTED and c.views_first > CHEAPER * c.points_first,
        f"Points first takes {c.points_first:.3g} multiplications, as predicted to {off:.0e}; views first "
        "takes "
        f"{c.views_first / c.points_first:.3g} times as many, and more than {CHEAPER:g} times is asked for",
        {
            "predicted": c.predicted,
            "points_first": c.points_first,
            "views_first": c.views_first,
            "dense": c.whole,
        },
    )


def _doubled(w: Walk, total: Array) -> float:
    """Factor of a cost when the longest walk is reached from half of it, by the last two lengths."""
    lengths = np.asarray(w.views, dtype=np.float64)
    power = np.log(total[-1] / total[-2]) / np.log(lengths[-1] / lengths[-2])
    return float(2.0**power)


def _growth(w: Walk) -> Claim:
    cost = {"points_and_band": w.points + w.banded, "dense_views": w.dense, "dense_whole": w.whole}
    factors = {name: _doubled(w, np.asarray(total)) for name, total in cost.items()}
    band, views, whole = factors.values()
    return judged(
        "a-walk-costs-what-it-is-long",
        SOURCE,
        "Along a walk the cost is linear with points first and a band, and cubic for dense matrices",
        f"factor when the walk is twice as long: points and band in {LINEAR}, dense ones > {CUBIC:g}",
        LINEAR[0] < band < LINEAR[1] and views > CUBIC and whole > CUBIC,
        f"A walk of twice the length costs {band:.2f} times as much with points first and a band, and "
        f"{views:.2f} and "
        f"{whole:.2f} times with dense matrices; linear is 2, cubic 8",
        factors,
    )


def _band(walks: Walk) -> Claim:
    w = Walk(*(column[-1] for column in walks))
    difference = float(np.max(walks.difference))
    inside = 0.5 * w.predicted <= w.banded <= w.predicted
    dearer = min(w.shuffled, w.dense) / w.banded
    return judged(
        "order-makes-the-band",
        "house",
        "Reverse Cuthill-McKee finds the walk's order again: the band costs little and gives the same answer",
        "longest walk: counted within [0.5, 1] of the full band's formula; the file's order and a dense "
        f"matrix cost > 5 times as much; dense and banded solutions agree to {SAME:g}",
        bool(inside and dearer > 5.0 and difference < SAME),
        f"The band takes {w.banded / w.predicted:.2f} of what a full band would; the file's order or a "
        "dense matrix take "
        f"at least {dearer:.3g} times as much, and the solutions agree to {difference:.1e}",
        {
            "predicted": w.predicted,
            "banded": w.banded,
            "file_order": w.shuffled,
            "dense": w.dense,
            "difference": difference,
        },
    )


def arrays(study: Study[Walk]) -> dict[str, object]:
    """The drawn matrix, who sees what in it, and the counts of the walks."""
    return {"H": study.once.arrow.H, "sees": study.once.arrow.sees, **walks(study)._asdict()}


def figure(study: Study[Walk]) -> Figure:
    """The arrow, its two factors, the walk's S in two orders, and operations against length."""
    from vslam_ref.plot.bundle_sparsity import sparsity_figure

    found: DrawnSystem = study.once.arrow
    S, by_rank = views_system(walk(study.config, study.config.views[1]))
    return sparsity_figure(
        found.H,
        found.points_first,
        found.views_first,
        found.d * len(found.sees),
        (S, S[np.ix_(by_rank, by_rank)]),
        {name: np.asarray(column, dtype=np.float64) for name, column in walks(study)._asdict().items()},
        real=found.real,
    )


COUNT = "multiplications and additions: "

EXPERIMENT = Experiment(
    id="bundle-sparsity",
    title="The arrow matrix and its Schur complement",
    source="A, section 1.3.1",
    config_type=SparsityConfig,
    simulate=simulate,
    points=lambda config: config.views,
    seeds=lambda config, views: [None],
    once=drawn,
    sample=lambda study: len(study.config.views),
    series=series,
    arrays=arrays,
    claims=claims,
    figure=figure,
    about={
        "H": "the drawn matrix J^T J, columns of views first; (columns, columns)",
        "sees": "which view sees which point; (views, points)",
        "views": "lengths of the walks; (walks,)",
        "points": COUNT + "for the points alone; (walks,)",
        "dense": COUNT + "S as a dense matrix; (walks,)",
        "banded": COUNT + "S in the package's order; (walks,)",
        "shuffled": COUNT + "S in the file's order; (walks,)",
        "predicted": COUNT + "S in a full band; (walks,)",
        "whole": COUNT + "the dense matrix of all unknowns; (walks,)",
        "difference": "largest relative difference of the dense and the banded solution; (walks,)",
        "missing": "pairs of views that share a point and have no block in S; (walks,)",
        "extra": "pairs of views with a block in S and no point in common; (walks,)",
    },
    quick={"views": (15, 30, 60)},
)
