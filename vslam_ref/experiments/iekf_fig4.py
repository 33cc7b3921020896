"""Figure 4 of seed B: Mean position error of EKF-SLAM and IEKF-SLAM.

Implements B fig 4.
"""

from __future__ import annotations

from functools import partial

from vslam_ref.experiments.framework import Experiment
from vslam_ref.experiments.iekf.figures import FIGURE_4, draw, figure_claims, figure_result
from vslam_ref.experiments.iekf.study import StudyConfig, quick

EXPERIMENT = Experiment(
    id="iekf-fig4",
    title="Mean position error of EKF-SLAM and IEKF-SLAM",
    source="B 4.1, figure 4",
    config_type=StudyConfig,
    run=partial(figure_result, wanted=FIGURE_4),
    claims=partial(figure_claims, wanted=FIGURE_4),
    figure=partial(draw, wanted=FIGURE_4),
    quick=quick,
)
