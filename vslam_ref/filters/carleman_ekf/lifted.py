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

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters.carleman_ekf import lift, moments
from vslam_ref.filters.estimates import Innovation, MapEstimate, PoseEstimate, as_batch, checked_measurement
from vslam_ref.filters.vehicle import Increment

_R = slice(0, lift.VEHICLE)
_L = slice(lift.VEHICLE, None)
_LONGEST_ACCUMULATION = 32
"""Predictions after which P is brought up to date without a measurement: each one moves all columns of N."""


class LiftedCarlemanEkf:
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
        self.control = moments.check_kind("control", control)
        self.variant = variant
        room = lift.VEHICLE + lift.LANDMARK * capacity
        self._z, self._P = np.zeros((len(z), room)), np.zeros((len(z), room, room))
        self._z[:, _R], self._P[:, _R, _R] = z, P
        self._slots: dict[int, int] = {}
        self._start_accumulation()

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
        self._steps = 0

    def predict(self, increment: Increment) -> None:
        """Move by an increment.

        Implements :eq:`eq-b16`, :eq:`eq-b17`, :eq:`eq-b18` and :eq:`eq-b19` (B16-B19).
        """
        w = moments.control_moments(increment, self.control, self.variant.product_of_means)
        M_R, M_L = lift.vehicle_matrix(w.mean), lift.landmark_matrix(w.mean, self.variant)
        noise = self._noise_factor(w.factor)
        z, n = self._z[:, : self.size], len(self._slots)
        B = len(z)
        z[:, _R] = np.einsum("bij,bj->bi", M_R, z[:, _R])
        z[:, _L] = np.einsum("bij,bnj->bni", M_L, z[:, _L].reshape(B, n, lift.LANDMARK)).reshape(B, -1)
        P_RR = self._P[:, _R, _R]
        self._P[:, _R, _R] = M_R @ P_RR @ M_R.swapaxes(1, 2) + noise[:, _R] @ noise[:, _R].swapaxes(1, 2)
        self._N = [self._move(M_R, M_L, N) for N in self._N]
        self._N.append(noise)
        self._M_R, self._M_L = M_R @ self._M_R, M_L @ self._M_L
        self._steps += 1
        if self._steps >= _LONGEST_ACCUMULATION:
            self._apply_accumulated()

    def _noise_factor(self, factor: Array) -> Array:
        """J_U sqrt(Q_U), shape (B, 11 + 6 n, r): each monomial's matrix applied to the mean."""
        z = self._z[:, : self.size]
        matrices = (
            lift.LANDMARK_MATRICES_AS_PRINTED if self.variant.b18_as_printed else lift.LANDMARK_MATRICES
        )
        J_R = np.einsum("kij,bj->bik", lift.VEHICLE_MATRICES[1:], z[:, _R])
        landmarks = z[:, _L].reshape(len(z), -1, lift.LANDMARK)
        J_L = np.einsum("kij,bnj->bnik", matrices[1:], landmarks).reshape(len(z), -1, len(lift.MONOMIALS) - 1)
        return np.concatenate([J_R, J_L], 1) @ factor

    @staticmethod
    def _move(M_R: Array, M_L: Array, X: Array) -> Array:
        """Product diag(M_R, M_L, ...) X for X (B, 11 + 6 n, r)."""
        blocks = X[:, _L].reshape(len(X), -1, lift.LANDMARK, X.shape[2])
        return np.concatenate([M_R @ X[:, _R], (M_L[:, None] @ blocks).reshape(len(X), -1, X.shape[2])], 1)

    def _apply_accumulated(self) -> None:
        """P <- M P M^T + N N^T for all blocks but the vehicle's own, which is current."""
        if self._steps == 0:
            return
        P = self._P[:, : self.size, : self.size]
        P_RR = P[:, _R, _R].copy()
        rows = self._move(self._M_R, self._M_L, P)
        P[:] = self._move(self._M_R, self._M_L, rows.swapaxes(1, 2)).swapaxes(1, 2)
        N = np.concatenate(self._N, 2)
        if self.variant.cross_noise:
            P += N @ N.swapaxes(1, 2)
        else:
            N_L = N[:, _L].reshape(len(N), -1, lift.LANDMARK, N.shape[2])
            for i, block in enumerate((N_L @ N_L.swapaxes(2, 3)).swapaxes(0, 1)):
                at = slice(lift.VEHICLE + lift.LANDMARK * i, lift.VEHICLE + lift.LANDMARK * (i + 1))
                P[:, at, at] += block
        P[:, _R, _R] = P_RR
        self._start_accumulation()

    # -- measurement -----------------------------------------------------------------------------

    def update(self, ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike) -> Innovation | None:
        """Update with landmarks of the map, then add the new ones; as :meth:`EkfSlam.update`."""
        ids, z, cov_z = checked_measurement(ids, z, cov_z, len(self._z))
        self._apply_accumulated()
        known = np.fromiter((int(i) in self._slots for i in ids), dtype=bool, count=len(ids))
        seen = self._update_known(ids[known], z[:, known], cov_z[known]) if known.any() else None
        for j in np.flatnonzero(~known):
            self._augment(int(ids[j]), z[:, j], cov_z[j])
        return seen

    def _update_known(self, ids: IntArray, z: Array, cov_z: Array) -> Innovation:
        """Kalman update with the constant H. Implements :eq:`eq-b22` (B22)."""
        state, P = self._z[:, : self.size], self._P[:, : self.size, : self.size]
        H = lift.measurement_matrix([self._slots[int(i)] for i in ids], len(self._slots))
        innovation = z.reshape(len(z), -1) - state @ H.T
        HP = H @ P
        noise = np.zeros((len(H), len(H)))
        for j, cov in enumerate(cov_z):
            noise[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = cov
        S = HP @ H.T + noise
        S = (S + S.swapaxes(1, 2)) / 2
        root = np.linalg.cholesky(S)
        G = np.linalg.solve(root, HP)
        state += np.einsum("bki,bk->bi", G, np.linalg.solve(root, innovation[:, :, None])[:, :, 0])
        P -= G.swapaxes(1, 2) @ G
        return Innovation(innovation, S)

    def _augment(self, identity: int, z: Array, cov_z: Array) -> None:
        """Add a landmark. Implements :eq:`eq-b26`, :eq:`eq-b27` and :eq:`eq-b28` (B26-B28)."""
        old = self.size
        if old + lift.LANDMARK > self._z.shape[1]:
            more = max(lift.LANDMARK, self._z.shape[1] - lift.VEHICLE)
            self._z = np.pad(self._z, ((0, 0), (0, more)))
            self._P = np.pad(self._P, ((0, 0), (0, more), (0, more)))
        G_3, G_new = lift.placement_matrices(self._z[:, _R], z, self.variant)
        new = slice(old, old + lift.LANDMARK)
        cross = G_3 @ self._P[:, _R, :old]
        self._z[:, new] = np.einsum("bij,bj->bi", G_3, self._z[:, _R])
        self._P[:, new, :old] = cross
        self._P[:, :old, new] = cross.swapaxes(1, 2)
        own = cross[:, :, _R] @ G_3.swapaxes(1, 2) + G_new @ cov_z @ G_new.swapaxes(1, 2)
        self._P[:, new, new] = (own + own.swapaxes(1, 2)) / 2
        self._slots[identity] = len(self._slots)

    # -- output ----------------------------------------------------------------------------------

    def pose(self) -> PoseEstimate:
        """(x, y, atan2(z3, z4)) as in B§4.1, and its covariance to first order."""
        z = self._z[:, :4]
        mean = np.stack([z[:, 0], z[:, 1], np.arctan2(z[:, 2], z[:, 3])], -1)
        J = np.zeros((len(z), 3, 4))
        J[:, 0, 0] = J[:, 1, 1] = 1.0
        J[:, 2, 2:] = np.stack([z[:, 3], -z[:, 2]], -1) / (z[:, 2:3] ** 2 + z[:, 3:4] ** 2)
        return PoseEstimate(mean, J @ self._P[:, :4, :4] @ J.swapaxes(1, 2))

    def landmarks(self) -> MapEstimate:
        """The map in the world frame: z_i1 and z_i2 with their covariances."""
        z, P = self.state()
        at = lift.VEHICLE + lift.LANDMARK * np.arange(len(self._slots))
        pair = at[:, None] + np.arange(2)
        ids = np.fromiter(self._slots, dtype=np.int64, count=len(self._slots))
        return MapEstimate(ids, z[:, pair], P[:, pair[:, :, None], pair[:, None, :]])
