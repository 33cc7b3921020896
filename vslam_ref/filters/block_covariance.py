"""The covariance of pose and map in three blocks, and its measurement update.

A SLAM covariance is kept as::

    P = [ P_pp   P_pm ]      p: the p pose states;  m: the map states, b per landmark
        [ P_pm^T P_mm ]

so that a prediction, which moves the pose only, touches P_pp and P_pm and costs O(n); and a
measurement of k numbers costs O(k n^2).  No full F, H or K H is ever formed.
"""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import NDArray

from vslam_ref._kernels import accelerated

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Blocks:
    """Mean and covariance of pose and map for a batch of B runs, with room for a growing map.

    Parameters
    ----------
    mean : ndarray, shape (B, p)
        Pose states.
    cov : ndarray, shape (B, p, p)
        Their covariance.
    landmark_states : int
        States b per landmark.
    capacity : int
        Landmarks to make room for at first; more are made on demand.
    """

    def __init__(self, mean: Array, cov: Array, landmark_states: int, capacity: int) -> None:
        batch, p = mean.shape
        self.b = landmark_states
        self.n = 0
        room = capacity * self.b
        self.x_p = np.array(mean, dtype=np.float64)
        self.P_pp = np.array(cov, dtype=np.float64)
        self._x_m = np.zeros((batch, room))
        self._P_pm = np.zeros((batch, p, room))
        self._P_mm = np.zeros((batch, room, room))
        self._index: dict[int, int] = {}
        self._set_views()

    def _set_views(self) -> None:
        size = self.n * self.b
        self.x_m = self._x_m[:, :size]
        self.P_pm = self._P_pm[:, :, :size]
        self.P_mm = self._P_mm[:, :size, :size]

    @property
    def ids(self) -> IntArray:
        """Identities of the landmarks in the map, in the order in which they entered."""
        return np.fromiter(self._index, dtype=np.int64, count=self.n)

    def split(self, ids: IntArray) -> tuple[IntArray, IntArray]:
        """Positions in ``ids`` of landmarks already in the map, and of new ones."""
        known = np.fromiter((int(i) in self._index for i in ids), dtype=bool, count=len(ids))
        return np.flatnonzero(known), np.flatnonzero(~known)

    def columns(self, ids: IntArray) -> IntArray:
        """First map column of each landmark of ``ids``."""
        return np.fromiter((self._index[int(i)] for i in ids), dtype=np.int64, count=len(ids)) * self.b

    def append(self, ids: IntArray, mean: Array, cov: Array, cross_pose: Array, cross_map: Array) -> None:
        """Add m landmarks: mean (B, mb), cov (B, mb, mb), cross covariances (B, p, mb), (B, n b, mb)."""
        old, new = self.n * self.b, (self.n + len(ids)) * self.b
        if len(set(ids.tolist())) != len(ids):
            raise ValueError(f"landmark ids {ids.tolist()}: each must appear once in one measurement")
        if new > self._x_m.shape[1]:
            self._grow(max(new, 2 * self._x_m.shape[1]))
        self._x_m[:, old:new] = mean
        self._P_pm[:, :, old:new] = cross_pose
        self._P_mm[:, :old, old:new] = cross_map
        self._P_mm[:, old:new, :old] = np.swapaxes(cross_map, 1, 2)
        self._P_mm[:, old:new, old:new] = cov
        for i in ids:
            self._index[int(i)] = self.n
            self.n += 1
        self._set_views()

    def _grow(self, room: int) -> None:
        more = room - self._x_m.shape[1]
        self._x_m = np.pad(self._x_m, ((0, 0), (0, more)))
        self._P_pm = np.pad(self._P_pm, ((0, 0), (0, 0), (0, more)))
        self._P_mm = np.pad(self._P_mm, ((0, 0), (0, more), (0, more)))

    def __deepcopy__(self, memo: dict[int, object]) -> Blocks:
        """Copy the arrays once and look at the copies; a plain deep copy would part views from arrays."""
        twin = copy.copy(self)
        for name in ("x_p", "P_pp", "_x_m", "_P_pm", "_P_mm"):
            setattr(twin, name, getattr(self, name).copy())
        twin._index = dict(self._index)
        twin._set_views()
        return twin

    def full(self) -> tuple[Array, Array]:
        """Mean (B, p + n b) and covariance (B, p + n b, p + n b) as whole arrays (copies)."""
        mean = np.concatenate([self.x_p, self.x_m], 1)
        top = np.concatenate([self.P_pp, self.P_pm], 2)
        bottom = np.concatenate([np.swapaxes(self.P_pm, 1, 2), self.P_mm], 2)
        return mean, np.concatenate([top, bottom], 1)


