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

``with_map=True`` carries each landmark's world coordinates too, 4 + 4 n states; without them the map is
composed from pose and r_i when it is asked for (``landmarks(readout="composed")``).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray, transpose
from vslam_ref.filters.block_covariance import Blocks, diagonal_blocks
from vslam_ref.filters.carleman_ekf.composition import compose_first_order, compose_gaussian
from vslam_ref.filters.carleman_ekf.reduced_moments import control_gaussian, start_moments
from vslam_ref.filters.carleman_ekf.reduced_step import (
    as_matrix,
    reduced_apply_in_place,
    reduced_expected,
    reduced_predict_first_order_in_place,
    reduced_predict_in_place,
    reduced_update_in_place,
)
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

WAITING = 16
"""Increments put down before they are used at the latest."""

READOUTS = ("lifted", "composed", "composed_gaussian")


class ReducedCarlemanEkf(SlamFilter):
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
        x, P = start_moments(*as_batch(mean, cov), checked_moments("start", start))
        self._first_order = checked_moments("control", control) == "first_order"
        self.with_map = with_map
        self._blocks = Blocks(x, P, landmark_states=4 if with_map else 2, capacity=capacity)
        self._frame = np.tile(np.array([1.0, 0.0, 0.0, 1.0], dtype=np.complex128), (len(x), 1))
        self._P_a = np.zeros((len(x), 8, 8))
        self._P_a[:, :4, :4] = P
        sizes = (len(x), WAITING)
        self._waiting = Increment(np.empty(sizes), np.empty(sizes), np.empty((*sizes, 2, 2)))
        self._waits = 0
        self.runs = len(x)
        self._noisy = False  # whether P_a holds noise that the map has not had yet

    @property
    def blocks(self) -> Blocks:
        """Mean and covariance; all increments so far are in the pose's blocks."""
        self._settle()
        state = self._blocks.state
        if state.P_pp.base is not self._P_a:  # after an append, and in a copy
            self._blocks.state = state._replace(P_pp=self._P_a[:, :4, :4])
        return self._blocks

    def state(self) -> tuple[Array, Array]:
        """Mean (B, 4 + 2 n) and covariance of (x, y, sin, cos, r_1, ..., r_n), copies.

        Implements :eq:`eq-reduction-map`: r_i = c rho_i - tau is the landmark in the vehicle frame.
        """
        b, (c, tau) = self._applied(), self._frame.T[:2]
        mean, cov = b.full()
        own = np.arange(4 + b.b * b.n)
        kept = own[(own < 4) | ((own - 4) % b.b < 2)]  # without the map's world coordinates
        mean, cov = mean[:, kept], cov[:, kept[:, None], kept]
        turn = np.tile(np.eye(len(kept)), (len(mean), 1, 1))
        for at in range(4, len(kept), 2):
            turn[:, at : at + 2, at : at + 2] = as_matrix(c)
        mean = (turn @ mean[:, :, None])[:, :, 0]
        mean[:, 4::2] -= tau.real[:, None]
        mean[:, 5::2] -= tau.imag[:, None]
        return mean, turn @ cov @ transpose(turn)

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
        self._noisy = True
        ds, dalpha, cov = (part[:, :k] for part in self._waiting)
        state = self._blocks.x_p, self._P_a, self._frame
        if self._first_order:
            reduced_predict_first_order_in_place(*state, ds, dalpha, cov)
        else:
            mean, noise = control_gaussian(Increment(ds.ravel(), dalpha.ravel(), cov.reshape(-1, 2, 2)))
            reduced_predict_in_place(*state, mean.reshape(-1, k, 5), noise.reshape(-1, k, 5, 5))

    def _applied(self) -> Blocks:
        """Mean and covariance; all increments so far are in the map's blocks, too."""
        b = self.blocks
        if self._noisy:
            reduced_apply_in_place(b.state, b.b, self._P_a, self._frame)
            self._noisy = False
        return b

    def _columns(self, ids: IntArray) -> IntArray:
        return self._blocks.columns(ids)

    def _innovation(self, columns: IntArray, z: Array, cov_z: Array) -> Innovation:
        seen = reduced_expected(self._applied().state, self._frame, columns, z, cov_z)
        return Innovation(seen.innovation, seen.S)

    def _update_known(self, columns: IntArray, z: Array, cov_z: Array, gate: float) -> Innovation:
        b = self.blocks
        noise = b.b, self._P_a, self._frame
        seen = Innovation(*reduced_update_in_place(b.state, *noise, columns, z, cov_z, gate))
        self._noisy = False  # not before: a singular S leaves the noise where it is
        return seen

    def _augment(self, ids: IntArray, z: Array, cov_z: Array) -> None:
        """r_new = z, uncorrelated with everything; its world place p + h z, when carried, is not."""
        b = self._applied()
        (B, m, _), (x, y, sin, cos) = z.shape, b.x_p.T[:, :, None]
        c, tau = self._frame[:, 0:1], self._frame[:, 1:2]
        zc, h = z[..., 0] + 1j * z[..., 1], cos + 1j * sin
        rho, place = (zc + tau) / c, x + 1j * y + h * zc  # eq-complex-filter: r_new = z
        mean = np.stack([rho.real, rho.imag, place.real, place.imag], -1)
        G, J_z = np.zeros((B, m, 4, 4)), np.zeros((B, m, 4, 2))
        J_z[:, :, :2], J_z[:, :, 2:] = as_matrix(1 / c), as_matrix(h)
        G[:, :, 2, 0] = G[:, :, 3, 1] = 1.0
        G[:, :, 2, 2], G[:, :, 2, 3] = -z[..., 1], z[..., 0]
        G[:, :, 3, 2], G[:, :, 3, 3] = z[..., 0], z[..., 1]
        kept = b.b  # without the map, the first two of four states
        noise = J_z[:, :, :kept] @ cov_z @ transpose(J_z[:, :, :kept])
        b.append(ids, mean[..., :kept].reshape(B, -1), G[:, :, :kept].reshape(B, m * kept, 4), noise)

    def pose(self) -> PoseEstimate:
        """(x, y, atan2(sin, cos)) as in B§4.1, and its covariance to first order."""
        b = self.blocks
        return heading_vector_pose(b.x_p, b.P_pp)

    def landmarks(self, readout: str = "lifted") -> MapEstimate:
        """The map in the world frame.

        Parameters
        ----------
        readout : {"lifted", "composed", "composed_gaussian"}
            The states z_i1 and z_i2, which need ``with_map=True``; or p + R(theta) r_i of any reduced
            filter, to first order or with the exact moments of a Gaussian.

        Raises
        ------
        ValueError
            On another name; and for the lifted map without the map's states: z_i1 and z_i2 are no functions
            of the 4 + 2 n reduced states.
        """
        if readout not in READOUTS:
            raise ValueError(f"readout={readout!r}: must be one of {', '.join(READOUTS)}")
        if readout != "lifted":
            return self._composed(compose_first_order if readout == "composed" else compose_gaussian)
        if not self.with_map:
            raise ValueError(
                "this filter carries no map: build it with with_map=True (form='reduced-map'), "
                "or read readout='composed'"
            )
        b = self._applied()
        mean = b.x_m.reshape(len(b.x_p), -1, 4)[:, :, 2:].copy()
        return MapEstimate(b.ids, mean, diagonal_blocks(b.P_mm, 4)[:, :, 2:, 2:].copy())

    def _composed(self, compose: Callable[[Array, Array, Array], tuple[Array, Array]]) -> MapEstimate:
        """The map composed from pose and r_i = c rho_i - tau."""
        b, (c, tau) = self._applied(), self._frame.T[:2, :, None]
        turn, (x, y, s, h) = as_matrix(c), b.x_p.T
        to_pose = np.zeros((len(b.x_p), 1, 3, 4))
        to_pose[:, 0, 0, 0] = to_pose[:, 0, 1, 1] = 1.0
        to_pose[:, 0, 2, 2], to_pose[:, 0, 2, 3] = h / (s * s + h * h), -s / (s * s + h * h)
        rho = b.x_m.reshape(len(x), -1, b.b)
        r = c * (rho[..., 0] + 1j * rho[..., 1]) - tau
        P_pr = b.P_pm.reshape(len(x), 4, -1, b.b).swapaxes(1, 2)[..., :2]
        P = np.empty((*r.shape, 5, 5))
        P[..., :3, :3] = to_pose @ b.P_pp[:, None] @ transpose(to_pose)
        P[..., :3, 3:] = to_pose @ P_pr @ transpose(turn)
        P[..., 3:, :3] = transpose(P[..., :3, 3:])
        P[..., 3:, 3:] = turn @ diagonal_blocks(b.P_mm, b.b)[:, :, :2, :2] @ transpose(turn)
        pose = np.stack([x, y, np.arctan2(s, h)], -1)[:, None]
        return MapEstimate(b.ids, *compose(pose, P, np.stack([r.real, r.imag], -1)))
