"""Figure 2 of seed B: Mean NEES of EKF-SLAM, low and high initial uncertainty.

Implements B fig 2.
"""

from __future__ import annotations

from functools import partial

from vslam_ref.experiments.framework import Experiment
from vslam_ref.experiments.iekf.figures import FIGURE_2, draw, figure_claims, figure_result
from vslam_ref.experiments.iekf.study import StudyConfig, quick

EXPERIMENT = Experiment(
    id="iekf-fig2",
    title="Mean NEES of EKF-SLAM, low and high initial uncertainty",
    source="B 4.1, figure 2",
    config_type=StudyConfig,
    run=partial(figure_result, wanted=FIGURE_2),
    claims=partial(figure_claims, wanted=FIGURE_2),
    figure=partial(draw, wanted=FIGURE_2),
    quick=quick,
)
