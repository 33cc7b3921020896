"""EKF-SLAM against two other programs on the same data: filterpy's EKF and a dense textbook filter.

Tolerance 1e-9 relative.  Rounding: T = 300 steps of products with 19 states, each entry gathers at most
about 3 * 19 errors per step, 300 * 57 * 2.2e-16 = 4e-12; what the two forms of the covariance update,
(I - KH) P and P - W^T W, lose differently is amplified by cond(S) < 1e2.  Together below 1e-9; a wrong
sign in any Jacobian gives more than 1e-4 (``test_known_mistakes``).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
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


@pytest.mark.parametrize("seed", [3, 4])
def test_ekf_slam_is_the_textbook_filter(
    new_drive: Any, textbook: Any, relative_difference: Any, seed: int
) -> None:
    """The oracle shares no Jacobian with the package: its own come by complex step."""
    drive = new_drive(seed=seed)
    slam, oracle = EkfSlam(drive.mean, drive.cov), textbook(drive.mean[0], drive.cov)
    for step in drive.steps:
        slam.predict(step.increment)
        oracle.predict(np.array([step.increment.ds[0], step.increment.dalpha[0]]), step.increment.cov[0])
        if len(step.ids):
            slam.update(step.ids, step.z, drive.cov_z)
            oracle.update(step.ids.tolist(), step.z[0], drive.cov_z)
        assert relative_difference(slam, oracle.x, oracle.P, oracle.ids) < TOLERANCE


def test_innovation_and_its_covariance_are_the_textbooks(new_drive: Any, textbook: Any) -> None:
    drive = new_drive(steps=40)
    slam, oracle = EkfSlam(drive.mean, drive.cov), textbook(drive.mean[0], drive.cov)
    compared = 0
    for step in drive.steps:
        slam.predict(step.increment)
        oracle.predict(np.array([step.increment.ds[0], step.increment.dalpha[0]]), step.increment.cov[0])
        if len(step.ids):
            known = [j for j, i in enumerate(step.ids) if i in oracle.ids]
            at = [3 + 2 * oracle.ids.index(step.ids[j]) for j in known]
            if at:
                H = np.vstack([oracle.jacobian(lambda x, a=a: oracle.see(x, a), oracle.x) for a in at])
                S = H @ oracle.P @ H.T + np.kron(np.eye(len(at)), drive.cov_z)
                y = (step.z[0][known] - [oracle.see(oracle.x, a) for a in at]).ravel()
            seen = slam.update(step.ids, step.z, drive.cov_z)
            oracle.update(step.ids.tolist(), step.z[0], drive.cov_z)
            assert (seen is None) == (not at)
            if seen is not None:
                assert np.abs(seen.innovation[0] - y).max() < TOLERANCE
                assert np.abs(seen.S[0] - S).max() < TOLERANCE
                compared += 1
    assert compared > 5


def test_a_batch_is_its_runs_one_by_one(new_drive: Any, textbook: Any, relative_difference: Any) -> None:
    drive = new_drive(batch=3, steps=60)
    slam = EkfSlam(drive.mean, drive.cov)
    drive.feed(slam)
    for b in range(3):
        oracle = textbook(drive.mean[b], drive.cov)
        for step in drive.steps:
            oracle.predict(np.array([step.increment.ds[b], step.increment.dalpha[b]]), step.increment.cov[b])
            oracle.update(step.ids.tolist(), step.z[b], drive.cov_z)
        assert relative_difference(slam, oracle.x, oracle.P, oracle.ids, run=b) < TOLERANCE


def test_each_landmark_may_have_its_own_noise(
    new_drive: Any, textbook: Any, relative_difference: Any
) -> None:
    """One (m, 2, 2) covariance for m landmarks equals updates one by one with theirs.

    With the heading known H is constant, so that joint and single updates agree exactly.
    """
    drive = new_drive(steps=5)
    covs = np.array([np.diag([0.01 * (k + 1), 0.02]) for k in range(len(drive.steps[-1].ids))])
    slam, oracle = (
        EkfSlam(drive.mean, np.diag([1.0, 1.0, 0.0])),
        textbook(drive.mean[0], np.diag([1.0, 1.0, 0.0])),
    )
    ids, z = drive.steps[-1].ids, drive.steps[-1].z
    slam.update(ids, z, covs)
    slam.update(ids, z + 0.1, covs)
    for shift in (0.0, 0.1):
        for j, i in enumerate(ids):
            oracle.update([i], z[0, j : j + 1] + shift, covs[j])
    assert len(ids) > 2
    assert relative_difference(slam, oracle.x, oracle.P, oracle.ids) < TOLERANCE
