"""The improved EKF of seed B for one run in full matrices, lifted and reduced: chapter 16 on a blackboard.

::

    lifted     11 + 6 n states    z1 ... z11, then six per landmark           motion M(U), noise J_U Q_U J_U^T
    reduced     4 + 2 n states    x, y, sin, cos, then r_i per landmark       the same pose estimates

To first order: the moments of P0 and of the control by their Jacobians.  It is slow, and it shares no code
with :mod:`.lifted` and :mod:`.reduced`.  A test asserts that all four agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from vslam_ref.arrays import Array


class Belief(NamedTuple):
    """Mean Z (D,), covariance P (D, D), and the landmarks' identities in the order of Z."""

    Z: Array
    P: Array
    ids: tuple[int, ...] = ()


def start_lifted(pose: Array, P0: Array) -> Belief:
    """Lift a pose (x, y, theta), world frame, metres and radians, and its covariance P0 (3, 3)."""
    (x, y), s, c = pose[:2], np.sin(pose[2]), np.cos(pose[2])
    Z = np.array([x, y, s, c, s * s, c * c, x * s, x * c, y * s, y * c, s * c])  # eq-b14
    J = np.zeros((11, 3))  # eq-jacobian-lift
    J[:, 0] = [1, 0, 0, 0, 0, 0, s, c, 0, 0, 0]
    J[:, 1] = [0, 1, 0, 0, 0, 0, 0, 0, s, c, 0]
    J[:, 2] = [0, 0, c, -s, 2 * s * c, -2 * s * c, x * c, -x * s, y * c, -y * s, c * c - s * s]
    return Belief(Z, J @ P0 @ J.T)


def start_reduced(pose: Array, P0: Array) -> Belief:
    """(x, y, sin, cos), the first four lifted states, of a ``pose (3,)`` with covariance ``P0 (3, 3)``."""
    lifted = start_lifted(pose, P0)
    return Belief(lifted.Z[:4], lifted.P[:4, :4])  # eq-b5


def control(ds: float, dalpha: float, Q: Array) -> tuple[Array, Array]:
    """U = (u1, u2, u3) of an increment (m, rad), and Q_U (3, 3) of its covariance Q (2, 2)."""
    U = np.array([ds, np.sin(dalpha), np.cos(dalpha)])  # eq-b6
    G_U = np.array([[1, 0], [0, U[2]], [0, -U[1]]])
    return U, G_U @ Q @ G_U.T  # eq-noise-first-order


def vehicle_rows(z: Array, U: Array) -> Array:
    """The eleven vehicle states after the control U (3,), linear in z (11,); of the unit vectors, M_R."""
    u1, u2, u3 = U
    z1, z2, z3, z4, z5, z6, z7, z8, z9, z10, z11 = z
    rows = [
        z1 + u1 * z4,  # eq-b16; its first four rows: eq-b7, eq-b8, eq-b9
        z2 + u1 * z3,
        z3 * u3 + z4 * u2,
        z4 * u3 - z3 * u2,
        z5 * u3 * u3 + 2 * z11 * u2 * u3 + z6 * u2 * u2,
        z6 * u3 * u3 - 2 * z11 * u2 * u3 + z5 * u2 * u2,
        z7 * u3 + z8 * u2 + z6 * u1 * u2 + z11 * u1 * u3,
        z8 * u3 - z7 * u2 + z6 * u1 * u3 - z11 * u1 * u2,
        z9 * u3 + z10 * u2 + z5 * u1 * u3 + z11 * u1 * u2,
        z10 * u3 - z9 * u2 + z11 * u1 * u3 - z5 * u1 * u2,
        z11 * u3 * u3 - z5 * u2 * u3 + z6 * u2 * u3 - z11 * u2 * u2,
    ]
    return np.array(rows)


