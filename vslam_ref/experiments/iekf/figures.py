"""What figures 2, 3 and 4 have in common: one study, its claims, its pictures.

The three experiments of one command share one run of the study (``RunContext.shared``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.experiments.framework import Claim, Result, RunContext
from vslam_ref.experiments.iekf.judge import StudyArrays, judge
from vslam_ref.experiments.iekf.sentences import claim_ids
from vslam_ref.experiments.iekf.study import StudyConfig, StudyResult, run_study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vslam_ref.plot.consistency import MeanCurves


class Wanted(NamedTuple):
    """Which of B's figures, and the filters it shows, the main one first."""

    figure: int
    filters: tuple[str, ...]


FIGURE_2 = Wanted(2, ("ekf", "ekf-anchored", "ekf-ideal"))
FIGURE_3 = Wanted(3, ("iekf", "ekf-anchored", "ekf"))
FIGURE_4 = Wanted(4, ("iekf", "ekf", "ekf-anchored"))


def shared_study(config: StudyConfig, context: RunContext) -> StudyResult:
    """Run the study, or take the one this command has already run."""
    return context.shared(("iekf-study", config), lambda: run_study(config, context))


def figure_result(config: StudyConfig, context: RunContext, wanted: Wanted) -> Result:
    """Series of B's runs for ``result.json``, per-run arrays, and the whole study for claims and figure."""
    study = shared_study(config, context)
    source = study.position_error if wanted.figure == 4 else study.nees
    name = "error" if wanted.figure == 4 else "nees"
    keys = [key for key in source if key.split("/")[0] in wanted.filters]
    own = {key: source[key][: config.runs].mean(0) for key in keys}
    population = {key: source[key].mean(0) for key in keys}
    series = {"time": study.time, name: own, f"{name}_population": population}
    arrays = {f"{name}/{key}": source[key].astype(np.float32) for key in keys}
    return Result(series, config.seed, config.runs, arrays | {"time": study.time}, study)


def study_arrays(study: StudyResult) -> StudyArrays:
    """Hand a study to the judge."""
    return StudyArrays(
        time=study.time,
        lap_seconds=study.config.field.lap_seconds,
        runs=study.config.runs,
        nees=study.nees,
        position_error=study.position_error,
    )


def figure_claims(result: Result, wanted: Wanted) -> list[Claim]:
    """Judge every statement of B§4.1 about the figure."""
    study: StudyResult = result.payload
    rng = np.random.default_rng([study.config.seed, wanted.figure])
    return judge(study_arrays(study), claim_ids(wanted.figure), rng)


def draw(result: Result, wanted: Wanted) -> Figure:
    """Draw the figure."""
    from vslam_ref.plot import consistency

    study: StudyResult = result.payload
    c = study.config
    source = study.position_error if wanted.figure == 4 else study.nees
    rng = np.random.default_rng([c.seed, 100 + wanted.figure])
    curves: dict[str, MeanCurves] = {
        key: consistency.MeanCurves.from_runs(runs, c.runs, rng)
        for key, runs in source.items()
        if key.split("/")[0] in wanted.filters
    }
    make = consistency.error_figure if wanted.figure == 4 else consistency.nees_figure
    return make(
        study.time,
        curves,
        wanted.filters,
        runs=c.runs,
        population=c.population,
        lap_seconds=c.field.lap_seconds,
        title=f"Figure {wanted.figure} of B, drawn again",
    )
