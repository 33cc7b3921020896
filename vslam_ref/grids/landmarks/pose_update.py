"""A scan's word on the pose, given to a filter that also holds landmarks.

A match yields information A on the pose, perhaps singular (along a corridor).  In the eigenvectors of A
the known directions are ordinary measurements with variances 1/eigenvalue; the unknown ones are left out.
The landmarks move with the pose through their cross covariances, as in any EKF update.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.filters.block_covariance import Blocks, Expected, kalman_update_in_place
from vslam_ref.geometry import so2
from vslam_ref.grids.landmarks.field import pose_difference

WEAKEST = 1e-6
"""Eigenvalues below this share of the largest say nothing."""


def pose_measurement(
    T_world_laser: ArrayLike, information: ArrayLike, predicted: ArrayLike, cov: ArrayLike
) -> tuple[Array, Array, Array]:
    """Turn a match into a linear measurement H x = z with independent errors.

    Implements :eq:`eq-match-measurement`.

    A match maximises prediction times likelihood, so that at its pose x, with the prediction's P,
    A (z - x) = P^-1 (x - predicted): the likelihood's own maximum z lies beyond x, seen from the prediction.

    Parameters
    ----------
    T_world_laser : array_like, shape (3,)
        Most probable pose x = (x, y, theta), metres and radians.
    information : array_like, shape (3, 3)
        A, of the scan alone.
    predicted, cov : array_like, shapes (3,), (3, 3)
        The prediction.

    Returns
    -------
    H : ndarray, shape (k, 3)
        Known directions, k <= 3.
    innovation : ndarray, shape (k,)
        H (z - predicted).
    variance : ndarray, shape (k,)
    """
    A, P = np.asarray(information, dtype=np.float64), np.asarray(cov, dtype=np.float64)
    off = pose_difference(T_world_laser, predicted)
    values, vectors = np.linalg.eigh((A + A.T) / 2)
    known = values > WEAKEST * max(float(values.max()), 0.0)
    known &= values > 0.0
    H = vectors[:, known].T
    pull = H @ np.linalg.solve(P, off)
    return H, H @ off + pull / values[known], 1.0 / values[known]


def pose_update(blocks: Blocks, H: ArrayLike, innovation: ArrayLike, variance: ArrayLike) -> None:
    """Kalman update of pose and landmarks, in place, by a measurement of the pose of one run (a batch of 1).

    ``H (k, 3)``, ``innovation (k,)``, ``variance (k,)`` of :func:`pose_measurement`; metres and radians.
    """
    H, innovation = np.asarray(H, dtype=np.float64)[None], np.asarray(innovation, dtype=np.float64)[None]
    if H.shape[1] == 0:
        return
    b = blocks
    HP = H @ np.concatenate([b.P_pp, b.P_pm], axis=2)
    S = HP[:, :, :3] @ H.swapaxes(1, 2) + np.diag(np.asarray(variance, dtype=np.float64))
    kalman_update_in_place(b.state, Expected(innovation, S, HP))
    b.x_p[:, 2] = so2.wrap(b.x_p[:, 2])
