r"""The normal equations of a calibration: an arrow.

Each corner sees one pose and all intrinsics, so :math:`J^T J` has a block of 6 x 6 for each pose, one block
for the intrinsics, and a border between them::

    [ A_1           B_1 ]  [ pose 1  ]       [ g_1 ]
    [      A_2      B_2 ]  [ pose 2  ]       [ g_2 ]
    [           ... ... ]  [   ...   ]  = -  [ ... ]
    [ B_1' B_2' ...  C  ]  [ camera  ]       [ g_c ]

Eliminating the poses leaves a system as large as the camera has parameters, whatever the number of views.
Residuals are in pixels; a pose step in the board's unit and radians, intrinsics in their own units.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray


class ArrowVector(NamedTuple):
    """A vector over all unknowns: poses (V, 6) and free intrinsics (m,)."""

    pose: Array
    free: Array

    @property
    def norm(self) -> float:
        """Length."""
        return float(np.sqrt((self.pose**2).sum() + (self.free**2).sum()))


class Arrow(NamedTuple):
    """Normal equations: A (V, 6, 6), B (V, 6, m), C (m, m), gradient (V, 6) and (m,)."""

    A: Array
    B: Array
    C: Array
    g_pose: Array
    g_free: Array

    def lengths(self) -> ArrowVector:
        """Lengths of the columns of the Jacobian; 1 for a column of zeros."""
        pose = np.sqrt(np.einsum("vii->vi", self.A))
        free = np.sqrt(np.diag(self.C))
        return ArrowVector(np.where(pose > 0, pose, 1.0), np.where(free > 0, free, 1.0))


def arrow(J_pose: Array, J_free: Array, residual: Array, weights: Array, first: IntArray) -> Arrow:
    """Sum the blocks over the corners of each view.

    Implements :eq:`eq-calibration-arrow`.

    Parameters
    ----------
    J_pose : ndarray, shape (M, 2, 6)
    J_free : ndarray, shape (M, 2, m)
    residual : ndarray, shape (M, 2)
    weights : ndarray, shape (M,)
    first : ndarray of int, shape (V,)
        Where each view begins.

    Returns
    -------
    Arrow
    """
    root = np.sqrt(weights)[:, None, None]
    P, F, r = J_pose * root, J_free * root, residual[..., None] * root
    Pt = np.swapaxes(P, 1, 2)

    def by_view(products: Array) -> Array:
        summed: Array = np.add.reduceat(products, first, axis=0)
        return summed

    flat = F.reshape(-1, F.shape[-1])
    return Arrow(
        by_view(Pt @ P), by_view(Pt @ F), flat.T @ flat, by_view(Pt @ r)[..., 0], flat.T @ r.reshape(-1)
    )


class ReducedArrow(NamedTuple):
    """Intrinsics alone: S (m, m), gradient (m,), and A^-1 [B g] (V, 6, m + 1) to find the poses again."""

    S: Array
    gradient: Array
    solved: Array


def reduce(normal: Arrow) -> ReducedArrow | None:
    """Eliminate the poses; None where a pose is not determined by its own corners.

    Implements :eq:`eq-calibration-reduced`.
    """
    try:
        L = np.linalg.cholesky(normal.A)
    except np.linalg.LinAlgError:
        return None
    right = np.concatenate([normal.B, normal.g_pose[..., None]], axis=-1)
    half = np.linalg.solve(L, right)
    solved = np.linalg.solve(np.swapaxes(L, -1, -2), half)
    m = normal.C.shape[0]
    product = np.einsum("vij,vik->jk", half[..., :m], half)
    S = normal.C - product[:, :m]
    return ReducedArrow(0.5 * (S + S.T), normal.g_free - product[:, m], solved)


def damped_step(normal: Arrow, damping: float, scale: ArrowVector) -> ArrowVector | None:
    """Levenberg-Marquardt's step, (J^T J + damping D^2) step = -g, by elimination of the poses.

    Parameters
    ----------
    normal : Arrow
    damping : float
        At least 0.
    scale : ArrowVector
        Diagonal of D.

    Returns
    -------
    ArrowVector or None
        None where the system is singular to working precision.

    Notes
    -----
    Rows and columns are divided by ``scale`` first.  A normal matrix loses twice the digits that its Jacobian
    would; the step only has to lead downhill, and the gradient, which decides where to stop, is exact.
    """
    d, e = scale.pose, scale.free
    A = normal.A / (d[:, :, None] * d[:, None, :]) + damping * np.eye(6)
    C = normal.C / np.outer(e, e) + damping * np.eye(len(e))
    scaled = Arrow(A, normal.B / (d[:, :, None] * e), C, normal.g_pose / d, normal.g_free / e)
    reduced = reduce(scaled)
    if reduced is None:
        return None
    try:
        L = np.linalg.cholesky(reduced.S)  # eq-damped
    except np.linalg.LinAlgError:
        return None
    free = -np.linalg.solve(L.T, np.linalg.solve(L, reduced.gradient))
    pose = -(reduced.solved[..., :-1] @ free + reduced.solved[..., -1])
    step = ArrowVector(pose / d, free / e)
    return step if np.isfinite(step.norm) else None


def promised(normal: Arrow, step: ArrowVector, damping: float, scale: ArrowVector) -> float:
    """Decrease of the cost that the linear model promises for a damped step."""
    slope = float((normal.g_pose * step.pose).sum() + normal.g_free @ step.free)
    size = float(((scale.pose * step.pose) ** 2).sum() + ((scale.free * step.free) ** 2).sum())
    return 0.5 * (damping * size - slope)  # eq-gain-ratio: its denominator
