"""The reduced form of seed B's filter: the same pose estimates from 4 + 2 n states.

With a = zi4 + zi5, b = zi6 - zi3 (the landmark in the vehicle's axes), p = z8 + z9, q = z10 - z7 and
w = z5 + z6 = 1, the differences r_i = (a_i - p, b_i - q), *the landmark in the vehicle frame*, and
(x, y, sin, cos) are closed under B16, B18, B22 and B26: chapter 16 proves it.  Written with complex
numbers, position p = x + iy, heading h = cos + i sin, landmark r, control m = exp(-i dalpha) and
t = ds m::

    p <- p + ds h        h <- h conj(m)        r <- m r - t        z = r + noise        r_new = z

A prediction turns every landmark.  Turns compose, so they are not applied: with the accumulated
c <- m c and tau <- m tau + t every landmark is r = c rho - tau, where *rho does not change*.  Only the
noise does:  d rho = A rho + g,  A = dm / m,  g = -(dm tau + dt) / c.  The numbers A and g are common
to all landmarks, so ten predictions leave a noise of rank four, applied once when a measurement
arrives.  A prediction then costs O(1), a measurement O(k n^2).

Increments compose as well.  They are put down, up to ``WAITING`` of them, and used together when a
measurement arrives or the pose is asked for: what they do is a handful of sums and products over them.

``with_map=True`` carries each landmark's world coordinates too, 4 + 4 n states.
"""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters.block_covariance import Blocks
from vslam_ref.filters.carleman_ekf.reduced_moments import control_gaussian, start_moments
from vslam_ref.filters.carleman_ekf.reduced_step import (
    as_matrix,
    reduced_apply,
    reduced_predict,
    reduced_predict_first_order,
    reduced_update,
)
from vslam_ref.filters.estimates import (
    Innovation,
    MapEstimate,
    PoseEstimate,
    as_batch,
    checked_measurement,
    diagonal_blocks,
    room_for_innovation,
)
from vslam_ref.filters.vehicle import Increment

WAITING = 16
"""Increments put down before they are used at the latest."""
_CONTROL = ("first_order", "gaussian")