@accelerated("slam:landmark_update")
def landmark_update(
    x_p: Array,
    x_m: Array,
    P_pp: Array,
    P_pm: Array,
    P_mm: Array,
    H_p: Array,
    H_l: Array,
    columns: IntArray,
    innovation: Array,
    cov_z: Array,
) -> Array:
    """Kalman update with m landmarks at once, in place; returns the innovation covariance S.

    With P H^T = (H P)^T, S = H P H^T + cov_z = L L^T and W = L^-1 H P::

        x += W^T L^-1 innovation          P -= W^T W

    which is K = P H^T S^-1 without K, and keeps P symmetric to the last bit.

    Parameters
    ----------
    x_p, x_m : ndarray, shapes (B, p), (B, M)
        Means of pose and map, changed in place.
    P_pp, P_pm, P_mm : ndarray, shapes (B, p, p), (B, p, M), (B, M, M)
        Covariance blocks, changed in place.
    H_p : ndarray, shape (B, m, 2, p)
        Jacobian of each landmark's measurement in the pose.
    H_l : ndarray, shape (B, m, 2, 2)
        Jacobian in the two map states that start at ``columns``.
    columns : ndarray of int, shape (m,)
    innovation : ndarray, shape (B, 2 m)
        measured - predicted.
    cov_z : ndarray, shape (m, 2, 2)
        Measurement covariance of each landmark; the measurements are independent.

    Returns
    -------
    ndarray, shape (B, 2 m, 2 m)
        S.
    """
    B, m, _, p = H_p.shape
    k, M = 2 * m, P_mm.shape[2]
    pairs = (columns[:, None] + np.arange(2)).ravel()  # (k,)
    HP_p = H_l @ P_pm[:, :, pairs].swapaxes(1, 2).reshape(B, m, 2, p) + H_p @ P_pp[:, None]
    HP_m = H_l @ P_mm[:, pairs].reshape(B, m, 2, M) + H_p @ P_pm[:, None]
    # H P and the innovation in one array, so that one product whitens all three
    HP = np.concatenate([HP_p.reshape(B, k, p), HP_m.reshape(B, k, M), innovation[:, :, None]], 2)
    HPH = HP[:, :, p + pairs].reshape(B, k, m, 2)
    S = HP[:, :, :p] @ H_p.reshape(B, k, p).swapaxes(1, 2)
    S += np.einsum("bkmj,bmij->bkmi", HPH, H_l).reshape(B, k, k)
    np.einsum("bminj->bmnij", S.reshape(B, m, 2, m, 2))[:, range(m), range(m)] += cov_z
    W = np.linalg.inv(np.linalg.cholesky(S)) @ HP
    W_p, W_m, y = W[:, :, :p], W[:, :, p:-1], W[:, :, -1:]
    x_p += (W_p.swapaxes(1, 2) @ y)[:, :, 0]
    x_m += (W_m.swapaxes(1, 2) @ y)[:, :, 0]
    P_pp -= W_p.swapaxes(1, 2) @ W_p
    P_pm -= W_p.swapaxes(1, 2) @ W_m
    P_mm -= W_m.swapaxes(1, 2) @ W_m
    return S