def vehicle_noise(z: Array, U: Array) -> Array:
    """J_U (11, 3): the derivative of the eleven rows of z (11,) in U (3,)."""
    u1, u2, u3 = U
    _, _, z3, z4, z5, z6, z7, z8, z9, z10, z11 = z
    rows = [
        [z4, 0, 0],  # eq-jacobian-control-vehicle; its first four rows: eq-b11
        [z3, 0, 0],
        [0, z4, z3],
        [0, -z3, z4],
        [0, 2 * z11 * u3 + 2 * z6 * u2, 2 * z5 * u3 + 2 * z11 * u2],
        [0, -2 * z11 * u3 + 2 * z5 * u2, 2 * z6 * u3 - 2 * z11 * u2],
        [z6 * u2 + z11 * u3, z8 + z6 * u1, z7 + z11 * u1],
        [z6 * u3 - z11 * u2, -z7 - z11 * u1, z8 + z6 * u1],
        [z5 * u3 + z11 * u2, z10 + z11 * u1, z9 + z5 * u1],
        [z11 * u3 - z5 * u2, -z9 - z5 * u1, z10 + z11 * u1],
        [0, (z6 - z5) * u3 - 2 * z11 * u2, 2 * z11 * u3 + (z6 - z5) * u2],
    ]
    return np.array(rows)


def predict_lifted(b: Belief, ds: float, dalpha: float, Q: Array) -> Belief:
    """Move by an increment with noise Q (2, 2): one Q_U for vehicle, landmarks and the cross blocks."""
    U, Q_U = control(ds, dalpha, Q)
    turn = np.array([[U[2], U[1]], [-U[1], U[2]]])
    M_L = block_diag(np.eye(2), turn, turn)  # eq-b18
    M = block_diag(vehicle_rows(np.eye(11), U), *[M_L] * len(b.ids))
    J = [vehicle_noise(b.Z[:11], U)]
    for _, _, z3, z4, z5, z6 in b.Z[11:].reshape(-1, 6):
        J.append(np.array([[0, 0, 0], [0, 0, 0], [0, z4, z3], [0, -z3, z4], [0, z6, z5], [0, -z5, z6]]))
    J_U = np.vstack(J)
    return Belief(M @ b.Z, M @ b.P @ M.T + J_U @ Q_U @ J_U.T, b.ids)  # eq-b17, eq-b19, eq-cross-blocks


def predict_reduced(b: Belief, ds: float, dalpha: float, Q: Array) -> Belief:
    """The same, noise Q (2, 2), for x, y, sin, cos and the landmarks r_i in the vehicle's axes."""
    (u1, u2, u3), Q_U = control(ds, dalpha, Q)
    A = np.array([[1, 0, 0, u1], [0, 1, u1, 0], [0, 0, u3, u2], [0, 0, -u2, u3]])  # eq-b9
    M = block_diag(A, *[np.array([[u3, u2], [-u2, u3]])] * len(b.ids))  # eq-reduced-filter
    shift = np.concatenate([np.zeros(4), *[[-u1 * u3, u1 * u2]] * len(b.ids)])
    s, c = b.Z[2:4]
    J = [np.array([[c, 0, 0], [s, 0, 0], [0, c, s], [0, -s, c]])]  # eq-b11
    J += [np.array([[-u3, r2, r1 - u1], [u2, u1 - r1, r2]]) for r1, r2 in b.Z[4:].reshape(-1, 2)]
    J_U = np.vstack(J)
    return Belief(M @ b.Z + shift, M @ b.P @ M.T + J_U @ Q_U @ J_U.T, b.ids)  # eq-b10


def measurement_matrix(b: Belief, ids: Sequence[int], lifted: bool) -> Array:
    """The constant H (2 m, D) of landmarks of the map."""
    H = np.zeros((len(ids), 2, len(b.Z)))
    for row, i in zip(H, ids, strict=True):
        if lifted:
            at = 11 + 6 * b.ids.index(i)
            row[0, [at + 3, at + 4, 7, 8]] = 1, 1, -1, -1  # eq-b22
            row[1, [at + 2, at + 5, 6, 9]] = -1, 1, 1, -1
        else:
            at = 4 + 2 * b.ids.index(i)
            row[:, at : at + 2] = np.eye(2)  # eq-reduced-filter: z = r_i
    return H.reshape(2 * len(ids), -1)


def update(b: Belief, ids: Sequence[int], z: Array, cov_z: Array, lifted: bool) -> Belief:
    """Use measurements z (m, 2), metres, vehicle frame, of landmarks of the map; cov_z is (m, 2, 2)."""
    H = measurement_matrix(b, ids, lifted)
    S = H @ b.P @ H.T + block_diag(*cov_z)  # eq-innovation
    K = b.P @ H.T @ np.linalg.inv(S)  # eq-gain
    return Belief(b.Z + K @ (z.ravel() - H @ b.Z), b.P - K @ S @ K.T, b.ids)


