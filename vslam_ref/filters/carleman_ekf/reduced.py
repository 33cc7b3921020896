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

``with_map=True`` carries each landmark's world coordinates too, 4 + 4 n states.
"""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.filters.block_covariance import Blocks, landmark_update
from vslam_ref.filters.carleman_ekf.reduced_moments import (
    control_first_order,
    control_gaussian,
    start_moments,
)
from vslam_ref.filters.estimates import (
    Innovation,
    MapEstimate,
    PoseEstimate,
    as_batch,
    checked_measurement,
    diagonal_blocks,
)
from vslam_ref.filters.vehicle import Increment

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
IntArray = NDArray[np.int64]


_CONTROL = ("first_order", "gaussian")


def _predict(x_p: Array, P_a: Array, frame: Complex, control: Array, cov: Array) -> None:
    """One prediction from the control's moments; see :func:`reduced_predict`."""
    ds, m, t = control[:, 0], control[:, 1] + 1j * control[:, 2], control[:, 3] + 1j * control[:, 4]
    c, tau = m * frame[:, 0], frame[:, 1]
    step = np.zeros((len(x_p), 4, 4))
    step[:, 0, 0] = step[:, 1, 1] = 1.0
    step[:, 0, 3] = step[:, 1, 2] = ds
    step[:, 2, 2] = step[:, 3, 3] = control[:, 1]
    step[:, 2, 3], step[:, 3, 2] = -control[:, 2], control[:, 2]
    # columns: what a unit noise in ds, Re m, Im m, Re t, Im t does to (x, y, sin, cos), to A and to g
    J = np.zeros((len(x_p), 8, 5))
    J[:, 0, 0], J[:, 1, 0] = x_p[:, 3], x_p[:, 2]
    J[:, 2, 1], J[:, 2, 2] = x_p[:, 2], -x_p[:, 3]
    J[:, 3, 1:3] = x_p[:, :1:-1]
    for row, column, factor in ((4, 1, 1 / m), (6, 1, -tau / c), (6, 3, -1 / c)):
        J[:, row, column], J[:, row, column + 1] = factor.real, -factor.imag
        J[:, row + 1, column], J[:, row + 1, column + 1] = factor.imag, factor.real
    x_p[:] = (step @ x_p[:, :, None])[:, :, 0]
    P_a[:, :4] = step @ P_a[:, :4]
    P_a[:, :, :4] = P_a[:, :, :4] @ step.swapaxes(1, 2)
    P_a += J @ cov @ J.swapaxes(1, 2)
    frame[:, 0], frame[:, 1] = c, m * tau + t
    frame[:, 2] += ds * frame[:, 3]
    frame[:, 3] *= m.conj()


@accelerated("reduced:reduced_predict")
def reduced_predict(x_p: Array, P_a: Array, frame: Complex, control: Array, cov: Array) -> None:
    """One prediction, in place, without touching a landmark.

    Implements :eq:`eq-b7`, :eq:`eq-b8`, :eq:`eq-b9`, :eq:`eq-b10` and :eq:`eq-b11` (B7-B11): ``step``
    is A, and the first four rows of ``J`` are J, its columns for (u1, u3, -u2).

    Parameters
    ----------
    x_p : ndarray, shape (B, 4)
        (x, y, sin, cos).
    P_a : ndarray, shape (B, 8, 8)
        Covariance of the pose states and of the noise (Re A, Im A, Re g, Im g) accumulated since the
        last measurement.
    frame : ndarray of complex, shape (B, 4)
        c and tau; and, since the last measurement, D and e with p <- p + D h, h <- e h.
    control, cov : ndarray, shapes (B, 5), (B, 5, 5)
        Moments of (ds, Re m, Im m, Re t, Im t).
    """
    _predict(x_p, P_a, frame, control, cov)


@accelerated("reduced:reduced_predict_first_order")
def reduced_predict_first_order(
    x_p: Array, P_a: Array, frame: Complex, ds: Array, dalpha: Array, cov: Array
) -> None:
    """:func:`reduced_predict` with the first-order moments of an increment ds, dalpha (B,), cov (B, 2, 2)."""
    _predict(x_p, P_a, frame, *control_first_order(Increment(ds, dalpha, cov)))


