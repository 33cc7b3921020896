"""Calibration: Levenberg-Marquardt over all poses of the board and the intrinsics together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.estimation.calibration.board import BoardCorners, stack
from vslam_ref.estimation.calibration.board_directions import regular_point
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.estimation.calibration.problem import CalibrationIterate, CalibrationProblem
from vslam_ref.estimation.calibration.result import Calibration, Certainty, certainty
from vslam_ref.estimation.calibration.start import Start, find_start, state_of
from vslam_ref.estimation.calibration.weakness import counts_as_one, sensor_causes
from vslam_ref.estimation.least_squares import Descent, Options, descend
from vslam_ref.estimation.least_squares.result import CONVERGED
from vslam_ref.estimation.robust import L2, Loss
from vslam_ref.geometry.cameras import MODELS

STEP = 1e-12
"""End when a step is at most this share of the Jacobian's columns: 1e-12 of a pixel for a residual of 1."""


def calibrate(
    views: Sequence[tuple[ArrayLike, ArrayLike]],
    size: tuple[int, int],
    model: str = "radtan",
    *,
    fixed: Mapping[str, float] | None = None,
    aspect: float | None = None,
    start: Start | None = None,
    loss: Loss | None = None,
    max_iterations: int = 300,
) -> Calibration:
    """Camera, and the board's pose in each view, from corners of a flat board.

    Minimises :eq:`eq-calibration-cost`.

    Parameters
    ----------
    views : sequence of (X_board, uv)
        For each image the corners on the board (N, 3), z = 0, and in the image (N, 2), pixels.
    size : (int, int)
        Width and height of the images, pixels.
    model : str
        A name of :data:`~vslam_ref.geometry.cameras.MODELS`.
    fixed : mapping of str to float, optional
        Intrinsics that are known, as ``{"k3": 0.0}``.
    aspect : float, optional
        fy / fx, if it is known.
    start : Start, optional
        Where to begin; by default :func:`.start.find_start`.
    loss : Loss, optional
        Robust loss of a corner's distance, in pixels.
    max_iterations : int
        Steps tried at most.

    Returns
    -------
    Calibration
        ``reason`` says why it ended, ``undetermined`` what the corners leave open.

    Raises
    ------
    ValueError
        On bad views, a size below 1, an unknown model or parameter, fewer views than the sensor's free
        numbers need, a start whose camera does not see the corners, or corners that are no image of a board.

    Notes
    -----
    Cost of an iteration: one projection of each corner with Jacobians, V factorisations of 6 x 6, and one of
    m x m for m free intrinsics.

    Examples
    --------
    >>> from vslam_ref.estimation.calibration import Board
    >>> from vslam_ref.geometry import se3
    >>> from vslam_ref.geometry.cameras import Radtan
    >>> truth = Radtan(fx=500, fy=505, cx=322, cy=238, k1=-0.2, k2=0.05, p1=1e-3, p2=-5e-4)
    >>> board = Board(9, 6, 0.03)
    >>> turns = [[0.4, 0, 0], [-0.5, 0, 0.1], [0, 0.5, 0], [0, -0.4, 0], [0.3, 0.4, 0], [-0.3, 0.3, 0.2]]
    >>> T = se3.exp([[-0.1, -0.08, 0.4, *turn] for turn in turns])
    >>> found = calibrate([(board.points, truth.pixel_from_world(P, board.points).uv) for P in T], (640, 480))
    >>> found.converged, bool(np.abs(found.camera.params - truth.params).max() < 1e-6)
    (True, True)
    """
    if model not in MODELS:
        raise ValueError(f"model={model!r}: must be one of {', '.join(MODELS)}")
    if len(size) != 2 or min(size) < 1:
        raise ValueError(f"size={size}: need (width, height), both at least 1")
    corners = stack(views)
    free = Free(MODELS[model], fixed or {}, aspect)
    _enough(corners, free)
    start = start or find_start(corners, size, free)
    _fits(start, corners, free)
    problem = CalibrationProblem(corners, free, loss or L2())
    here = problem.linearise(state_of(start, free))
    if here is None:
        raise ValueError("start: its camera does not see every corner at these poses")
    # the cost of a fit without errors goes to zero, and no share of it is small: only rounding ends it
    end = descend(problem, here, Options(step=STEP, cost=0.0, max_iterations=max_iterations))
    return _result(corners, size, free, start, end)


def _result(
    corners: BoardCorners, size: tuple[int, int], free: Free, start: Start, end: Descent[CalibrationIterate]
) -> Calibration:
    sure = certainty(end.here, free)
    return Calibration(
        camera=free.model.from_params(end.here.state.params),
        T_cam_board=end.here.state.T_cam_board,
        corners=corners,
        residual=end.here.residual,
        weights=end.here.weights,
        sigma_px=sure.sigma_px,
        covariance=sure.covariance,
        undetermined=_undetermined(corners, size, free, sure, ended=end.reason in CONVERGED),
        free=free,
        start=start,
        reason=end.reason,
        message=end.message,
        iterations=len(end.history),
        history=end.history,
    )


def _undetermined(
    corners: BoardCorners, size: tuple[int, int], free: Free, sure: Certainty, *, ended: bool
) -> str:
    """What is open, and why; judged where the sensor is a usual one if the fit found no minimum."""
    if ended and not sure.undetermined:
        return ""
    regular = regular_point(corners, size, free)
    if regular is None:
        return sure.undetermined
    there = certainty(regular.point, free).undetermined
    if not ended and not there and counts_as_one(regular.boards, corners, free):
        there = "fx, fy, cx, cy"
    if not ended and not there:
        return ""
    what = sure.undetermined if ended else f"{there} (at a usual focal length; the search found no best one)"
    return "; ".join([what, *sensor_causes(corners, regular.boards, free)])


def _enough(corners: BoardCorners, free: Free) -> None:
    """Refuse fewer views than a sensor without distortion needs: each gives two equations."""
    wanted = [name for name in free.names if name in ("fx", "fy", "cx", "cy")]
    if 2 * corners.views < len(wanted):
        raise ValueError(
            f"{corners.views} view(s) of a flat board give {2 * corners.views} equations for {len(wanted)} "
            f"unknowns ({', '.join(wanted)}); need at least {math.ceil(len(wanted) / 2)} views"
        )
    unknowns = 6 * corners.views + len(free.names)
    if 2 * len(corners.uv) < unknowns:
        raise ValueError(f"{len(corners.uv)} corners give two numbers each, for {unknowns} unknowns")


def _fits(start: Start, corners: BoardCorners, free: Free) -> None:
    if type(start.camera) is not free.model:
        raise ValueError(f"start: its camera is a {type(start.camera).__name__}, not a {free.model.__name__}")
    if np.shape(start.T_cam_board) != (corners.views, 4, 4):
        raise ValueError(
            f"start: T_cam_board has shape {np.shape(start.T_cam_board)}; need ({corners.views}, 4, 4)"
        )