class ReducedCarlemanEkf:
    """Seed B's improved EKF in reduced states, for a batch of runs.

    Parameters
    ----------
    mean, cov : array_like, shapes (3,) or (B, 3), and (3, 3) or (B, 3, 3)
        Start pose (x, y, theta) in the world and its covariance.
    capacity : int
        Landmarks to make room for at first.
    start, control : {"first_order", "gaussian"}
        How P0 and the control noise are lifted.
    with_map : bool
        Carry world coordinates of the landmarks too (the lifted filter's map, to rounding).
    """

    def __init__(
        self,
        mean: ArrayLike,
        cov: ArrayLike,
        capacity: int = 32,
        start: str = "first_order",
        control: str = "first_order",
        with_map: bool = False,
    ) -> None:
        if control not in _CONTROL:
            raise ValueError(f"control={control!r}: must be one of {', '.join(_CONTROL)}")
        x, P = start_moments(*as_batch(mean, cov), start)
        self._first_order = control == "first_order"
        self.with_map = with_map
        self._blocks = Blocks(x, P, landmark_states=4 if with_map else 2, capacity=capacity)
        self._frame = np.tile(np.array([1.0, 0.0, 0.0, 1.0], dtype=np.complex128), (len(x), 1))
        self._P_a = np.zeros((len(x), 8, 8))
        self._P_a[:, :4, :4] = P
        self._blocks.P_pp = self._P_a[:, :4, :4]
        sizes = (len(x), WAITING)
        self._waiting = Increment(np.empty(sizes), np.empty(sizes), np.empty((*sizes, 2, 2)))
        self._waits = 0

    def __deepcopy__(self, memo: dict[int, object]) -> ReducedCarlemanEkf:
        """Copy the arrays, and let the copy's pose covariance be a part of its own augmented one."""
        twin = copy.copy(self)
        twin._blocks = copy.deepcopy(self._blocks)
        twin._frame, twin._P_a = self._frame.copy(), self._P_a.copy()
        twin._blocks.P_pp = twin._P_a[:, :4, :4]
        twin._waiting = Increment(*(part.copy() for part in self._waiting))
        return twin

    @property
    def blocks(self) -> Blocks:
        """Mean and covariance; all increments so far are in the pose's blocks."""
        self._settle()
        return self._blocks

    def predict(self, increment: Increment) -> None:
        """Move by an increment, in O(1). The reduced :eq:`eq-b16` (B16) and B18."""
        ds, dalpha, cov = self._waiting
        ds[:, self._waits], dalpha[:, self._waits], cov[:, self._waits] = increment
        self._waits += 1
        if self._waits == WAITING:
            self._settle()

    def _settle(self) -> None:
        """Use the increments that wait."""
        k, self._waits = self._waits, 0
        if k == 0:
            return
        ds, dalpha, cov = (part[:, :k] for part in self._waiting)
        state = self._blocks.x_p, self._P_a, self._frame
        if self._first_order:
            reduced_predict_first_order(*state, ds, dalpha, cov)
        else:
            mean, noise = control_gaussian(Increment(ds.ravel(), dalpha.ravel(), cov.reshape(-1, 2, 2)))
            reduced_predict(*state, mean.reshape(-1, k, 5), noise.reshape(-1, k, 5, 5))

    def _apply(self) -> None:
        b = self.blocks
        reduced_apply(b.x_m, b.P_pm, b.P_mm, b.b, self._P_a, self._frame)

    def update(self, ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike) -> Innovation | None:
        """Update with landmarks of the map, then add the new ones; as :meth:`EkfSlam.update`."""
        ids, z, cov_z = checked_measurement(ids, z, cov_z, len(self._blocks.x_p))
        columns = self.blocks.columns(ids)
        known = columns >= 0
        if len(ids) and known.all():
            return self._update_known(columns, z, cov_z)
        seen = None
        if known.any():
            seen = self._update_known(columns[known], z[:, known], cov_z[known])
        else:
            self._apply()
        if len(ids):
            self._augment(ids[~known], z[:, ~known], cov_z[~known])
        return seen

    def _update_known(self, columns: IntArray, z: Array, cov_z: Array) -> Innovation:
        """Use z = c rho - tau + noise: the reduced :eq:`eq-b22` (B22)."""
        b, seen = self.blocks, room_for_innovation(z)
        state = b.x_p, b.x_m, b.P_pm, b.P_mm, b.b, self._P_a, self._frame
        reduced_update(*state, columns, z, cov_z, *seen)
        return seen

    def _augment(self, ids: IntArray, z: Array, cov_z: Array) -> None:
        """r_new = z, uncorrelated with everything; its world place p + h z, when carried, is not."""
        b = self.blocks
        B, m = z.shape[:2]
        c, tau = self._frame[:, 0:1], self._frame[:, 1:2]
        zc = z[..., 0] + 1j * z[..., 1]
        rho = (zc + tau) / c
        mean, J_z = np.zeros((B, m, b.b)), np.zeros((B, m, b.b, 2))
        mean[..., 0], mean[..., 1] = rho.real, rho.imag
        J_z[:, :, :2] = as_matrix(1 / c)
        J_pose = np.zeros((B, m, b.b, 4))
        if self.with_map:
            h = b.x_p[:, 3:4] + 1j * b.x_p[:, 2:3]
            place = b.x_p[:, 0:1] + 1j * b.x_p[:, 1:2] + h * zc
            mean[..., 2], mean[..., 3] = place.real, place.imag
            J_z[:, :, 2:] = as_matrix(h)
            J_pose[:, :, 2, 0] = J_pose[:, :, 3, 1] = 1.0
            J_pose[:, :, 2, 2], J_pose[:, :, 2, 3] = -z[..., 1], z[..., 0]
            J_pose[:, :, 3, 2], J_pose[:, :, 3, 3] = z[..., 0], z[..., 1]
        G = J_pose.reshape(B, m * b.b, 4)
        cov = G @ b.P_pp @ G.swapaxes(1, 2)
        noise = J_z @ cov_z @ J_z.swapaxes(2, 3)
        for j in range(m):
            cov[:, b.b * j : b.b * (j + 1), b.b * j : b.b * (j + 1)] += noise[:, j]
        cross_map = b.P_pm.swapaxes(1, 2) @ G.swapaxes(1, 2)
        b.append(ids, mean.reshape(B, -1), cov, b.P_pp @ G.swapaxes(1, 2), cross_map)

    def pose(self) -> PoseEstimate:
        """(x, y, atan2(sin, cos)) as in B§4.1, and its covariance to first order."""
        x, y, s, c = self.blocks.x_p.T
        J = np.zeros((len(x), 3, 4))
        J[:, 0, 0] = J[:, 1, 1] = 1.0
        J[:, 2, 2], J[:, 2, 3] = c / (s * s + c * c), -s / (s * s + c * c)
        cov = J @ self.blocks.P_pp @ J.swapaxes(1, 2)
        return PoseEstimate(np.stack([x, y, np.arctan2(s, c)], -1), cov)

    def landmarks(self) -> MapEstimate:
        """The map in the world frame; needs ``with_map=True``.

        Raises
        ------
        ValueError
            Without the map's states: z_i1 and z_i2 are no functions of the 4 + 2 n reduced states.
        """
        if not self.with_map:
            raise ValueError("this filter carries no map: build it with with_map=True (form='reduced-map')")
        self._apply()
        b = self.blocks
        mean = b.x_m.reshape(len(b.x_p), -1, 4)[:, :, 2:].copy()
        return MapEstimate(b.ids, mean, diagonal_blocks(b.P_mm, 4, 4)[:, :, 2:, 2:])
