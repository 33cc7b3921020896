"""Near-pure rotation: a map is made by moving sideways, then the camera turns to what it has never seen.

The camera turns about a point ``arm`` metres behind its lens, as on a tripod (0), a wrist, or an outstretched
arm.  The base line that new points can be triangulated from is the arm's; their rays need a parallax.  So an
arm of 0 gives no new points, and when the old ones have left the picture, the camera is lost::

    sideways -> map -> turn, arm 0      -> old points leave -> lost before one field of view
                    -> turn, arm 0.4 m  -> new points -> goes on

And a camera that only turns must not start at all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.experiments.framework import Experiment, Study
from vslam_ref.experiments.ptam.turning_claims import claims, field_of_view
from vslam_ref.experiments.ptam.turning_runs import TurningConfig, TurningRun, simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def series(study: Study[TurningRun]) -> dict[str, object]:
    """Angles, points and shares by arm."""
    return {"arms": study.config.arms, "field_of_view": field_of_view()} | {
        name: np.asarray(getattr(study.data, name))
        for name in ("lost_at", "points", "keyframes", "wander", "share")
    }


def figure(study: Study[TurningRun]) -> Figure:
    """Angle of the last pose, and points added, over the arm."""
    from vslam_ref.plot.tracking_studies import turning_figure

    reached = np.where(np.isnan(study.data.lost_at), study.config.turn, study.data.lost_at)
    reached = np.where(study.data.started, reached, np.nan)
    return turning_figure(
        np.asarray(study.config.arms),
        reached,
        np.asarray(study.data.points),
        field_of_view(),
        study.config.turn,
    )


EXPERIMENT = Experiment(
    id="ptam-rotation",
    title="A camera that turns on the spot, and one that turns on an arm",
    source="A, section 1.3.3",
    config_type=TurningConfig,
    simulate=simulate,
    points=lambda config: config.arms,
    series=series,
    claims=claims,
    figure=figure,
    about={
        "lost_at": "degrees turned at the last pose, NaN if it came through; (arms, runs)",
        "points": "points outside of all pictures from before the turn; (arms, runs)",
        "wander": "largest error of the camera's place in the turn, m; (arms, runs)",
        "keyframes": "keyframes that the turn added; (arms, runs)",
        "share": "of the turn's pictures, with a pose; (arms, runs)",
        "started": "whether there was a map before the turn; (arms, runs)",
        "alone": "whether the turn alone made a map; (arms, runs)",
        "reason": "why the turn alone made none; (arms, runs)",
    },
    quick={"runs": 1, "arms": (0.0, 0.4), "turning": 60, "turn": 80.0, "moving": 40},
)
