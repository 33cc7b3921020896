"""The residual of a calibration, and its Jacobians in the poses of the board and in the intrinsics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.calibration.arrow import Arrow, arrow
from vslam_ref.estimation.calibration.board import Corners
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.estimation.robust import Loss
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Lens, projection


class State(NamedTuple):
    """What is estimated: intrinsics (n,), and the board's pose in each view, T_cam_board (V, 4, 4)."""

    params: Array
    T_cam_board: Array


class Residual(NamedTuple):
    """Predicted minus measured pixels (M, 2), NaN where the camera does not see its corner; Jacobians."""

    residual: Array
    J_pose: Array
    J_intrinsics: Array

    @property
    def value(self) -> Array:
        """The residual."""
        return self.residual


class Point(NamedTuple):
    """Everything known at one state.

    Attributes
    ----------
    state : State
    residual : ndarray, shape (M, 2)
        Predicted minus measured, pixels.
    costs : ndarray, shape (M,)
        rho(|r_j|); half the squared length without a loss.
    weights : ndarray, shape (M,)
        Of the loss; ones without.
    normal : Arrow
        The normal equations.
    """

    state: State
    residual: Array
    costs: Array
    weights: Array
    normal: Arrow

    @property
    def cost(self) -> float:
        """Sum of the costs."""
        return float(self.costs.sum())

    @property
    def cosine(self) -> float:
        """Largest cosine between a column of the Jacobian and the residual; 0 for no residual."""
        length = float(np.sqrt((self.weights * (self.residual**2).sum(-1)).sum()))
        scale = self.normal.lengths()
        slope = max(
            float(np.abs(self.normal.g_pose / scale.pose).max(initial=0.0)),
            float(np.abs(self.normal.g_free / scale.free).max(initial=0.0)),
        )
        return slope / length if length > 0 else 0.0


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
        Corners.
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
class Problem:
    """Corners, a camera model with its free parameters, and a loss."""

    corners: Corners
    free: Free
    loss: Loss

    def costs(self, state: State) -> Array | None:
        """Cost of each corner (M,), or None where the state is no camera that sees them all."""
        if not self._is_camera(state):
            return None
        c = self.corners
        r = residual(state.params, state.T_cam_board[c.view], c.X_board, c.uv, lens=self.free.model.lens)
        return self.loss.cost(np.linalg.norm(r, axis=1)) if np.isfinite(r).all() else None

    def at(self, state: State) -> Point | None:
        """Linearise, or None where :meth:`costs` is None."""
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
        return Point(state, r, self.loss.cost(length), weights, normal)

    def plus(self, state: State, pose: Array, free: Array) -> State:
        """Step: T <- Exp(xi) T for each pose, and a sum for the intrinsics."""
        return State(state.params + self.free.basis @ free, se3.perturb(state.T_cam_board, pose))

    def _is_camera(self, state: State) -> bool:
        try:
            self.free.model.from_params(state.params)
        except ValueError:
            return False
        return True
