r"""What the linearised system of a run can distinguish: local observability and its nullity.

A run is a list of predictions with Jacobians F_k and measurements with Jacobians H_k.  An error d of
the start shows in the k-th measurement as H_k F_{k-1} ... F_0 d; stacked::

        [ H_0             ]
    O = [ H_1 F_0         ]          d is invisible to the whole run  <=>  O d = 0
        [ H_2 F_1 F_0     ]
        [ ...             ]

Landmarks relative to the vehicle do not show where the world's origin lies nor how it is turned: the
true system has nullity 3.  A filter believes what *its* Jacobians say:

===========================  =======  ===============================================================
Jacobians taken at           nullity  why
===========================  =======  ===============================================================
the truth                       3     F_k and H_k belong to one path: the rotation of everything about
                                      the origin is carried along exactly
EKF estimates                   2     F_k leads from the *updated* pose to the next predicted one, and
                                      H_k stands at the predicted one.  Each update moves the estimate
                                      between the two; a landmark moves between two sightings.  No rotation
                                      fits all, and the filter believes to see its heading (translations
                                      enter no Jacobian: they stay)
the lifted filter               3     on the tangent space of lifted poses and landmarks, at whichever
                                      estimate; in all 11 + 6 n states it is 10 + 4 n
===========================  =======  ===============================================================

Why 3 for the lifted filter: F = M(U_k) and H hold no estimate.  H reads r_i, the landmark in the vehicle
frame, and M(U) moves (r_i, w) by itself, w = z5 + z6 (the reduction of :mod:`.carleman_ekf.reduced`).
So O reads 2 n + 1 numbers of the start, (r_1, ..., r_n, w), whatever happens: nullity 11 + 6 n - (2 n + 1).
On the manifold w = 1 has no slope, and the slope of r_i vanishes exactly along the rigid motions of
vehicle and landmarks together: 3 + 2 n - 2 n = 3.  No estimate can spoil that, because none is asked.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters import observation, vehicle
from vslam_ref.filters.carleman_ekf import lift, moments
from vslam_ref.filters.ekf_slam import EkfSlam


class RunStep(NamedTuple):
    """One step of one run: an increment (batch of 1), then a sighting (m may be 0).

    ``ids`` (m,) in 0 ... n - 1, ``z`` (1, m, 2) and ``cov_z`` (m, 2, 2) as in :meth:`EkfSlam.update`.
    """

    increment: vehicle.Increment
    ids: ArrayLike
    z: ArrayLike
    cov_z: ArrayLike


class LinearisedRun(NamedTuple):
    """Jacobians of a run.

    Attributes
    ----------
    transitions : tuple of ndarray, shapes (D, D)
        F of every step.
    measurements : tuple of ndarray, shapes (rows, D)
        H of the sighting after it; rows may be 0.
    """

    transitions: tuple[Array, ...]
    measurements: tuple[Array, ...]


class Nullity(NamedTuple):
    """Null space of an observability matrix.

    Attributes
    ----------
    nullity : int
        Its dimension.
    basis : ndarray, shape (D, nullity)
        Orthonormal columns.
    singular_values : ndarray, shape (D,)
        Falling.
    threshold : float
        Smaller ones are counted as zero.
    """

    nullity: int
    basis: Array
    singular_values: Array
    threshold: float


def observability_matrix(run: LinearisedRun) -> Array:
    """Local observability matrix: every H_k times the product of the F before it.

    Parameters
    ----------
    run : LinearisedRun

    Returns
    -------
    ndarray, shape (rows, D)

    Raises
    ------
    ValueError
        If there are not as many transitions as sightings, or none.
    """
    if len(run.transitions) != len(run.measurements) or not run.transitions:
        given = f"{len(run.transitions)} transitions and {len(run.measurements)} sightings"
        raise ValueError(f"{given}: need as many, and at least one")
    carried = np.eye(len(run.transitions[0]))
    rows = []
    for F, H in zip(run.transitions, run.measurements, strict=True):
        carried = F @ carried
        rows.append(H @ carried)
    return np.concatenate(rows)


def nullity(matrix: ArrayLike, products: int) -> Nullity:
    r"""Null space of an observability matrix by its singular values.

    Parameters
    ----------
    matrix : array_like, shape (rows, D)
    products : int
        Matrix products behind its last rows: the number of steps.

    Notes
    -----
    A product of D x D matrices is computed with a relative error of at most D eps in the norm, k of them
    and the SVD with (k + 1) D eps; by Weyl's inequality no singular value moves further than that times
    the largest.  Smaller ones are counted as zero.
    """
    O = np.asarray(matrix, dtype=np.float64)  # noqa: E741
    D = O.shape[1]
    _, values, Vt = np.linalg.svd(O, full_matrices=True)
    padded = np.zeros(D)
    padded[: len(values)] = values
    threshold = (products + 1) * D * float(np.finfo(np.float64).eps) * float(padded[0])
    zero = padded <= threshold
    return Nullity(int(zero.sum()), Vt[zero].T, padded, threshold)


def _pose_transition(pose: Array, increment: Array, landmarks: int) -> Array:
    F = np.eye(3 + 2 * landmarks)
    F[:3, :3] = vehicle.propagate_with_jacobians(pose, increment).J_pose
    return F


def _sighting(pose: Array, ids: IntArray, places: Array, landmarks: int) -> Array:
    H = np.zeros((len(ids), 2, 3 + 2 * landmarks))
    J = observation.vehicle_from_world_with_jacobians(pose, places)
    H[:, :, :3] = J.J_pose
    for row, i in enumerate(ids):
        H[row, :, 3 + 2 * i : 5 + 2 * i] = J.J_landmark[row]
    return H.reshape(2 * len(ids), H.shape[2])


def linearise_truth(
    T_world_vehicle: ArrayLike, landmarks: ArrayLike, sightings: Sequence[ArrayLike]
) -> LinearisedRun:
    """Jacobians of a run at the truth.

    Parameters
    ----------
    T_world_vehicle : array_like, shape (T + 1, 3)
        True poses (x, y, theta), metres and radians.
    landmarks : array_like, shape (n, 2)
        World frame, metres.
    sightings : sequence of array_like of int, shapes (m,)
        ``sightings[k]``: the landmarks seen from pose k + 1.

    Returns
    -------
    LinearisedRun
    """
    poses, landmarks = np.asarray(T_world_vehicle, dtype=np.float64), np.asarray(landmarks, dtype=np.float64)
    F, H = [], []
    for k, seen in enumerate(sightings):
        ids = np.asarray(seen, dtype=np.int64)
        here, there = poses[k], poses[k + 1]
        ds = (there - here)[:2] @ [np.cos(here[2]), np.sin(here[2])]
        F.append(_pose_transition(here, np.array([ds, there[2] - here[2]]), len(landmarks)))
        H.append(_sighting(there, ids, landmarks[ids], len(landmarks)))
    return LinearisedRun(tuple(F), tuple(H))


def linearise_ekf(slam: EkfSlam, steps: Iterable[RunStep], landmarks: int) -> LinearisedRun:
    """Drive an EKF (batch of 1) through ``steps`` and write down where it linearises.

    F at the updated pose, H at the predicted pose and the current map.  A landmark's first sighting
    is a measurement like any other, linearised where it is placed: augmentation is an update of an
    unknown landmark.
    """
    F, H = [], []
    places = np.zeros((landmarks, 2))
    for step in steps:
        increment = np.array([step.increment.ds[0], step.increment.dalpha[0]])
        F.append(_pose_transition(slam.pose().mean[0], increment, landmarks))
        slam.predict(step.increment)
        ids, z = np.asarray(step.ids, dtype=np.int64), np.asarray(step.z, dtype=np.float64)
        known, pose = slam.landmarks(), slam.pose().mean[0]
        predicted = np.isin(ids, known.ids)
        places[known.ids] = known.mean[0]
        H_known = _sighting(pose, ids[predicted], places[ids[predicted]], landmarks)
        if len(ids):
            slam.update(ids, z, step.cov_z)
        # new landmarks are placed from the pose after the update with the known ones
        pose, new = slam.pose().mean[0], ids[~predicted]
        H_new = _sighting(pose, new, observation.world_from_vehicle(pose, z[0, ~predicted]), landmarks)
        H.append(np.concatenate([H_known, H_new]))
    return LinearisedRun(tuple(F), tuple(H))


def linearise_lifted(steps: Iterable[RunStep], landmarks: int, control: str = "first_order") -> LinearisedRun:
    """M(U_k) and the constant H of the lifted filter, 11 + 6 n states: no estimate enters."""
    F, H = [], []
    for step in steps:
        w = moments.control_moments(step.increment, control).mean[0]
        M = np.zeros((lift.VEHICLE + lift.LANDMARK * landmarks,) * 2)
        M[: lift.VEHICLE, : lift.VEHICLE] = lift.vehicle_matrix(w)
        M[lift.VEHICLE :, lift.VEHICLE :] = np.kron(np.eye(landmarks), lift.landmark_matrix(w))
        F.append(M)
        H.append(lift.measurement_matrix(step.ids, landmarks))
    return LinearisedRun(tuple(F), tuple(H))


def lift_tangent(T_world_vehicle: ArrayLike, landmarks: ArrayLike) -> Array:
    """Derivative of the lift in pose and landmarks.

    Implements the derivatives of :eq:`eq-b14` (B14) and :eq:`eq-b15` (B15).

    Its columns span the tangent space of the manifold on which lifted states of real vehicles lie.

    Parameters
    ----------
    T_world_vehicle : array_like, shape (3,)
        Pose (x, y, theta), metres and radians.
    landmarks : array_like, shape (n, 2)
        World frame, metres.

    Returns
    -------
    ndarray, shape (11 + 6 n, 3 + 2 n)
    """
    pose, places = np.asarray(T_world_vehicle, dtype=np.float64), np.asarray(landmarks, dtype=np.float64)
    n, s, c = len(places), np.sin(pose[2]), np.cos(pose[2])
    J = np.zeros((lift.VEHICLE + lift.LANDMARK * n, 3 + 2 * n))
    J[: lift.VEHICLE, :3] = lift.lift_vehicle_jacobian(pose)
    for i, (x, y) in enumerate(places):
        at = lift.VEHICLE + lift.LANDMARK * i
        J[at + 2 : at + 6, 2] = [c * x, -s * x, c * y, -s * y]
        J[[at, at + 2, at + 3], 3 + 2 * i] = [1.0, s, c]
        J[[at + 1, at + 4, at + 5], 4 + 2 * i] = [1.0, s, c]
    return J
