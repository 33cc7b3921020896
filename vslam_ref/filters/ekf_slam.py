"""EKF-SLAM for a planar vehicle, and two controls that show where its inconsistency comes from.

::

    increment ----> predict:  F, G at the estimate, P <- F P F^T + G Q G^T       O(n)
    z of known  --> update:   innovation = z - h(x),  K = P H^T S^-1             O(k n^2)
    z of new    --> augment:  landmark g(x, z), with all its cross covariances   O(k n)

* :class:`EkfSlam`, the textbook filter: state (x, y, theta) and (x_i, y_i) per landmark, world frame.
* :class:`AnchoredEkf`: the same filter started at zero covariance in its own start frame; the
  uncertain start N(x0, P0) is composed with its output.  P0, which no relative measurement can
  reduce, never meets a measurement.
* :class:`IdealEkf`: Jacobians at the true state.  No real filter can have them; it is a control.

All runs of a batch share the landmark schedule; each has its own noises.  :mod:`.book` is the same filter
for one run in full matrices.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray, transpose
from vslam_ref.filters import observation, vehicle
from vslam_ref.filters.block_covariance import (
    Blocks,
    Expected,
    State,
    diagonal_blocks,
    expected_landmarks,
    kalman_update_in_place,
)
from vslam_ref.filters.estimates import Innovation, MapEstimate, PoseEstimate, SlamFilter, as_batch
from vslam_ref.filters.observation import ObservationJacobians, PlacementJacobians
from vslam_ref.geometry import se2, so2

# -- the steps, on the arrays of a batch ---------------------------------------------------------------


@accelerated("slam:ekf_predict_in_place")
def ekf_predict_in_place(state: State, increment: vehicle.Increment) -> None:
    """Predict with F and G at the estimate.

    Implements :eq:`eq-predict`.

    Parameters
    ----------
    state : State
        ``x_p``, ``P_pp`` and ``P_pm`` are changed in place.
    increment : Increment
        Of B runs.
    """
    moved = vehicle.motion_model(state.x_p, increment.ds, increment.dalpha)
    state.x_p[...] = moved.value
    move_covariance_in_place(state, moved.J_pose, moved.J_increment, increment.cov)


def move_covariance_in_place(state: State, F: Array, G: Array, Q: Array) -> None:
    """Move the covariance of pose and cross terms, and add the noise of the increment.

    Implements :eq:`eq-predict`.

    Parameters
    ----------
    state : State
        ``P_pp`` and ``P_pm`` are changed in place.
    F : ndarray, shape (B, 3, 3) or (3, 3)
        Jacobian of the motion in the pose.
    G : ndarray, shape (B, 3, 2) or (3, 2)
        Jacobian in (ds, dalpha).
    Q : ndarray, shape (B, 2, 2)
        Covariance of (ds, dalpha), m^2, m rad, rad^2.
    """
    state.P_pp[...] = F @ state.P_pp @ F.swapaxes(-1, -2) + G @ Q @ G.swapaxes(-1, -2)  # eq-predict
    state.P_pm[...] = F @ state.P_pm


@accelerated("slam:ekf_update_in_place")
def ekf_update_in_place(
    state: State, columns: IntArray, z: Array, cov_z: Array, gate: float
) -> tuple[Array, Array]:
    """Update with m landmarks of the map at once, linearised at the estimate.

    Implements :eq:`eq-innovation` and :eq:`eq-gain`.

    Parameters
    ----------
    state : State
        Changed in place.
    columns : ndarray of int, shape (m,)
        First map column of each landmark seen.
    z : ndarray, shape (B, m, 2)
        Relative Cartesian measurements, metres, vehicle frame.
    cov_z : ndarray, shape (m, 2, 2)
        Their covariances, m^2; the measurements are independent.
    gate : float
        Runs whose normalised innovation squared is larger stay as they are.

    Returns
    -------
    innovation : ndarray, shape (B, 2 m)
        measured - predicted, metres.
    S : ndarray, shape (B, 2 m, 2 m)
        Its covariance, m^2.
    """
    seen = expected(state, columns, z, cov_z)
    correct_in_place(state, seen, gate)
    return seen.innovation, seen.S


def expected(
    state: State, columns: IntArray, z: Array, cov_z: Array, at: ObservationJacobians | None = None
) -> Expected:
    """Innovation, S and H P of landmarks of the map; the Jacobians are those ``at`` another place, if given.

    Implements :eq:`eq-innovation`.  Other parameters as for :func:`ekf_update_in_place`; nothing is changed.
    """
    B, m, _ = z.shape
    landmarks = state.x_m.reshape(B, -1, 2)[:, columns // 2]
    here = observation.vehicle_from_world_with_jacobians(state.x_p[:, None], landmarks)
    H, innovation = at or here, (z - here.value).reshape(B, 2 * m)  # eq-b20
    return expected_landmarks(state, columns, H.J_pose, H.J_landmark, innovation, cov_z)


def correct_in_place(state: State, seen: Expected, gate: float) -> None:
    """Correct means and covariance by an innovation; the heading stays in (-pi, pi]."""
    kalman_update_in_place(state, seen, gate)
    state.x_p[:, 2] = so2.wrap(state.x_p[:, 2])


# -- the filters ---------------------------------------------------------------------------------------


class EkfSlam(SlamFilter):
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

    Examples
    --------
    >>> slam = EkfSlam([0.0, 0.0, 0.0], 0.01 * np.eye(3))
    >>> slam.update([7], [[[2.0, 1.0]]], 0.01 * np.eye(2))  # a landmark seen for the first time
    >>> slam.landmarks().mean
    array([[[2., 1.]]])
    """

    def __init__(self, mean: ArrayLike, cov: ArrayLike, capacity: int = 32) -> None:
        self.blocks = Blocks(*as_batch(mean, cov), landmark_states=2, capacity=capacity)
        self.runs = len(self.blocks.x_p)

    def predict(self, increment: vehicle.Increment) -> None:
        """Move the pose by an increment; the map stays."""
        ekf_predict_in_place(self.blocks.state, increment)

    def _columns(self, ids: IntArray) -> IntArray:
        return self.blocks.columns(ids)

    def _jacobians(self, columns: IntArray) -> ObservationJacobians | None:
        """Jacobians of landmarks of the map; None for those at the estimate."""
        return None

    def _innovation(self, columns: IntArray, z: Array, cov_z: Array) -> Innovation:
        seen = expected(self.blocks.state, columns, z, cov_z, self._jacobians(columns))
        return Innovation(seen.innovation, seen.S)

    def _update_known(self, columns: IntArray, z: Array, cov_z: Array, gate: float) -> Innovation:
        return Innovation(*ekf_update_in_place(self.blocks.state, columns, z, cov_z, gate))

    def _augment(self, ids: IntArray, z: Array, cov_z: Array) -> None:
        """Add landmarks with their cross covariances; all pairs of new ones share the pose error."""
        b = self.blocks
        mean = observation.world_from_vehicle(b.x_p[:, None], z)
        J = self._placement(ids, z)
        G = J.J_pose.reshape(len(z), -1, 3)
        noise = J.J_measurement @ cov_z @ transpose(J.J_measurement)
        b.append(ids, mean.reshape(len(z), -1), G, noise)

    def _placement(self, ids: IntArray, z: Array) -> PlacementJacobians:
        """Jacobians of a new landmark's place."""
        return observation.world_from_vehicle_with_jacobians(self.blocks.x_p[:, None], z)

    def pose(self) -> PoseEstimate:
        """Pose mean (B, 3) and covariance (B, 3, 3), copies."""
        return PoseEstimate(self.blocks.x_p.copy(), self.blocks.P_pp.copy())

    def landmarks(self) -> MapEstimate:
        """The map in the world frame, copies."""
        ids, (x_p, x_m, _, _, P_mm) = self.blocks.ids, self.blocks.state
        return MapEstimate(ids, x_m.reshape(len(x_p), -1, 2).copy(), diagonal_blocks(P_mm).copy())


