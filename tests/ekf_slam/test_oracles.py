"""EKF-SLAM against another program on the same data: filterpy's EKF.  (``test_book``: against the book.)

Tolerance 1e-9 relative.  Rounding: T = 300 steps of products with 19 states, each entry gathers at most
about 3 * 19 errors per step, 300 * 57 * 2.2e-16 = 4e-12; what the two forms of the covariance update,
(I - KH) P and P - W^T W, lose differently is amplified by cond(S) < 1e2.  Together below 1e-9; a wrong
sign in any Jacobian gives more than 1e-4 (``test_known_mistakes``).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from vslam_ref.filters import observation
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.vehicle import propagate_with_jacobians

TOLERANCE = 1e-9


def run_filterpy(drive: Any) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """filterpy does predict and update; what it does not know, augmentation, is done on its arrays."""
    ekf = ExtendedKalmanFilter(dim_x=3, dim_z=2, dim_u=2)
    ekf.x, ekf.P = drive.mean[0].copy(), drive.cov.copy()
    ids: list[int] = []

    def see(x: np.ndarray, at: list[int]) -> np.ndarray:
        return np.concatenate([observation.vehicle_from_world(x[:3], x[a : a + 2]) for a in at])

    def see_jacobian(x: np.ndarray, at: list[int]) -> np.ndarray:
        H = np.zeros((2 * len(at), len(x)))
        for row, a in enumerate(at):
            J = observation.vehicle_from_world_with_jacobians(x[:3], x[a : a + 2])
            H[2 * row : 2 * row + 2, :3], H[2 * row : 2 * row + 2, a : a + 2] = J.J_pose, J.J_landmark
        return H

    for step in drive.steps:
        u = np.array([step.increment.ds[0], step.increment.dalpha[0]])
        moved = propagate_with_jacobians(ekf.x[:3], u)
        ekf.F, G = np.eye(len(ekf.x)), np.zeros((len(ekf.x), 2))
        ekf.F[:3, :3], G[:3] = moved.J_pose, moved.J_increment
        ekf.Q = G @ step.increment.cov[0] @ G.T
        ekf.predict_x = lambda u=0, to=moved.value: np.put(ekf.x, [0, 1, 2], to)
        ekf.predict(u)
        known = [j for j, i in enumerate(step.ids) if i in ids]
        if known:
            at = [3 + 2 * ids.index(step.ids[j]) for j in known]
            R = np.kron(np.eye(len(known)), drive.cov_z)
            ekf.update(step.z[0][known].ravel(), see_jacobian, see, R=R, args=(at,), hx_args=(at,))
        for j, i in enumerate(step.ids):
            if i not in ids:
                J = observation.world_from_vehicle_with_jacobians(ekf.x[:3], step.z[0, j])
                G = np.zeros((2, len(ekf.x)))
                G[:, :3] = J.J_pose
                own = G @ ekf.P @ G.T + J.J_measurement @ drive.cov_z @ J.J_measurement.T
                ekf.x = np.concatenate([ekf.x, J.value])
                ekf.P = np.block([[ekf.P, ekf.P @ G.T], [G @ ekf.P, own]])
                ekf._I = np.eye(len(ekf.x))
                ids.append(i)
    return ekf.x, ekf.P, ids


def test_ekf_slam_is_filterpys_ekf(new_drive: Any, relative_difference: Any) -> None:
    drive = new_drive()
    slam = EkfSlam(drive.mean, drive.cov)
    drive.feed(slam)
    assert relative_difference(slam, *run_filterpy(drive)) < TOLERANCE


def test_innovation_can_be_asked_before_the_update(new_drive: Any) -> None:
    """A gate's question: what the update would see, and nothing changes; None without a known landmark."""
    drive = new_drive(batch=2, steps=40)
    slam = EkfSlam(drive.mean, drive.cov)
    compared = 0
    for step in drive.steps:
        slam.predict(step.increment)
        if len(step.ids):
            before = slam.blocks.full()
            asked = slam.innovation(step.ids, step.z, drive.cov_z)
            assert all(np.array_equal(x, y) for x, y in zip(before, slam.blocks.full(), strict=True))
            seen = slam.update(step.ids, step.z, drive.cov_z)
            assert (asked is None) == (seen is None)
            if asked is not None and seen is not None:
                compared += 1
                assert all(np.abs(a - b).max() < TOLERANCE for a, b in zip(asked, seen, strict=True))
    assert compared > 5
