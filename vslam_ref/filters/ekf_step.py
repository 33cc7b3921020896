"""One step of EKF-SLAM on plain arrays: the whole algorithm on one screen.

::

    x = [x_p, x_m]            P = [[P_pp, P_pm], [P_pm^T, P_mm]]      pose (3 states), map (2 per landmark)

    ekf_predict   x_p <- f(x_p, increment),  P_pp <- F P_pp F^T + G Q G^T,  P_pm <- F P_pm
    ekf_update    innovation = z - h(x),  H = dh/dx,  then ``landmark_update``
    ekf_step      one after the other

All functions work in place on a batch of B runs.  :class:`~vslam_ref.filters.ekf_slam.EkfSlam` keeps the
books around them: which landmark stands in which column, and how a new one enters.
"""

from __future__ import annotations

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters import observation
from vslam_ref.filters.block_covariance import landmark_update, map_columns
from vslam_ref.geometry import so2

_FG = np.array([[1.0, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 0, 1]])
"""The constant part of F and G, side by side."""


@accelerated("slam:ekf_predict")
def ekf_predict(
    x_p: Array, P_pp: Array, P_pm: Array, at: Array, ds: Array, dalpha: Array, cov: Array
) -> None:
    """One prediction, in place: pose mean, P_pp <- F P_pp F^T + G Q G^T and P_pm <- F P_pm.

    Implements :eq:`eq-b4` (B4).  F is the identity but for its last column (-ds sin, ds cos, 1): of P_pm,
    rows 0 and 1 gain a multiple of row 2, and nothing else moves.

    Parameters
    ----------
    x_p, P_pp, P_pm : ndarray, shapes (B, 3), (B, 3, 3), (B, 3, M)
        Changed in place.
    at : ndarray, shape (B, 2)
        Heading and distance at which F and G are taken: the estimate and ds, or the truth for the ideal
        EKF.
    ds, dalpha, cov : ndarray, shapes (B,), (B,), (B, 2, 2)
        The increment.
    """
    c, s, d = np.cos(at[:, 0]), np.sin(at[:, 0]), at[:, 1]
    FG = np.empty((len(at), 3, 5))
    FG[:] = _FG
    F, G = FG[:, :, :3], FG[:, :, 3:]
    F[:, 0, 2], F[:, 1, 2] = -d * s, d * c
    G[:, 0, 0], G[:, 1, 0] = c, s
    x_p[:, 0] += ds * np.cos(x_p[:, 2])
    x_p[:, 1] += ds * np.sin(x_p[:, 2])
    x_p[:, 2] = so2.wrap(x_p[:, 2] + dalpha)
    P_pp[:] = F @ P_pp @ F.swapaxes(1, 2) + G @ cov @ G.swapaxes(1, 2)
    P_pm[:, :2] += F[:, :2, 2:] * P_pm[:, 2:]


@accelerated("slam:ekf_update")
def ekf_update(
    x_p: Array,
    x_m: Array,
    P_pp: Array,
    P_pm: Array,
    P_mm: Array,
    columns: IntArray,
    z: Array,
    cov_z: Array,
    innovation: Array,
    S: Array,
) -> None:
    """Update with m landmarks of the map at once, in place, linearised at the estimate.

    Implements :eq:`eq-b21` (B21) and its Jacobians.

    Parameters
    ----------
    x_p, x_m, P_pp, P_pm, P_mm : ndarray
        Shapes (B, 3), (B, M), (B, 3, 3), (B, 3, M), (B, M, M); changed in place.
    columns : ndarray of int, shape (m,)
        First map column of each landmark seen.
    z : ndarray, shape (B, m, 2)
        Relative Cartesian measurements, metres.
    cov_z : ndarray, shape (m, 2, 2)
        Their covariances.
    innovation, S : ndarray, shapes (B, 2 m), (B, 2 m, 2 m)
        Room for measured - predicted and its covariance; filled.
    """
    landmarks = x_m.take(map_columns(columns), 1).reshape(z.shape)
    H = observation.vehicle_from_world_with_jacobians(x_p[:, None], landmarks)
    innovation[...] = (z - H.value).reshape(innovation.shape)
    S[...] = landmark_update(x_p, x_m, P_pp, P_pm, P_mm, H.J_pose, H.J_landmark, columns, innovation, cov_z)
    x_p[:, 2] = so2.wrap(x_p[:, 2])


@accelerated("slam:ekf_step")
def ekf_step(
    x_p: Array,
    x_m: Array,
    P_pp: Array,
    P_pm: Array,
    P_mm: Array,
    ds: Array,
    dalpha: Array,
    cov: Array,
    columns: IntArray,
    z: Array,
    cov_z: Array,
    innovation: Array,
    S: Array,
) -> None:
    """:func:`ekf_predict` by the increment ds, dalpha (B,), cov (B, 2, 2), then :func:`ekf_update`."""
    at = np.empty((len(x_p), 2))
    at[:, 0], at[:, 1] = x_p[:, 2], ds
    ekf_predict(x_p, P_pp, P_pm, at, ds, dalpha, cov)
    ekf_update(x_p, x_m, P_pp, P_pm, P_mm, columns, z, cov_z, innovation, S)
