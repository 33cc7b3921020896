"""The step of PTAM's calibrator: a tenth of a damped Gauss-Newton step, one for each frame shown.

PTAM adds the identity to J^T J and multiplies the step by 0.1, "because highly nonlinear".  Near the minimum
nine tenths of the error remain after each step, so the error falls like 0.9^n: slowly, but in front of the
user's eyes, thirty times a second.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.estimation.calibration.arrow import ArrowVector, damped_step
from vslam_ref.estimation.calibration.problem import CalibrationIterate, CalibrationProblem, CalibrationState

SHARE = 0.1
"""Of the step that is taken."""
PRIOR = 1.0
"""What is added to the diagonal of J^T J."""


def ptam_step(
    problem: CalibrationProblem, here: CalibrationIterate, size: tuple[int, int]
) -> CalibrationState:
    """State after one step.

    Implements :eq:`eq-ptam-step`.

    Parameters
    ----------
    problem : CalibrationProblem
        PTAM's own has the FOV lens; any other works too.
    here : CalibrationIterate
        The problem at the state before.
    size : (int, int)
        Width and height of the images, pixels.

    Raises
    ------
    ValueError
        Where the equations are singular.

    Notes
    -----
    PTAM's focal lengths and centre are relative to the image's width and height.  A prior of 1 on them is one
    of 1/width^2 on pixels: weak.  A prior of 1 on *pixels* would be none of PTAM's, and not weak at all.
    """
    width, height = size
    unit = {"fx": 1 / width, "fy": 1 / height, "cx": 1 / width, "cy": 1 / height}
    scale = np.array([unit.get(name, 1.0) for name in problem.free.names])
    step = damped_step(here.normal, PRIOR, ArrowVector(np.ones_like(here.normal.g_pose), scale))
    if step is None:
        raise ValueError("the normal equations are singular")
    return problem.plus(here.state, ArrowVector(SHARE * step.pose, SHARE * step.free))  # eq-ptam-step
