"""EKF-SLAM for one run in full matrices: the algorithm of chapter 15 as one would write it on a blackboard.

::

    predict    X <- f(X, increment)          P <- F P F^T + G Q G^T
    update     nu = z - h(X)                 S = H P H^T + cov_z
               K = P H^T S^-1                X <- X + K nu,   P <- P - K S K^T
    augment    X <- [X, g(X, z)]             P with all cross covariances

It is slow, and it shares no code with :mod:`.ekf_slam`: F, G, H and K are whole matrices, and every function
returns new arrays.  A test asserts that both filters agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from vslam_ref.arrays import Array


class Belief(NamedTuple):
    """What the filter knows.

    Attributes
    ----------
    X : ndarray, shape (3 + 2 n,)
        Pose (x, y, theta), then the landmarks; world frame, metres and radians.
    P : ndarray, shape (3 + 2 n, 3 + 2 n)
        Its covariance.
    ids : tuple of int
        Identities of the landmarks, in the order in which they stand in X.
    """

    X: Array  # eq-b1, eq-b2, eq-b3
    P: Array  # eq-blocks
    ids: tuple[int, ...] = ()


def wrap(angle: float) -> float:
    """Angle in (-pi, pi]."""
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


def rotation(theta: float) -> Array:
    """R, which turns the vehicle's axes into the world's."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s], [s, c]])


def drive(v: float, phi: float, cov_u: Array, L: float, dt: float) -> tuple[float, float, Array]:
    """Increment ds (m), dalpha (rad) and its covariance Q of a car with wheelbase L (m)."""
    ds, dalpha = v * dt, v * dt * np.tan(phi) / L  # eq-increment
    D = np.array([[dt, 0.0], [dt * np.tan(phi) / L, v * dt * (1 + np.tan(phi) ** 2) / L]])
    return ds, dalpha, D @ cov_u @ D.T  # eq-jacobian-drive


def predict(b: Belief, ds: float, dalpha: float, Q: Array) -> Belief:
    """Move by an increment, first along the old heading, then turn; its covariance is Q (2, 2)."""
    X, c, s = b.X.copy(), np.cos(b.X[2]), np.sin(b.X[2])
    X[:3] = X[0] + ds * c, X[1] + ds * s, wrap(X[2] + dalpha)  # eq-b4
    F, G = np.eye(len(X)), np.zeros((len(X), 2))
    F[:2, 2] = -ds * s, ds * c  # eq-jacobians-motion
    G[:3] = [[c, 0], [s, 0], [0, 1]]
    return Belief(X, F @ b.P @ F.T + G @ Q @ G.T, b.ids)  # eq-predict


def expect(b: Belief, ids: Sequence[int]) -> tuple[Array, Array]:
    """Predicted measurements h (2 m,), metres, vehicle frame, and H (2 m, 3 + 2 n)."""
    R, h, H = rotation(b.X[2]), np.zeros(2 * len(ids)), np.zeros((2 * len(ids), len(b.X)))
    for j, i in enumerate(ids):
        at, row = 3 + 2 * b.ids.index(i), slice(2 * j, 2 * j + 2)
        r = R.T @ (b.X[at : at + 2] - b.X[:2])  # eq-b21
        H[row, :2], H[row, at : at + 2] = -R.T, R.T  # eq-jacobians-measurement
        H[row, 2] = r[1], -r[0]
        h[row] = r
    return h, H


def innovation(b: Belief, ids: Sequence[int], z: Array, cov_z: Array) -> tuple[Array, Array, Array]:
    """Nu (2 m,) = measured - predicted, its covariance S, and H; z is (m, 2), cov_z (m, 2, 2)."""
    h, H = expect(b, ids)
    return z.ravel() - h, H @ b.P @ H.T + block_diag(*cov_z), H  # eq-b20, eq-innovation


def update(b: Belief, ids: Sequence[int], z: Array, cov_z: Array) -> Belief:
    """Use measurements z (m, 2) of landmarks of the map; cov_z is (m, 2, 2)."""
    nu, S, H = innovation(b, ids, z, cov_z)
    K = b.P @ H.T @ np.linalg.inv(S)  # eq-gain
    X = b.X + K @ nu
    X[2] = wrap(X[2])
    return Belief(X, b.P - K @ S @ K.T, b.ids)


def augment(b: Belief, i: int, z: Array, cov_z: Array) -> Belief:
    """Add landmark i, seen for the first time at z (2,) with the covariance cov_z (2, 2)."""
    R = rotation(b.X[2])
    t = R @ z
    X = np.concatenate([b.X, b.X[:2] + t])  # eq-b23, eq-b24, eq-b25
    G_p, G_z = np.array([[1, 0, -t[1]], [0, 1, t[0]]]), R  # eq-jacobians-new
    G = np.hstack([G_p, np.zeros((2, len(b.X) - 3))])
    own = G @ b.P @ G.T + G_z @ cov_z @ G_z.T
    P = np.block([[b.P, b.P @ G.T], [G @ b.P, own]])  # eq-augment
    return Belief(X, P, (*b.ids, i))


def see(b: Belief, ids: Sequence[int], z: Array, cov_z: Array) -> Belief:
    """Use a sighting, ``z (m, 2)`` with ``cov_z (m, 2, 2)``: update the known landmarks, then add the new."""
    known = [j for j, i in enumerate(ids) if i in b.ids]
    if known:
        b = update(b, [ids[j] for j in known], z[known], cov_z[known])
    for j, i in enumerate(ids):
        if i not in b.ids:
            b = augment(b, i, z[j], cov_z[j])
    return b
