"""Figures 2, 3 and 4 of seed B: three rows of one table, since they show one study.

Implements B fig 2, B fig 3 and B fig 4.

The three experiments of one command share one run of the study: they simulate the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Study
from vslam_ref.experiments.iekf.sentences import claim_ids
from vslam_ref.experiments.iekf.study import (
    QUICK,
    RunArrays,
    StudyConfig,
    StudyResult,
    columns,
    points,
    seeds,
    simulate,
    study_field,
)
from vslam_ref.experiments.iekf.verdicts import StudyArrays, judge

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Runs = Study[dict[str, RunArrays]]


class Shown(NamedTuple):
    """Which of B's figures, and the filters it shows, the main one first."""

    figure: int
    filters: tuple[str, ...]

    @property
    def quantity(self) -> str:
        """Field of the runs: figure 4 shows errors, the others NEES."""
        return "position_error" if self.figure == 4 else "nees"

    @property
    def key(self) -> str:
        """Its name in results."""
        return "error" if self.figure == 4 else "nees"

    def curves(self, study: Runs) -> dict[str, Array]:
        """Per-run curves (runs, time) of the filters that are shown, by ``filter/p0``."""
        data = study.data.items()
        return {k: getattr(r, self.quantity) for k, r in data if k.split("/")[0] in self.filters}


def study_arrays(study: StudyResult) -> StudyArrays:
    """Hand a study to the judge."""
    return StudyArrays(
        time=study.time,
        lap_seconds=study.config.field.lap_seconds,
        runs=study.config.runs,
        nees=study.nees,
        position_error=study.position_error,
    )


def series(study: Runs, shown: Shown) -> dict[str, object]:
    """Means over B's runs and over the population."""
    curves = shown.curves(study)
    return {
        "time": study_field(study.config).times,
        shown.key: {key: x[: study.config.runs].mean(0) for key, x in curves.items()},
        f"{shown.key}_population": {key: x.mean(0) for key, x in curves.items()},
    }


def arrays(study: Runs, shown: Shown) -> Mapping[str, Any]:
    """Per-run curves, in single precision."""
    curves = {f"{shown.key}/{key}": x.astype(np.float32) for key, x in shown.curves(study).items()}
    return curves | {"time": study_field(study.config).times}


def claims(study: Runs, shown: Shown) -> list[Claim]:
    """Judge every statement of B§4.1 about the figure."""
    return judge(study_arrays(columns(study)), claim_ids(shown.figure), study.rng(shown.figure))


def figure(study: Runs, shown: Shown) -> Figure:
    """Draw the figure."""
    from vslam_ref.plot import consistency

    c, rng = study.config, study.rng(100 + shown.figure)
    make = consistency.error_figure if shown.figure == 4 else consistency.nees_figure
    return make(
        study_field(c).times,
        {key: consistency.MeanCurves.from_runs(x, c.runs, rng) for key, x in shown.curves(study).items()},
        shown.filters,
        runs=c.runs,
        population=c.population,
        lap_seconds=c.field.lap_seconds,
        title=f"Figure {shown.figure} of B, drawn again",
    )


def _figure(
    number: int, filters: tuple[str, ...], *, id: str, title: str, source: str
) -> Experiment[StudyConfig]:
    """Return a row of the table."""
    shown = Shown(number, filters)
    return Experiment(
        id=id,
        title=title,
        source=source,
        config_type=StudyConfig,
        simulate=simulate,
        points=points,
        name="/".join,
        seeds=seeds,
        series=partial(series, shown=shown),
        arrays=partial(arrays, shown=shown),
        claims=partial(claims, shown=shown),
        figure=partial(figure, shown=shown),
        about={
            "nees": "NEES of the pose, by filter and initial uncertainty; (runs, times)",
            "error": "position error, metres, by filter and initial uncertainty; (runs, times)",
            "time": "seconds from the start; (times,)",
        },
        quick=QUICK,
    )


EXPERIMENTS = (
    _figure(
        2,
        ("ekf", "ekf-anchored", "ekf-ideal"),
        id="iekf-fig2",
        title="Mean NEES of EKF-SLAM, low and high initial uncertainty",
        source="B 4.1, figure 2",
    ),
    _figure(
        3,
        ("iekf", "ekf-anchored", "ekf"),
        id="iekf-fig3",
        title="Mean NEES of IEKF-SLAM (Carleman lift), low and high initial uncertainty",
        source="B 4.1, figure 3",
    ),
    _figure(
        4,
        ("iekf", "ekf", "ekf-anchored"),
        id="iekf-fig4",
        title="Mean position error of EKF-SLAM and IEKF-SLAM",
        source="B 4.1, figure 4",
    ),
)
