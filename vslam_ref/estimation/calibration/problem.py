"""The residual of a calibration, and its Jacobians in the poses of the board and in the intrinsics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.calibration.arrow import Arrow, ArrowVector, arrow, damped_step, promised
from vslam_ref.estimation.calibration.board import BoardCorners
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.estimation.least_squares import Step
from vslam_ref.estimation.robust import Loss
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Lens, projection


class CalibrationState(NamedTuple):
    """What is estimated.

    Attributes
    ----------
    params : ndarray, shape (n,)
        Intrinsics: focal lengths and centre in pixels, distortion dimensionless.
    T_cam_board : ndarray, shape (V, 4, 4)
        The board's pose in each view, translations in the board's unit.
    """

    params: Array
    T_cam_board: Array


class Residual(NamedTuple):
    """Residuals of all corners, and their Jacobians.

    Attributes
    ----------
    residual : ndarray, shape (M, 2)
        Predicted minus measured, pixels; NaN where the camera does not see its corner.
    J_pose : ndarray, shape (M, 2, 6)
        In the left perturbation of the pose of the corner's view.
    J_intrinsics : ndarray, shape (M, 2, n)
    """

    residual: Array
    J_pose: Array
    J_intrinsics: Array

    @property
    def value(self) -> Array:
        """The residual."""
        return self.residual


class CalibrationIterate(NamedTuple):
    """Everything known at one state.

    Attributes
    ----------
    state : CalibrationState
    residual : ndarray, shape (M, 2)
        Predicted minus measured, pixels.
    costs : ndarray, shape (M,)
        rho(|r_j|); half the squared length without a loss.
    weights : ndarray, shape (M,)
        Of the loss; ones without.
    normal : Arrow
        The normal equations.
    scale : ArrowVector
        Metric D of a step: lengths of the Jacobian's columns.
    gradient_norm : float
        Largest cosine between a column of the Jacobian and the residual; 0 for no residual.
    stiffness : float
        1: in the metric D all columns are as long.
    """

    state: CalibrationState
    residual: Array
    costs: Array
    weights: Array
    normal: Arrow
    scale: ArrowVector
    gradient_norm: float
    stiffness: float = 1.0

    @property
    def cost(self) -> float:
        """Sum of the costs."""
        return float(self.costs.sum())


def residual(
    params: ArrayLike, T_cam_board: ArrayLike, X_board: ArrayLike, uv: ArrayLike, *, lens: Lens
) -> Array:
    """Where the corners should be, less where they were found.

    Implements :eq:`eq-calibration-residual`.

    Parameters
    ----------
    params : array_like, shape (n,)
        Intrinsics.
    T_cam_board : array_like, shape (..., 4, 4)
        Pose of the board for each corner.
    X_board : array_like, shape (..., 3)
        Corners, metres.
    uv : array_like, shape (..., 2)
        Measured pixels.
    lens : Lens
        The camera's lens.

    Returns
    -------
    ndarray, shape (..., 2)
        Pixels; NaN where a corner is behind the camera or outside its field.
    """
    seen = projection.pixel_from_world(params, T_cam_board, X_board, lens=lens)
    return np.where(seen.valid[..., None], seen.uv - np.asarray(uv, dtype=np.float64), np.nan)


def residual_with_jacobians(
    params: ArrayLike, T_cam_board: ArrayLike, X_board: ArrayLike, uv: ArrayLike, *, lens: Lens
) -> Residual:
    """:func:`residual`, and its Jacobians in the pose (..., 2, 6) and in all intrinsics (..., 2, n).

    The pose moves by a left perturbation; the measurement is a constant, so both are those of the pixel.
    """
    seen = projection.pixel_from_world_with_jacobians(params, T_cam_board, X_board, lens=lens)
    r = np.where(seen.valid[..., None], seen.uv - np.asarray(uv, dtype=np.float64), np.nan)
    return Residual(r, seen.J_pose, seen.J_intrinsics)


@dataclass(frozen=True)
class CalibrationProblem:
    """Corners, a camera model with its free parameters, and a loss: what a descent asks of a calibration."""

    corners: BoardCorners
    free: Free
    loss: Loss

    def costs(self, state: CalibrationState) -> Array:
        """Cost of each corner (M,); infinite where the camera does not see it.

        Implements :eq:`eq-calibration-cost`, term by term.
        """
        c = self.corners
        r = residual(state.params, state.T_cam_board[c.view], c.X_board, c.uv, lens=self.free.model.lens)
        length = np.linalg.norm(r, axis=1)
        return np.where(np.isfinite(length), self.loss.cost(length), np.inf)

    def linearise(
        self, state: CalibrationState, before: CalibrationIterate | None = None
    ) -> CalibrationIterate | None:
        """Costs and normal equations, or None where the state is no camera that sees all corners."""
        if not self._is_camera(state):
            return None
        c = self.corners
        r, J_pose, J_intrinsics = residual_with_jacobians(
            state.params, state.T_cam_board[c.view], c.X_board, c.uv, lens=self.free.model.lens
        )
        if not (np.isfinite(r).all() and np.isfinite(J_intrinsics).all()):
            return None
        length = np.linalg.norm(r, axis=1)
        weights = self.loss.weight(length)
        normal = arrow(J_pose, J_intrinsics @ self.free.basis, r, weights, c.first)
        scale, size = normal.lengths(), float(np.sqrt(weights @ length**2))
        slopes = (normal.g_pose / scale.pose, normal.g_free / scale.free)
        slope = max(float(np.abs(g).max(initial=0.0)) for g in slopes) / size if size > 0 else 0.0
        return CalibrationIterate(state, r, self.loss.cost(length), weights, normal, scale, slope)

    def step(self, here: CalibrationIterate, damping: float) -> Step | None:
        """Damped step of poses and intrinsics, by elimination of the poses."""
        change = damped_step(here.normal, damping, here.scale)
        if change is None:
            return None
        length = ArrowVector(here.scale.pose * change.pose, here.scale.free * change.free).norm
        promise = promised(here.normal, change, damping, here.scale)
        return Step(change, length, promise, length / here.scale.norm)

    def move(self, here: CalibrationIterate, step: Step) -> CalibrationState | None:
        """State after a step; None where its intrinsics make no camera."""
        there = self.plus(here.state, step.change)
        return there if self._is_camera(there) else None

    def plus(self, state: CalibrationState, change: ArrowVector) -> CalibrationState:
        """Step: T <- Exp(xi) T for each pose, and a sum for the intrinsics."""
        T = se3.perturb(state.T_cam_board, change.pose)
        return CalibrationState(state.params + self.free.basis @ change.free, T)

    def _is_camera(self, state: CalibrationState) -> bool:
        try:
            self.free.model.from_params(state.params)
        except ValueError:
            return False
        return True
