"""Where the statements of B 4.1 hold, and where they stop: a map over the settings that B leaves open.

The baseline is the study of figures 2-4.  One setting at a time is changed: noises, range, number and layout
of the landmarks, the heading's initial variance; two columns change nothing but the draw of the noises, so
that the map shows what chance does.  At every setting all statements are judged by their own rules, with
thresholds and null rates from that setting's own consistent control.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext
from vslam_ref.experiments.iekf.grid import (
    AXES,
    NUMERIC,
    SensitivityConfig,
    baseline_value,
    grid_with_runs,
    quick_grid,
    settings_of,
)
from vslam_ref.experiments.iekf.grid_rules import mechanism_claims, statement_claim
from vslam_ref.experiments.iekf.sensitivity import Grid, judge_setting, map_series
from vslam_ref.experiments.iekf.sentences import SENTENCES

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def run(config: SensitivityConfig, context: RunContext) -> Result:
    """Run and judge every setting, each in one task."""
    judged = context.map(judge_setting, settings_of(config), "settings")
    ends = {
        f"nees_end/{j.setting.name}/{key}": values for j in judged for key, values in j.end.items()
    }  # one number per run: its NEES averaged over 150-160 s
    return Result(
        series=map_series(judged),
        seed=config.study.seed,
        runs=config.study.runs,
        arrays=ends,
        payload=(config, Grid(tuple(judged))),
    )


def claims(result: Result) -> list[Claim]:
    """Judge the mechanisms, then each statement over the whole grid."""
    config, grid = result.payload
    baseline_at = {axis: baseline_value(config, axis) for axis in NUMERIC}
    rng = np.random.default_rng([config.study.seed, 5])
    return [
        *mechanism_claims(grid, baseline_at, rng),
        *(statement_claim(s, grid) for s in SENTENCES.values()),
    ]


def figure(result: Result) -> Figure:
    """Draw the map."""
    from vslam_ref.plot.sensitivity import VerdictMap, map_figure

    config, grid = result.payload
    return map_figure(
        VerdictMap(
            rows=[(f"figure {s.figure}", s.id) for s in SENTENCES.values()],
            columns=[(AXES[j.setting.axis], j.setting.label) for j in grid.judged],
            verdict=[[j.claims[i].verdict for j in grid.judged] for i in SENTENCES],
            share=[[j.claims[i].share for j in grid.judged] for i in SENTENCES],
        ),
        {key: [float(j.end[key].mean()) for j in grid.judged] for key in grid.baseline.end},
        runs=config.study.runs,
        population=config.study.population,
    )


EXPERIMENT = Experiment(
    id="iekf-sensitivity",
    title="Where the claims of figures 2-4 hold and where they stop",
    source="B 4.1; settings that B leaves open",
    config_type=SensitivityConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick_grid,
    with_runs=grid_with_runs,
)
