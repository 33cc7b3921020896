"""Where the statements of B 4.1 hold, and where they stop: a map over the settings that B leaves open.

The baseline is the study of figures 2-4.  One setting at a time is changed: noises, range, number and layout
of the landmarks, the heading's initial variance; two columns change nothing but the draw of the noises, so
that the map shows what chance does.  At every setting all statements are judged by their own rules, with
thresholds and null rates from that setting's own consistent control.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Study
from vslam_ref.experiments.iekf.grid import (
    AXES,
    NUMERIC,
    QUICK,
    SensitivityConfig,
    baseline_value,
    grid_with_runs,
    settings_of,
)
from vslam_ref.experiments.iekf.grid_rules import mechanism_claims, statement_claim
from vslam_ref.experiments.iekf.sentences import SENTENCES
from vslam_ref.experiments.iekf.settings import Grid, Verdicts, grid_of, map_series, simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Map = Study[dict[str, Verdicts]]


def arrays(study: Map) -> dict[str, Array]:
    """One number per run: its NEES averaged over 150-160 s."""
    return {
        f"nees_end/{j.setting.name}/{key}": values
        for j in grid_of(study).judged
        for key, values in j.end.items()
    }


def claims(study: Map) -> list[Claim]:
    """Judge the mechanisms, then each statement over the whole grid."""
    grid = grid_of(study)
    baseline_at = {axis: baseline_value(study.config, axis) for axis in NUMERIC}
    return [
        *mechanism_claims(grid, baseline_at, study.rng(5)),
        *(statement_claim(s, grid) for s in SENTENCES.values()),
    ]


def draw(grid: Grid) -> Figure:
    """Draw the map."""
    from vslam_ref.plot.sensitivity import VerdictMap, map_figure

    base = grid.baseline.setting.study
    return map_figure(
        VerdictMap(
            rows=[(f"figure {s.figure}", s.id) for s in SENTENCES.values()],
            columns=[(AXES[j.setting.axis], j.setting.label) for j in grid.judged],
            verdict=[[j.claims[i].verdict for j in grid.judged] for i in SENTENCES],
            share=[[j.claims[i].share for j in grid.judged] for i in SENTENCES],
        ),
        {key: [float(j.end[key].mean()) for j in grid.judged] for key in grid.baseline.end},
        runs=base.runs,
        population=base.population,
    )


EXPERIMENT = Experiment(
    id="iekf-sensitivity",
    title="Where the claims of figures 2-4 hold and where they stop",
    source="B 4.1; settings that B leaves open",
    config_type=SensitivityConfig,
    simulate=simulate,
    points=settings_of,
    name=lambda setting: setting.name,
    seeds=lambda config, setting: [None],
    series=lambda study: map_series(grid_of(study).judged),
    arrays=arrays,
    claims=claims,
    figure=lambda study: draw(grid_of(study)),
    about={"nees_end": "NEES averaged over 150-160 s, by setting, filter and initial uncertainty; (runs,)"},
    quick=QUICK,
    with_runs=grid_with_runs,
)
