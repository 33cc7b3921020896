"""Calibration in spite of some wrong corners: a robust loss whose scale comes from the corners themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.estimation.calibration.result import Calibration
from vslam_ref.estimation.calibration.solver import calibrate
from vslam_ref.estimation.calibration.start import Start
from vslam_ref.estimation.robust import norm_scale, tuned

ROUNDS = 20
SETTLED = 1e-3
"""The scale has settled when it changes by less than this share; it is known to 1/sqrt(2M), some per cent."""


class RobustCalibration(NamedTuple):
    """The calibration, the scale of one coordinate in pixels, and which corners (M,) weigh nothing."""

    calibration: Calibration
    scale_px: float
    ignored: np.ndarray
    rounds: int


def calibrate_robustly(
    views: Sequence[tuple[ArrayLike, ArrayLike]],
    size: tuple[int, int],
    model: str = "radtan",
    loss: str = "tukey",
    *,
    fixed: Mapping[str, float] | None = None,
    aspect: float | None = None,
) -> RobustCalibration:
    """Calibrate by least squares, then again and again with a robust loss at the scale of the residuals.

    Parameters
    ----------
    views : sequence of (X_board, uv)
        As for :func:`.solver.calibrate`: corners (N, 3) or (N, 2) in the board's unit, and where they were
        found (N, 2), pixels.
    size : (int, int)
        Width and height of the images, pixels.
    model : str
        The camera's model, as for :func:`.solver.calibrate`.
    loss : str
        A name of :data:`~vslam_ref.estimation.robust.losses.LOSSES`, tuned to 95 % for plane errors.
    fixed, aspect : mapping, float, optional
        As for :func:`.solver.calibrate`.

    Returns
    -------
    RobustCalibration
        Where the scale is not finite or zero, because there is no redundancy or the fit is exact, the plain
        least squares.

    Raises
    ------
    ValueError
        As :func:`.solver.calibrate`, and on an unknown loss.

    Notes
    -----
    The scale is 0.849 times the median distance, corrected for the fitted parameters.  It stands still while
    a loss is minimised; in between it is taken anew.  The start is least squares, so a few
    corners in a hundred may be wrong, not the half.
    """
    unit = tuned(loss, 2)
    result = calibrate(views, size, model, fixed=fixed, aspect=aspect)
    unknowns = 6 * result.corners.views + len(result.free.names)
    scale, rounds = norm_scale(result.residual, parameters=unknowns).sigma, 0
    while rounds < ROUNDS and np.isfinite(scale) and scale > 0.0:
        start = Start(result.camera, result.T_cam_board, result.rms_px)
        result = calibrate(
            views, size, model, fixed=fixed, aspect=aspect, start=start, loss=unit.scaled(scale)
        )
        rounds += 1
        before, scale = scale, norm_scale(result.residual, parameters=unknowns).sigma
        if abs(scale - before) <= SETTLED * before:
            break
    return RobustCalibration(result, scale, result.weights == 0.0, rounds)