class Truth(NamedTuple):
    """What is true, for the ideal EKF only.

    Attributes
    ----------
    T_world_vehicle : ndarray, shape (T + 1, 3)
        Poses (x, y, theta), metres and radians.
    landmarks : ndarray, shape (n, 2)
        World frame, metres; row i belongs to identity i.
    """

    T_world_vehicle: Array
    landmarks: Array


class IdealEkf(EkfSlam):
    """EKF-SLAM whose Jacobians are taken at the truth: a control, not a method.

    Parameters
    ----------
    mean, cov : array_like
        As for :class:`EkfSlam`.
    truth : Truth
        Pose at the start and after every prediction, and the landmarks.
    capacity : int
        As for :class:`EkfSlam`.
    """

    def __init__(self, mean: ArrayLike, cov: ArrayLike, truth: Truth, capacity: int = 32) -> None:
        super().__init__(mean, cov, capacity)
        self._truth = truth
        self._step = 0

    @property
    def _true_pose(self) -> Array:
        return np.asarray(self._truth.T_world_vehicle[self._step])

    def predict(self, increment: vehicle.Increment) -> None:
        """Move the pose by an increment, F and G at the true pose and the true distance.

        With true headings and *measured* distances F would not carry the unobservable rotation from
        one true pose to the next, and the control would gain heading information from nothing.
        """
        here, state = self._true_pose, self.blocks.state
        self._step += 1
        ahead = np.array([np.cos(here[2]), np.sin(here[2])])
        at = vehicle.motion_model(here, (self._true_pose - here)[:2] @ ahead, np.zeros(()))
        state.x_p[...] = vehicle.motion_model(state.x_p, increment.ds, increment.dalpha).value
        move_covariance_in_place(state, at.J_pose, at.J_increment, increment.cov)

    def _jacobians(self, columns: IntArray) -> ObservationJacobians:
        true = self._truth.landmarks[self.blocks.ids[columns // 2]]
        return observation.vehicle_from_world_with_jacobians(self._true_pose, true)

    def _update_known(self, columns: IntArray, z: Array, cov_z: Array, gate: float) -> Innovation:
        state = self.blocks.state
        seen = expected(state, columns, z, cov_z, self._jacobians(columns))
        correct_in_place(state, seen, gate)
        return Innovation(seen.innovation, seen.S)

    def _placement(self, ids: IntArray, z: Array) -> PlacementJacobians:
        true = observation.vehicle_from_world(self._true_pose, self._truth.landmarks[ids])
        pose = np.broadcast_to(self._true_pose, (len(z), 1, 3))
        return observation.world_from_vehicle_with_jacobians(pose, true)


class AnchoredEkf(EkfSlam):
    """EKF-SLAM anchored in its start frame: the uncertain start is composed with the output.

    Parameters
    ----------
    mean, cov, capacity : array_like, array_like, int
        As for :class:`EkfSlam`.

    Notes
    -----
    Inside runs an ordinary :class:`EkfSlam` from the zero pose with zero covariance.  Its estimate of
    the motion since the start is independent of the start error, so the pose in the world is
    T_world_start T_start_vehicle with both factors' first-order covariances added.
    """

    def __init__(self, mean: ArrayLike, cov: ArrayLike, capacity: int = 32) -> None:
        self._start = PoseEstimate(*as_batch(mean, cov))
        super().__init__(np.zeros_like(self._start.mean), np.zeros((3, 3)), capacity)

    def pose(self) -> PoseEstimate:
        """Pose in the world: N(x0, P0) composed with the local estimate, to first order.

        Implements :eq:`eq-anchored`.
        """
        start, local = self._start, super().pose()
        at = observation.world_from_vehicle_with_jacobians(start.mean, local.mean[:, :2])
        J_0, J_l = np.zeros_like(start.cov), np.zeros_like(start.cov)
        J_0[:, :2], J_0[:, 2, 2] = at.J_pose, 1.0
        J_l[:, :2, :2], J_l[:, 2, 2] = at.J_measurement, 1.0
        cov = J_0 @ start.cov @ transpose(J_0) + J_l @ local.cov @ transpose(J_l)  # eq-anchored
        return PoseEstimate(se2.compose(start.mean, local.mean), cov)

    def landmarks(self) -> MapEstimate:
        """The map in the world frame, the start's uncertainty composed to first order."""
        start, local = self._start, super().landmarks()
        at = observation.world_from_vehicle_with_jacobians(start.mean[:, None], local.mean)
        cov = at.J_pose @ start.cov[:, None] @ transpose(at.J_pose)
        cov += at.J_measurement @ local.cov @ transpose(at.J_measurement)
        return MapEstimate(local.ids, at.value, cov)
