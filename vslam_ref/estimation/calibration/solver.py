"""Calibration: Levenberg-Marquardt over all poses of the board and the intrinsics together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.estimation.calibration.arrow import Blocks, damped_step, promised
from vslam_ref.estimation.calibration.board import Corners, stack
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.estimation.calibration.problem import Point, Problem
from vslam_ref.estimation.calibration.result import Calibration, certainty
from vslam_ref.estimation.calibration.start import Start, find_start, state_of
from vslam_ref.estimation.least_squares import Iteration, Nielsen
from vslam_ref.estimation.least_squares.result import Reason
from vslam_ref.estimation.robust import L2, Loss
from vslam_ref.geometry.cameras import MODELS

GRADIENT = 1e-10
"""End when the largest cosine between a column of the Jacobian and the residual is at most this."""
STEP = 1e-12
"""End when a step is at most this share of the Jacobian's columns: 1e-12 of a pixel for a residual of 1."""
COST = 1e-14
"""End when actual and promised decrease are at most this share of the cost."""
NOISE = 1e-12
"""A promise below this share of the cost may drown in rounding: then a smaller gradient is enough."""
LEAST_GAIN = 1e-4
"""Share of the promised decrease that a step must bring."""
FLAT = 1e-8
"""A whole step that promises more than this share of the cost and cannot be taken: no minimum."""


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
    problem = Problem(corners, free, loss or L2())
    here = problem.at(state_of(start, free))
    if here is None:
        raise ValueError("start: its camera does not see every corner at these poses")
    end = _descend(problem, here, max_iterations)
    sure = certainty(end.point, free)
    return Calibration(
        camera=free.model.from_params(end.point.state.params),
        T_cam_board=end.point.state.T_cam_board,
        corners=corners,
        residual=end.point.residual,
        weights=end.point.weights,
        sigma_px=sure.sigma_px,
        covariance=sure.covariance,
        undetermined=sure.undetermined,
        free=free,
        start=start,
        reason=end.reason,
        message=end.message,
        iterations=len(end.history),
        history=tuple(end.history),
    )


def _enough(corners: Corners, free: Free) -> None:
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


def _fits(start: Start, corners: Corners, free: Free) -> None:
    if type(start.camera) is not free.model:
        raise ValueError(f"start: its camera is a {type(start.camera).__name__}, not a {free.model.__name__}")
    if np.shape(start.T_cam_board) != (corners.views, 4, 4):
        raise ValueError(
            f"start: T_cam_board has shape {np.shape(start.T_cam_board)}; need ({corners.views}, 4, 4)"
        )


class _End(NamedTuple):
    point: Point
    reason: Reason
    message: str
    history: list[Iteration]


class _Trial(NamedTuple):
    """What became of a step: where it led, or None; its length and gain; a reason to end, or empty."""

    point: Point | None
    length: float
    gain: float
    reason: Reason | None
    message: str = ""


def _descend(problem: Problem, here: Point, max_iterations: int) -> _End:
    """Try steps until a reason to end is found; Nielsen's rule for the damping."""
    rule, history = Nielsen(), list[Iteration]()
    state = rule.first(np.eye(1), np.ones(1))  # columns are scaled to length 1
    while True:
        if here.cosine <= GRADIENT:
            return _End(here, "gradient", f"largest cosine {here.cosine:.3g} <= {GRADIENT:g}", history)
        if len(history) == max_iterations:
            return _End(here, "max_iterations", f"{max_iterations} steps tried", history)
        trial = _try(problem, here, state.value)
        if trial.point is None and trial.reason is not None:
            return _End(here, trial.reason, trial.message, history)
        before, damping = here, state.value
        if trial.point is not None:
            here = trial.point
            state = rule.success(state, 1.0 if math.isnan(trial.gain) else trial.gain)
        else:
            grown = rule.failure(state)
            if grown is None:
                return _End(here, "stalled", f"no step decreases the cost, damping {damping:.3g}", history)
            state = grown
        history.append(
            Iteration(here.cost, damping, trial.length, before.cosine, trial.gain, trial.point is not None)
        )
        if trial.reason is not None:
            return _End(here, trial.reason, trial.message, history)


def _try(problem: Problem, here: Point, damping: float) -> _Trial:
    """Compute one step and judge it by what it won over what the linear model promised."""
    scale = here.normal.lengths()
    step = damped_step(here.normal, damping, scale)
    if step is None:
        return _Trial(None, math.nan, math.nan, None)
    scaled = Blocks(scale.pose * step.pose, scale.free * step.free)
    length, promise = scaled.norm, promised(here.normal, step, damping, scale)
    if length <= STEP * scale.norm and damping <= 1.0:
        return _Trial(None, length, math.nan, "step", f"step {length:.3g} <= {STEP:g} of {scale.norm:.3g}")
    there = problem.plus(here.state, step.pose, step.free)
    if promise <= NOISE * here.cost:
        return _polish(problem, here, scale, length)
    costs = problem.costs(there)
    if costs is None:
        return _Trial(None, length, math.nan, None)
    actual = float((here.costs - costs).sum())
    gain = actual / promise
    return _Trial(problem.at(there) if gain > LEAST_GAIN else None, length, gain, None)


def _polish(problem: Problem, here: Point, scale: Blocks, length: float) -> _Trial:
    """Where a decrease would drown in rounding, go on as long as a whole step halves the gradient."""
    step = damped_step(here.normal, 0.0, scale)
    if step is None:
        return _Trial(None, length, math.nan, "cost", "what a damped step can win is rounding")
    there = problem.at(problem.plus(here.state, step.pose, step.free))
    if there is not None and there.cosine < 0.5 * here.cosine:
        return _Trial(there, length, math.nan, None)
    # does the model promise little, or only its damped step?
    share = promised(here.normal, step, 0.0, scale) / here.cost
    if share > FLAT:
        why = "no step brings it" if there else "its step leaves the camera's invertible field"
        told = f"the model promises {share:.3g} of the cost, but {why}"
        return _Trial(None, length, math.nan, "stalled", told)
    told = f"a whole step promises {share:.3g} of the cost, which is rounding"
    return _Trial(None, length, math.nan, "cost", told)
