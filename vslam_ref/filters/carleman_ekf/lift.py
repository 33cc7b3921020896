"""The second-order Carleman lift of the planar vehicle and its landmarks: B14-B16, B18, B22, B26.

::

    vehicle, 11 states                             landmark i, 6 states
    z1 = x       z5 = sin^2      z8  = x cos       zi1 = x_i          zi4 = cos x_i
    z2 = y       z6 = cos^2      z9  = y sin       zi2 = y_i          zi5 = sin y_i
    z3 = sin     z7 = x sin      z10 = y cos       zi3 = sin x_i      zi6 = cos y_i
    z4 = cos                     z11 = sin cos

with sin and cos of the heading theta.  The control enters as U = (u1, u2, u3) = (ds, sin dalpha,
cos dalpha) (B6).  Each row of B16 and B18 is a sum of (control monomial) x (state): linear in the
lifted state, with a matrix that is linear in the nine monomials

    w = (1, u1, u2, u3, u2u2, u2u3, u3u3, u1u2, u1u3).

The rows stand below as the paper prints them, corrected, and are turned into matrices once.  x^2, xy
and y^2 are left out of the Kronecker square, as the paper does: no row needs them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array

MONOMIALS = ("1", "u1", "u2", "u3", "u2u2", "u2u3", "u3u3", "u1u2", "u1u3")
VEHICLE = 11
LANDMARK = 6

_VEHICLE_ROWS = (
    "z1*1 + z4*u1",
    "z2*1 + z3*u1",
    "z3*u3 + z4*u2",
    "z4*u3 - z3*u2",
    "z5*u3u3 + 2*z11*u2u3 + z6*u2u2",
    "z6*u3u3 - 2*z11*u2u3 + z5*u2u2",
    "z7*u3 + z8*u2 + z6*u1u2 + z11*u1u3",
    "z8*u3 - z7*u2 + z6*u1u3 - z11*u1u2",
    "z9*u3 + z10*u2 + z5*u1u3 + z11*u1u2",
    "z10*u3 - z9*u2 + z11*u1u3 - z5*u1u2",
    "z11*u3u3 - z5*u2u3 + z6*u2u3 - z11*u2u2",
)
_LANDMARK_ROWS = ("z1*1", "z2*1", "z3*u3 + z4*u2", "z4*u3 - z3*u2", "z5*u3 + z6*u2", "z6*u3 - z5*u2")
_LANDMARK_ROW_6_AS_PRINTED = "z6*u3 + z5*u2"


def _matrices(rows: tuple[str, ...]) -> Array:
    """Turn rows into one constant matrix per monomial, shape (9, states, states)."""
    M = np.zeros((len(MONOMIALS), len(rows), len(rows)))
    for i, row in enumerate(rows):
        for term in row.replace("- ", "+ -").split(" + "):
            sign = -1.0 if term.startswith("-") else 1.0
            *factor, state, monomial = term.lstrip("-").split("*")
            M[MONOMIALS.index(monomial), i, int(state[1:]) - 1] += sign * float(factor[0] if factor else 1)
    return M


@dataclass(frozen=True)
class Variant:
    """Which printed errata to run; the default is the corrected filter.

    Attributes
    ----------
    b18_as_printed : bool
        Last row of B18 with ``+ z_i5 u2``.  It turns (sin y_i, cos y_i) by a matrix that is not a rotation.
    b26_as_printed : bool
        Row 5 of B26 with ``- y_new z11``.
    cross_noise : bool
        False: the common control noise enters the diagonal blocks only, which is all B17 and B19 print.
    product_of_means : bool
        With Gaussian control moments: products of E[u] where E[u u] belongs.
    """

    b18_as_printed: bool = False
    b26_as_printed: bool = False
    cross_noise: bool = True
    product_of_means: bool = False


AS_CORRECTED = Variant()

VEHICLE_MATRICES = _matrices(_VEHICLE_ROWS)
LANDMARK_MATRICES = _matrices(_LANDMARK_ROWS)
LANDMARK_MATRICES_AS_PRINTED = _matrices((*_LANDMARK_ROWS[:5], _LANDMARK_ROW_6_AS_PRINTED))


def lift_vehicle(T_world_vehicle: ArrayLike) -> Array:
    """Lift a pose to the 11 vehicle states.

    Implements :eq:`eq-b14` (B14).

    Parameters
    ----------
    T_world_vehicle : array_like, shape (..., 3)
        Pose (x, y, theta), world frame, metres and radians.

    Returns
    -------
    ndarray, shape (..., 11)
        z1 ... z11; metres where x or y is a factor, else without unit.
    """
    pose = np.asarray(T_world_vehicle, dtype=np.float64)
    x, y, s, c = pose[..., 0], pose[..., 1], np.sin(pose[..., 2]), np.cos(pose[..., 2])
    return np.stack([x, y, s, c, s * s, c * c, x * s, x * c, y * s, y * c, s * c], -1)


def lift_vehicle_jacobian(T_world_vehicle: ArrayLike) -> Array:
    """Jacobian of :func:`lift_vehicle` in (x, y, theta).

    Implements :eq:`eq-jacobian-lift`.

    Parameters
    ----------
    T_world_vehicle : array_like, shape (..., 3)
        Pose (x, y, theta), world frame, metres and radians.

    Returns
    -------
    ndarray, shape (..., 11, 3)
    """
    pose = np.asarray(T_world_vehicle, dtype=np.float64)
    x, y, s, c = pose[..., 0], pose[..., 1], np.sin(pose[..., 2]), np.cos(pose[..., 2])
    J = np.zeros((*pose.shape[:-1], VEHICLE, 3))
    J[..., 0, 0] = J[..., 1, 1] = 1.0  # eq-jacobian-lift
    J[..., 6, 0], J[..., 7, 0] = s, c
    J[..., 8, 1], J[..., 9, 1] = s, c
    slope = [c, -s, 2 * s * c, -2 * s * c, x * c, -x * s, y * c, -y * s, c * c - s * s]
    J[..., 2:, 2] = np.stack(slope, -1)
    return J


def lift_landmark(T_world_vehicle: ArrayLike, landmark: ArrayLike) -> Array:
    """Lift landmarks, seen from a pose, to their six states.

    Implements :eq:`eq-b15` (B15).

    Parameters
    ----------
    T_world_vehicle : array_like, shape (..., 3)
        Pose (x, y, theta), world frame, metres and radians.
    landmark : array_like, shape (..., 2)
        World frame, metres.

    Returns
    -------
    ndarray, shape (..., 6)
        x, y, and their products with sin and cos of the heading, metres.
    """
    pose, landmark = np.asarray(T_world_vehicle, dtype=np.float64), np.asarray(landmark, dtype=np.float64)
    x, y, theta = np.broadcast_arrays(landmark[..., 0], landmark[..., 1], pose[..., 2])
    s, c = np.sin(theta), np.cos(theta)
    return np.stack([x, y, s * x, c * x, s * y, c * y], -1)


def vehicle_matrix(w: ArrayLike) -> Array:
    """Transition of the 11 vehicle states.

    Implements :eq:`eq-b16` (B16).

    Parameters
    ----------
    w : array_like, shape (..., 9)
        Control monomials, see :data:`MONOMIALS`.

    Returns
    -------
    ndarray, shape (..., 11, 11)
    """
    return np.tensordot(np.asarray(w, dtype=np.float64), VEHICLE_MATRICES, 1)


def landmark_matrix(w: ArrayLike, variant: Variant = AS_CORRECTED) -> Array:
    """Transition of the six states of a landmark.

    Implements :eq:`eq-b18` (B18).

    Parameters
    ----------
    w : array_like, shape (..., 9)
        Control monomials, see :data:`MONOMIALS`.
    variant : Variant
        Whether the last row is as printed.

    Returns
    -------
    ndarray, shape (..., 6, 6)
    """
    matrices = LANDMARK_MATRICES_AS_PRINTED if variant.b18_as_printed else LANDMARK_MATRICES
    return np.tensordot(np.asarray(w, dtype=np.float64), matrices, 1)


def control_jacobian(z: Array, variant: Variant = AS_CORRECTED) -> Array:
    """Jacobian of the moved state in the control monomials, all but the constant one.

    Implements :eq:`eq-jacobian-control-vehicle` and the Jacobians of :eq:`eq-b19` (B19), in monomials: the
    motion is linear in them, so each column is one monomial's matrix times the lifted state.

    Parameters
    ----------
    z : ndarray, shape (B, 11 + 6 n)
        Lifted state.
    variant : Variant
        Whether the last row of B18 is as printed.

    Returns
    -------
    ndarray, shape (B, 11 + 6 n, 8)
    """
    matrices = LANDMARK_MATRICES_AS_PRINTED if variant.b18_as_printed else LANDMARK_MATRICES
    J_R = np.einsum("kij,bj->bik", VEHICLE_MATRICES[1:], z[:, :VEHICLE])
    J_L = np.einsum("kij,bnj->bnik", matrices[1:], z[:, VEHICLE:].reshape(len(z), -1, LANDMARK))
    return np.concatenate([J_R, J_L.reshape(len(z), -1, len(MONOMIALS) - 1)], 1)


def measurement_matrix(slots: ArrayLike, landmarks: int) -> Array:
    """Constant measurement matrix of landmarks of the map.

    Implements :eq:`eq-b22` (B22): a = zi4 + zi5 - z8 - z9, b = -zi3 + zi6 + z7 - z10.

    Parameters
    ----------
    slots : array_like of int, shape (m,)
        Places of the landmarks in the map.
    landmarks : int
        Landmarks n of the map.

    Returns
    -------
    ndarray, shape (2 m, 11 + 6 n)
    """
    slots = np.asarray(slots, dtype=np.int64)
    H = np.zeros((len(slots), 2, VEHICLE + LANDMARK * landmarks))
    H[:, 0, [7, 8]] = -1.0
    H[:, 1, 6], H[:, 1, 9] = 1.0, -1.0
    at, j = VEHICLE + LANDMARK * slots, np.arange(len(slots))
    H[j, 0, at + 3] = H[j, 0, at + 4] = 1.0
    H[j, 1, at + 2], H[j, 1, at + 5] = -1.0, 1.0
    return H.reshape(2 * len(slots), H.shape[2])


def placement_matrices(
    z_R: Array, measurement: Array, variant: Variant = AS_CORRECTED
) -> tuple[Array, Array]:
    """Matrices of a new landmark: G_3 in the vehicle states and G_new in the measurement.

    Implements :eq:`eq-b26` (B26) and :eq:`eq-jacobians-placement`, the blocks of :eq:`eq-b28` (B28).

    Parameters
    ----------
    z_R : ndarray, shape (..., 11)
        Vehicle states.
    measurement : ndarray, shape (..., 2)
        x_new, y_new in the vehicle frame, metres.

    Returns
    -------
    G_3 : ndarray, shape (..., 6, 11)
        The landmark's lifted state is G_3 z_R.
    G_new : ndarray, shape (..., 6, 2)
    """
    sign = -1.0 if variant.b26_as_printed else 1.0
    # rows of B26 as (state of x_new, state of y_new, its sign, state without factor), states from 1
    rows = (
        (4, 3, -1.0, 1),
        (3, 4, 1.0, 2),
        (11, 5, -1.0, 7),
        (6, 11, -1.0, 8),
        (5, 11, sign, 9),
        (11, 6, 1.0, 10),
    )
    G_3 = np.zeros((*measurement.shape[:-1], LANDMARK, VEHICLE))
    G_new = np.zeros((*measurement.shape[:-1], LANDMARK, 2))
    for i, (of_x, of_y, sign_y, alone) in enumerate(rows):
        G_3[..., i, of_x - 1] += measurement[..., 0]
        G_3[..., i, of_y - 1] += sign_y * measurement[..., 1]
        G_3[..., i, alone - 1] += 1.0
        G_new[..., i, 0] = z_R[..., of_x - 1]
        G_new[..., i, 1] = sign_y * z_R[..., of_y - 1]
    return G_3, G_new