@accelerated("reduced:reduced_apply")
def reduced_apply(x_m: Array, P_pm: Array, P_mm: Array, b: int, P_a: Array, frame: Complex) -> None:
    """Apply the accumulated transition and noise to the map blocks, in place, and start afresh.

    P_pm <- Phi P_pm + N_pg E^T and P_mm <- P_mm + E N_gg E^T, where Phi is the pose transition of D
    and e, N_pg and N_gg are blocks of P_a, and the rows of E for a landmark rho say d rho = A rho + g.
    Each landmark has ``b`` map states, rho first.
    """
    B, M = x_m.shape
    E = np.zeros((B, M, 4))
    re, im = x_m[:, 0::b], x_m[:, 1::b]
    E[:, 0::b, 0], E[:, 0::b, 1], E[:, 0::b, 2] = re, -im, 1.0
    E[:, 1::b, 0], E[:, 1::b, 1], E[:, 1::b, 3] = im, re, 1.0
    phi = np.zeros((B, 4, 4))
    phi[:, 0, 0] = phi[:, 1, 1] = 1.0
    D, e = frame[:, 2], frame[:, 3]
    phi[:, 0, 3], phi[:, 0, 2], phi[:, 1, 3], phi[:, 1, 2] = D.real, -D.imag, D.imag, D.real
    phi[:, 3, 3], phi[:, 3, 2], phi[:, 2, 3], phi[:, 2, 2] = e.real, -e.imag, e.imag, e.real
    P_pm[:] = phi @ P_pm + P_a[:, :4, 4:] @ E.swapaxes(1, 2)
    P_mm += E @ P_a[:, 4:, 4:] @ E.swapaxes(1, 2)
    P_a[:, 4:, :] = 0.0
    P_a[:, :, 4:] = 0.0
    frame[:, 2], frame[:, 3] = 0.0, 1.0


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
        self.blocks = Blocks(x, P, landmark_states=4 if with_map else 2, capacity=capacity)
        self._frame = np.tile(np.array([1.0, 0.0, 0.0, 1.0], dtype=np.complex128), (len(x), 1))
        self._P_a = np.zeros((len(x), 8, 8))
        self._P_a[:, :4, :4] = self.blocks.P_pp
        self.blocks.P_pp = self._P_a[:, :4, :4]

    def __deepcopy__(self, memo: dict[int, object]) -> ReducedCarlemanEkf:
        """Copy the arrays, and let the copy's pose covariance be a part of its own augmented one."""
        twin = copy.copy(self)
        twin.blocks = copy.deepcopy(self.blocks)
        twin._frame, twin._P_a = self._frame.copy(), self._P_a.copy()
        twin.blocks.P_pp = twin._P_a[:, :4, :4]
        return twin

    def predict(self, increment: Increment) -> None:
        """Move by an increment, in O(1). The reduced :eq:`eq-b16` (B16) and B18."""
        if self._first_order:
            reduced_predict_first_order(self.blocks.x_p, self._P_a, self._frame, *increment)
        else:
            reduced_predict(self.blocks.x_p, self._P_a, self._frame, *control_gaussian(increment))

    def _apply(self) -> None:
        b = self.blocks
        reduced_apply(b.x_m, b.P_pm, b.P_mm, b.b, self._P_a, self._frame)

    def update(self, ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike) -> Innovation | None:
        """Update with landmarks of the map, then add the new ones; as :meth:`EkfSlam.update`."""
        ids, z, cov_z = checked_measurement(ids, z, cov_z, len(self.blocks.x_p))
        self._apply()
        known, new = self.blocks.split(ids)
        seen = self._update_known(ids[known], z[:, known], cov_z[known]) if len(known) else None
        if len(new):
            self._augment(ids[new], z[:, new], cov_z[new])
        return seen

    def _update_known(self, ids: IntArray, z: Array, cov_z: Array) -> Innovation:
        """Use z = c rho - tau + noise: the reduced :eq:`eq-b22` (B22)."""
        b = self.blocks
        columns = b.columns(ids)
        c, tau = self._frame[:, 0:1], self._frame[:, 1:2]
        predicted = c * (b.x_m[:, columns] + 1j * b.x_m[:, columns + 1]) - tau
        innovation = z - np.stack([predicted.real, predicted.imag], -1)
        H_l = np.broadcast_to(_as_matrix(c), (*z.shape, 2))
        H_p = np.zeros((*z.shape, 4))
        flat = innovation.reshape(len(z), -1)
        return Innovation(
            flat, landmark_update(b.x_p, b.x_m, b.P_pp, b.P_pm, b.P_mm, H_p, H_l, columns, flat, cov_z)
        )

    def _augment(self, ids: IntArray, z: Array, cov_z: Array) -> None:
        """r_new = z, uncorrelated with everything; its world place p + h z, when carried, is not."""
        b = self.blocks
        B, m = z.shape[:2]
        c, tau = self._frame[:, 0:1], self._frame[:, 1:2]
        zc = z[..., 0] + 1j * z[..., 1]
        rho = (zc + tau) / c
        mean, J_z = np.zeros((B, m, b.b)), np.zeros((B, m, b.b, 2))
        mean[..., 0], mean[..., 1] = rho.real, rho.imag
        J_z[:, :, :2] = _as_matrix(1 / c)
        J_pose = np.zeros((B, m, b.b, 4))
        if self.with_map:
            h = b.x_p[:, 3:4] + 1j * b.x_p[:, 2:3]
            place = b.x_p[:, 0:1] + 1j * b.x_p[:, 1:2] + h * zc
            mean[..., 2], mean[..., 3] = place.real, place.imag
            J_z[:, :, 2:] = _as_matrix(h)
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


def _as_matrix(c: Complex) -> Array:
    """Multiplication by c (...) as a real matrix (..., 2, 2)."""
    return np.stack([np.stack([c.real, -c.imag], -1), np.stack([c.imag, c.real], -1)], -2)
