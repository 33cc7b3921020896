"""The lifted form of seed B's filter: B16-B28 with the whole covariance of 11 + 6 n states.

::

    z <- M(U) z                          M = diag(M_R (11 x 11), M_L, M_L, ... (6 x 6)), B16 and B18
    P <- M P M^T + J_U Q_U J_U^T         one Q_U for all blocks: B17 and B19 print the diagonal blocks
    measurement: H constant, B22;        new landmark: B26-B28

The landmark part of P is needed at measurements only.  So a prediction multiplies the accumulated M
and keeps its noise as columns of a factor N, M <- M_k M and N <- [M_k N, J_U sqrt(Q_U)]; when a
measurement arrives, P <- M P M^T + N N^T is applied once.  That is the same product of the same
matrices.  The vehicle block is kept current at every step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray, transpose
from vslam_ref.filters.block_covariance import diagonal_blocks, innovation_root
from vslam_ref.filters.carleman_ekf import lift, moments
from vslam_ref.filters.estimates import (
    Innovation,
    MapEstimate,
    PoseEstimate,
    SlamFilter,
    as_batch,
    checked_moments,
    heading_vector_pose,
)
from vslam_ref.filters.vehicle import Increment

_R = slice(0, lift.VEHICLE)
_L = slice(lift.VEHICLE, None)
_LONGEST_ACCUMULATION = 32
"""Predictions after which P is brought up to date without a measurement: each one moves all columns of N."""


class LiftedCarlemanEkf(SlamFilter):
    """Seed B's improved EKF in its lifted states, for a batch of runs.

    Parameters
    ----------
    mean, cov : array_like, shapes (3,) or (B, 3), and (3, 3) or (B, 3, 3)
        Start pose (x, y, theta) in the world and its covariance.
    capacity : int
        Landmarks to make room for at first.
    start, control : {"first_order", "gaussian"}
        How P0 and the control noise are lifted; see :mod:`vslam_ref.filters.carleman_ekf.moments`.
    variant : Variant
        Errata to run as printed.
    """

    def __init__(
        self,
        mean: ArrayLike,
        cov: ArrayLike,
        capacity: int = 32,
        start: str = "first_order",
        control: str = "first_order",
        variant: lift.Variant = lift.AS_CORRECTED,
    ) -> None:
        z, P = moments.lifted_start(*as_batch(mean, cov), start)
        self.control = checked_moments("control", control)
        self.variant = variant
        room = lift.VEHICLE + lift.LANDMARK * capacity
        self._z, self._P = np.zeros((len(z), room)), np.zeros((len(z), room, room))
        self._z[:, _R], self._P[:, _R, _R] = z, P
        self._slots: dict[int, int] = {}
        self.runs = len(z)
        self._start_accumulation()

    @classmethod
    def from_state(cls, z: Array, P: Array, control: str = "first_order") -> LiftedCarlemanEkf:
        """A filter in the middle of a run, with landmarks 0 ... n - 1 in its map.

        ``z`` (B, 11 + 6 n) and ``P`` (B, 11 + 6 n, 11 + 6 n) are as from :meth:`state`; they are copied.
        """
        n = (z.shape[1] - lift.VEHICLE) // lift.LANDMARK
        slam = cls(np.zeros((len(z), 3)), np.zeros((3, 3)), capacity=n, control=control)
        slam._z, slam._P = z.copy(), P.copy()
        slam._slots = {i: i for i in range(n)}
        return slam

    @property
    def size(self) -> int:
        """Lifted states in use, 11 + 6 n."""
        return lift.VEHICLE + lift.LANDMARK * len(self._slots)

    def state(self) -> tuple[Array, Array]:
        """Lifted mean (B, 11 + 6 n) and covariance (B, 11 + 6 n, 11 + 6 n), brought up to date; copies.

        Implements :eq:`eq-b12` and :eq:`eq-b13` (B12, B13), the six states of a landmark side by side.
        """
        self._apply_accumulated()
        return self._z[:, : self.size].copy(), self._P[:, : self.size, : self.size].copy()

    # -- prediction ------------------------------------------------------------------------------

    def _start_accumulation(self) -> None:
        B = len(self._z)
        self._M_R = np.tile(np.eye(lift.VEHICLE), (B, 1, 1))
        self._M_L = np.tile(np.eye(lift.LANDMARK), (B, 1, 1))
        self._N: list[Array] = []

    def predict(self, increment: Increment) -> None:
        """Move by an increment.

        Implements :eq:`eq-b16`, :eq:`eq-b17`, :eq:`eq-b18` and :eq:`eq-b19` (B16-B19).
        """
        w = moments.control_moments(increment, self.control, self.variant.product_of_means)
        M_R, M_L = lift.vehicle_matrix(w.mean), lift.landmark_matrix(w.mean, self.variant)
        z, P_RR = self._z[:, : self.size, None], self._P[:, _R, _R]
        noise = lift.control_jacobian(z[:, :, 0], self.variant) @ w.factor
        z[...] = self._move(M_R, M_L, z)  # eq-b16, eq-b18
        P_RR[...] = M_R @ P_RR @ transpose(M_R) + noise[:, _R] @ transpose(noise[:, _R])  # eq-b17
        self._N = [*(self._move(M_R, M_L, N) for N in self._N), noise]
        self._M_R, self._M_L = M_R @ self._M_R, M_L @ self._M_L
        if len(self._N) >= _LONGEST_ACCUMULATION:
            self._apply_accumulated()

    @staticmethod
    def _move(M_R: Array, M_L: Array, X: Array) -> Array:
        """Product diag(M_R, M_L, ...) X for X (B, 11 + 6 n, r)."""
        B, size, r = X.shape
        blocks = M_L[:, None] @ X[:, _L].reshape(B, -1, lift.LANDMARK, r)
        return np.concatenate([M_R @ X[:, _R], blocks.reshape(B, size - lift.VEHICLE, r)], 1)

    def _apply_accumulated(self) -> None:
        """P <- M P M^T + N N^T for all blocks but the vehicle's own, which is current."""
        if not self._N:
            return
        P = self._P[:, : self.size, : self.size]
        P_RR, N = P[:, _R, _R].copy(), np.concatenate(self._N, 2)
        rows = self._move(self._M_R, self._M_L, P)
        P[...] = transpose(self._move(self._M_R, self._M_L, transpose(rows)))
        noise = N @ transpose(N)
        if not self.variant.cross_noise:  # each landmark's own block only
            owner = np.arange(self.size - lift.VEHICLE) // lift.LANDMARK
            noise[:, _L, _L] *= owner[:, None] == owner
            noise[:, _R, _L] = noise[:, _L, _R] = 0.0
        P += noise  # eq-b19, eq-cross-blocks
        P[:, _R, _R] = P_RR
        self._start_accumulation()

    # -- measurement -----------------------------------------------------------------------------

    def _columns(self, ids: IntArray) -> IntArray:
        return np.array([self._slots.get(i, -1) for i in ids.tolist()], dtype=np.int64)

    def _expected(self, slots: IntArray, z: Array, cov_z: Array) -> tuple[Innovation, Array]:
        """Innovation and S with the constant H, and H P. Implements :eq:`eq-b22` (B22)."""
        self._apply_accumulated()
        (B, m, _), state, P = z.shape, self._z[:, : self.size], self._P[:, : self.size, : self.size]
        H = lift.measurement_matrix(slots, len(self._slots))
        HP = H @ P
        S = HP @ H.T
        diagonal_blocks(S)[...] += cov_z
        return Innovation(z.reshape(B, 2 * m) - state @ H.T, (S + transpose(S)) / 2), HP

    def _innovation(self, slots: IntArray, z: Array, cov_z: Array) -> Innovation:
        return self._expected(slots, z, cov_z)[0]

    def _update_known(self, slots: IntArray, z: Array, cov_z: Array, gate: float) -> Innovation:
        """Kalman update of all lifted states. Implements :eq:`eq-gain`."""
        seen, HP = self._expected(slots, z, cov_z)
        root = innovation_root(seen.S)
        G = np.asarray(np.linalg.solve(root, HP), dtype=np.float64)
        y = np.linalg.solve(root, seen.innovation[:, :, None])
        G[np.sum(y[:, :, 0] ** 2, 1) > gate] = 0.0
        self._z[:, : self.size] += (transpose(G) @ y)[:, :, 0]  # eq-gain
        self._P[:, : self.size, : self.size] -= transpose(G) @ G
        return seen

    def _augment(self, ids: IntArray, z: Array, cov_z: Array) -> None:
        """Add landmarks one by one: the covariances of a pair come from the first one's block."""
        self._apply_accumulated()
        for j, identity in enumerate(ids.tolist()):
            self._append(identity, z[:, j], cov_z[j])

    def _append(self, identity: int, z: Array, cov_z: Array) -> None:
        """Add a landmark. Implements :eq:`eq-b26`, :eq:`eq-b27` and :eq:`eq-b28` (B26-B28)."""
        old = self.size
        if old + lift.LANDMARK > self._z.shape[1]:
            more = (0, max(lift.LANDMARK, self._z.shape[1] - lift.VEHICLE))
            self._z = np.pad(self._z, ((0, 0), more))
            self._P = np.pad(self._P, ((0, 0), more, more))
        G_3, G_new = lift.placement_matrices(self._z[:, _R], z, self.variant)
        new = slice(old, old + lift.LANDMARK)
        cross = G_3 @ self._P[:, _R, :old]
        self._z[:, new] = (G_3 @ self._z[:, _R, None])[:, :, 0]
        self._P[:, new, :old] = cross
        self._P[:, :old, new] = transpose(cross)
        own = cross[:, :, _R] @ transpose(G_3) + G_new @ cov_z @ transpose(G_new)
        self._P[:, new, new] = (own + transpose(own)) / 2
        self._slots[identity] = len(self._slots)

    # -- output ----------------------------------------------------------------------------------

    def pose(self) -> PoseEstimate:
        """(x, y, atan2(z3, z4)) as in B§4.1, and its covariance to first order."""
        return heading_vector_pose(self._z[:, :4], self._P[:, :4, :4])

    def landmarks(self) -> MapEstimate:
        """The map in the world frame: z_i1 and z_i2 with their covariances."""
        z, P = self.state()
        ids, own = np.fromiter(self._slots, dtype=np.int64), diagonal_blocks(P[:, _L, _L], lift.LANDMARK)
        return MapEstimate(ids, z[:, _L].reshape(len(z), -1, lift.LANDMARK)[:, :, :2], own[:, :, :2, :2])
