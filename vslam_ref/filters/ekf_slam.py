"""EKF-SLAM for a planar vehicle, and two controls that tell what its inconsistency comes from.

::

    increment ----> predict:  F, G at the estimate, P <- F P F^T + G Q G^T       O(n)
    z of known  --> update:   innovation = z - h(x),  K = P H^T S^-1             O(k n^2)
    z of new    --> augment:  landmark g(x, z), with all its cross covariances   O(k n)

* :class:`EkfSlam`, the textbook filter: state (x, y, theta) and (x_i, y_i) per landmark, world frame.
* :class:`AnchoredEkf`: the same filter started at zero covariance in its own start frame; the
  uncertain start N(x0, P0) is composed with its output.  P0, which no relative measurement can
  reduce, never meets a measurement.
* ``EkfSlam(..., truth=...)``, the *ideal* EKF: Jacobians at the true state.  No real filter can
  have them; it is a control.

All runs of a batch share the landmark schedule; each has its own noises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters import observation, vehicle
from vslam_ref.filters.block_covariance import Blocks, landmark_update
from vslam_ref.filters.ekf_step import ekf_predict, ekf_update
from vslam_ref.filters.estimates import (
    Innovation,
    MapEstimate,
    PoseEstimate,
    as_batch,
    checked_measurement,
    diagonal_blocks,
    room_for_innovation,
)
from vslam_ref.geometry import se2, so2


class Truth(NamedTuple):
    """True poses (T + 1, 3) and landmarks by identity (n, 2), for the ideal EKF only."""

    poses: Array
    landmarks: Array


class EkfSlam:
    """EKF-SLAM for a batch of runs.

    Implements the state of :eq:`eq-b1`, :eq:`eq-b2` and :eq:`eq-b3` (B1-B3): pose, then landmarks.

    Parameters
    ----------
    mean : array_like, shape (3,) or (B, 3)
        Start pose (x, y, theta), metres and radians, world frame.
    cov : array_like, shape (3, 3) or (B, 3, 3)
        Its covariance; a given value, zero allowed.
    capacity : int
        Landmarks to make room for (the map grows beyond it when it must).
    truth : Truth, optional
        Take every Jacobian at this truth instead of the estimate: the ideal EKF.
    """

    def __init__(
        self, mean: ArrayLike, cov: ArrayLike, capacity: int = 32, truth: Truth | None = None
    ) -> None:
        x, P = as_batch(mean, cov)
        self.blocks = Blocks(x, P, landmark_states=2, capacity=capacity)
        self._truth = truth
        self._step = 0

    def _linearisation(self) -> Array:
        """Pose (B, 3) at which Jacobians are taken."""
        if self._truth is None:
            return self.blocks.x_p
        return np.broadcast_to(self._truth.poses[self._step], self.blocks.x_p.shape)

    def predict(self, increment: vehicle.Increment) -> None:
        """Move the pose by an increment; the map stays. Implements :eq:`eq-b4` (B4)."""
        b = self.blocks
        at = np.empty((len(b.x_p), 2))
        at[:, 0], at[:, 1] = self._linearisation()[:, 2], self._distance(increment)
        ekf_predict(b.x_p, b.P_pp, b.P_pm, at, *increment)
        self._step += 1

    def _distance(self, increment: vehicle.Increment) -> Array:
        """Distance (B,) at which F is taken: measured, or true for the ideal EKF.

        With true headings and *measured* distances F would not carry the unobservable rotation from
        one true pose to the next, and the control would gain heading information from nothing.
        """
        if self._truth is None:
            return increment.ds
        here, there = self._truth.poses[self._step], self._truth.poses[self._step + 1]
        ahead = np.array([np.cos(here[2]), np.sin(here[2])])
        return np.full(len(increment.ds), (there - here)[:2] @ ahead)

    def update(self, ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike) -> Innovation | None:
        """Update with landmarks already in the map, then add those seen for the first time.

        Parameters
        ----------
        ids : array_like of int, shape (m,)
            Identities (known association), each once.
        z : array_like, shape (B, m, 2)
            Relative Cartesian measurements, metres, vehicle frame.
        cov_z : array_like, shape (2, 2) or (m, 2, 2)
            Their covariance.

        Returns
        -------
        Innovation or None
            None when no landmark was known before.
        """
        ids, z, cov_z = checked_measurement(ids, z, cov_z, len(self.blocks.x_p))
        columns = self.blocks.columns(ids)
        known = columns >= 0
        if known.all():
            return self._update_known(ids, columns, z, cov_z) if len(ids) else None
        seen = None
        if known.any():
            seen = self._update_known(ids[known], columns[known], z[:, known], cov_z[known])
        self._augment(ids[~known], z[:, ~known], cov_z[~known])
        return seen

    def _update_known(self, ids: IntArray, columns: IntArray, z: Array, cov_z: Array) -> Innovation:
        """Update with the measurement z = h + noise. Implements :eq:`eq-b20` (B20)."""
        b = self.blocks
        if self._truth is None:
            seen = room_for_innovation(z)
            ekf_update(b.x_p, b.x_m, b.P_pp, b.P_pm, b.P_mm, columns, z, cov_z, *seen)
            return seen
        landmarks = b.x_m.reshape(len(b.x_p), -1, 2)[:, columns // 2]
        innovation = (z - observation.vehicle_from_world(b.x_p[:, None], landmarks)).reshape(len(z), -1)
        H = observation.vehicle_from_world_with_jacobians(
            self._linearisation()[:, None], self._truth.landmarks[None, ids]
        )
        S = landmark_update(
            b.x_p, b.x_m, b.P_pp, b.P_pm, b.P_mm, H.J_pose, H.J_landmark, columns, innovation, cov_z
        )
        b.x_p[:, 2] = so2.wrap(b.x_p[:, 2])
        return Innovation(innovation, S)

    def _augment(self, ids: IntArray, z: Array, cov_z: Array) -> None:
        """Add landmarks with their cross covariances; all pairs of new ones share the pose error."""
        b = self.blocks
        B, m = z.shape[:2]
        mean = observation.world_from_vehicle(b.x_p[:, None], z)
        J = observation.world_from_vehicle_with_jacobians(
            self._linearisation()[:, None], self._placed_at(ids, z)
        )
        G = J.J_pose.reshape(B, 2 * m, 3)
        cov = G @ b.P_pp @ G.swapaxes(1, 2)
        noise = J.J_measurement @ cov_z @ J.J_measurement.swapaxes(2, 3)
        for j in range(m):
            cov[:, 2 * j : 2 * j + 2, 2 * j : 2 * j + 2] += noise[:, j]
        cross_pose = b.P_pp @ G.swapaxes(1, 2)
        cross_map = b.P_pm.swapaxes(1, 2) @ G.swapaxes(1, 2)
        b.append(ids, mean.reshape(B, -1), cov, cross_pose, cross_map)

    def _placed_at(self, ids: IntArray, z: Array) -> Array:
        """Relative landmark at which the placement is linearised: measured, or true for the ideal EKF."""
        if self._truth is None:
            return z
        return observation.vehicle_from_world(
            self._linearisation()[:, None], self._truth.landmarks[None, ids]
        )

    def pose(self) -> PoseEstimate:
        """Pose mean (B, 3) and covariance (B, 3, 3), copies."""
        return PoseEstimate(self.blocks.x_p.copy(), self.blocks.P_pp.copy())

    def landmarks(self) -> MapEstimate:
        """The map in the world frame, copies."""
        b = self.blocks
        return MapEstimate(b.ids, b.x_m.reshape(len(b.x_p), -1, 2).copy(), diagonal_blocks(b.P_mm, 2, 2))


class AnchoredEkf:
    """EKF-SLAM anchored in its start frame: the uncertain start is composed with the output.

    Parameters
    ----------
    mean, cov, capacity
        As for :class:`EkfSlam`.

    Notes
    -----
    Inside runs an ordinary :class:`EkfSlam` from the zero pose with zero covariance.  Its estimate of
    the motion since the start is independent of the start error, so the pose in the world is
    T_world_start T_start_vehicle with both factors' first-order covariances added.
    """

    def __init__(self, mean: ArrayLike, cov: ArrayLike, capacity: int = 32) -> None:
        self._start = PoseEstimate(*as_batch(mean, cov))
        self.local = EkfSlam(np.zeros_like(self._start.mean), np.zeros((3, 3)), capacity)

    def predict(self, increment: vehicle.Increment) -> None:
        """As :meth:`EkfSlam.predict`, in the start frame."""
        self.local.predict(increment)

    def update(self, ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike) -> Innovation | None:
        """As :meth:`EkfSlam.update`, in the start frame."""
        return self.local.update(ids, z, cov_z)

    def pose(self) -> PoseEstimate:
        """Pose in the world: N(x0, P0) composed with the local estimate, first order."""
        start, local = self._start, self.local.pose()
        at = observation.world_from_vehicle_with_jacobians(start.mean, local.mean[:, :2])
        J_start, J_local = np.zeros_like(start.cov), np.zeros_like(start.cov)
        J_start[:, :2], J_start[:, 2, 2] = at.J_pose, 1.0
        J_local[:, :2, :2], J_local[:, 2, 2] = at.J_measurement, 1.0
        cov = J_start @ start.cov @ J_start.swapaxes(1, 2) + J_local @ local.cov @ J_local.swapaxes(1, 2)
        return PoseEstimate(se2.compose(start.mean, local.mean), cov)

    def landmarks(self) -> MapEstimate:
        """The map in the world frame, the start's uncertainty composed to first order."""
        start, local = self._start, self.local.landmarks()
        at = observation.world_from_vehicle_with_jacobians(start.mean[:, None], local.mean)
        cov = at.J_pose @ start.cov[:, None] @ at.J_pose.swapaxes(2, 3)
        cov += at.J_measurement @ local.cov @ at.J_measurement.swapaxes(2, 3)
        return MapEstimate(local.ids, at.value, cov)