def augment(b: Belief, i: int, z: Array, cov_z: Array, lifted: bool) -> Belief:
    """Add landmark i, seen for the first time at z (2,) with cov_z (2, 2)."""
    G_3, G_new = np.zeros((2, len(b.Z))), np.eye(2)
    new = z  # eq-reduced-filter: r_new = z
    if lifted:
        xi, eta = z
        _, _, z3, z4, z5, z6, _, _, _, _, z11 = b.Z[:11]
        G_3 = np.zeros((6, len(b.Z)))  # eq-jacobians-placement
        G_3[0, [0, 2, 3]], G_3[1, [1, 2, 3]] = (1, -eta, xi), (1, xi, eta)
        G_3[2, [4, 6, 10]], G_3[3, [5, 7, 10]] = (-eta, 1, xi), (xi, 1, -eta)
        G_3[4, [4, 8, 10]], G_3[5, [5, 9, 10]] = (xi, 1, eta), (eta, 1, xi)
        G_new = np.array([[z4, -z3], [z3, z4], [z11, -z5], [z6, -z11], [z5, z11], [z11, z6]])
        new = G_3 @ b.Z  # eq-b26
    G = np.block([[np.eye(len(b.Z)), np.zeros((len(b.Z), 2))], [G_3, G_new]])  # eq-b28
    return Belief(np.concatenate([b.Z, new]), G @ block_diag(b.P, cov_z) @ G.T, (*b.ids, i))  # eq-b27


def see(b: Belief, ids: Sequence[int], z: Array, cov_z: Array, lifted: bool) -> Belief:
    """Use a sighting, ``z (m, 2)`` with ``cov_z (m, 2, 2)``: update the known landmarks, then add the new."""
    known = [j for j, i in enumerate(ids) if i in b.ids]
    if known:
        b = update(b, [ids[j] for j in known], z[known], cov_z[known], lifted)
    for j, i in enumerate(ids):
        if i not in b.ids:
            b = augment(b, i, z[j], cov_z[j], lifted)
    return b


def reduce(b: Belief) -> Belief:
    """What a lifted belief says of x, y, sin, cos and of r_i, the landmarks in the vehicle's axes."""
    T = np.vstack([np.eye(4, len(b.Z)), measurement_matrix(b, b.ids, True)])  # eq-reduction-map
    return Belief(T @ b.Z, T @ b.P @ T.T, b.ids)  # eq-reduction, eq-reduction-matrix


def pose(b: Belief) -> tuple[Array, Array]:
    """(x, y, atan2(sin, cos)) and its covariance (3, 3), to first order."""
    x, y, s, c = b.Z[:4]
    J = np.zeros((3, len(b.Z)))
    J[0, 0] = J[1, 1] = 1.0
    J[2, 2:4] = np.array([c, -s]) / (s * s + c * c)
    return np.array([x, y, np.arctan2(s, c)]), J @ b.P @ J.T


def composed(b: Belief, i: int) -> tuple[Array, Array]:
    """Landmark i of a reduced belief in the world: p + R(theta) r_i (2,) and its covariance (2, 2)."""
    at, X = 4 + 2 * b.ids.index(i), pose(b)[0]
    r1, r2 = b.Z[at : at + 2]
    s, c = np.sin(X[2]), np.cos(X[2])
    place = np.array([X[0] + c * r1 - s * r2, X[1] + s * r1 + c * r2])  # eq-composed
    J = np.zeros((2, len(b.Z)))
    to_theta = np.array([b.Z[3], -b.Z[2]]) / (b.Z[2] ** 2 + b.Z[3] ** 2)  # of (sin, cos)
    J[0, 0] = J[1, 1] = 1.0
    J[0, 2:4], J[1, 2:4] = (X[1] - place[1]) * to_theta, (place[0] - X[0]) * to_theta
    J[:, at : at + 2] = [[c, -s], [s, c]]
    return place, J @ b.P @ J.T  # eq-composed-covariance
