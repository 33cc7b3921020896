"""The step of PTAM's calibrator: a tenth of a damped Gauss-Newton step, one for each frame shown.

PTAM adds the identity to J^T J and multiplies the step by 0.1, "because highly nonlinear".  Near the minimum
nine tenths of the error remain after each step, so the error falls like 0.9^n: slowly, but in front of the
user's eyes, thirty times a second.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.estimation.calibration.arrow import Blocks, damped_step
from vslam_ref.estimation.calibration.problem import Point, Problem, State

SHARE = 0.1
"""Of the step that is taken."""
PRIOR = 1.0
"""What is added to the diagonal of J^T J."""


def ptam_step(problem: Problem, here: Point) -> State:
    """State after one step.

    Implements :eq:`eq-ptam-step`.

    Parameters
    ----------
    problem : Problem
    here : Point
        The problem at the state before.

    Raises
    ------
    ValueError
        Where the equations are singular.

    Notes
    -----
    PTAM's intrinsics are relative to the image's size, so that its unit prior weighs them otherwise: there
    it adds 1 to a diagonal that is larger by the squared width.  Both are weak.
    """
    views, free = here.normal.g_pose.shape[0], len(here.normal.g_free)
    step = damped_step(here.normal, PRIOR, Blocks(np.ones((views, 6)), np.ones(free)))
    if step is None:
        raise ValueError("the normal equations are singular")
    return problem.plus(here.state, SHARE * step.pose, SHARE * step.free)
