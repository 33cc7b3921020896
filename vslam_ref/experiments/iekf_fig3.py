"""Figure 3 of seed B: Mean NEES of IEKF-SLAM (Carleman lift), low and high initial uncertainty.

Implements B fig 3.
"""

from __future__ import annotations

from functools import partial

from vslam_ref.experiments.framework import Experiment
from vslam_ref.experiments.iekf.figures import FIGURE_3, draw, figure_claims, figure_result
from vslam_ref.experiments.iekf.study import StudyConfig, quick

EXPERIMENT = Experiment(
    id="iekf-fig3",
    title="Mean NEES of IEKF-SLAM (Carleman lift), low and high initial uncertainty",
    source="B 4.1, figure 3",
    config_type=StudyConfig,
    run=partial(figure_result, wanted=FIGURE_3),
    claims=partial(figure_claims, wanted=FIGURE_3),
    figure=partial(draw, wanted=FIGURE_3),
    quick=quick,
)
