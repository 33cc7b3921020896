"""The covariance of pose and map in three blocks, and its measurement update.

A SLAM covariance is kept as::

    P = [ P_pp   P_pm ]      p: the p pose states;  m: the map states, b per landmark
        [ P_pm^T P_mm ]

so that a prediction, which moves the pose only, touches P_pp and P_pm and costs O(n); and a
measurement of k numbers costs O(k n^2).  No full F, H or K H is ever formed.
"""

from __future__ import annotations

import copy
import math

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray

_XY = np.arange(2)


_LINE = 8
"""Numbers in a line of the cache, 64 bytes: vector instructions are slow on numbers that lie across two."""


def _zeros(*shape: int) -> Array:
    """Zeros that begin with a cache line."""
    size = math.prod(shape)
    buffer = np.zeros(size + _LINE - 1)
    first = -(buffer.ctypes.data // buffer.itemsize) % _LINE
    return buffer[first : first + size].reshape(shape)


def _whole_lines(columns: int) -> int:
    """Columns in an odd number of cache lines: rows a power of two apart would share sets of the cache."""
    return _LINE * (-(-columns // _LINE) | 1)


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
        room = _whole_lines(capacity * self.b)
        self.x_p = np.array(mean, dtype=np.float64)
        self.P_pp = np.array(cov, dtype=np.float64)
        self._x_m = _zeros(batch, room)
        self._P_pm = _zeros(batch, p, room)
        self._P_mm = _zeros(batch, room, room)
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

    def columns(self, ids: IntArray) -> IntArray:
        """First map column of each landmark of ``ids``, -1 for one that is not in the map yet."""
        return np.array([self._index.get(i, -1) for i in ids.tolist()], dtype=np.int64)

    def append(self, ids: IntArray, mean: Array, cov: Array, cross_pose: Array, cross_map: Array) -> None:
        """Add m landmarks: mean (B, mb), cov (B, mb, mb), cross covariances (B, p, mb), (B, n b, mb)."""
        old, new = self.n * self.b, (self.n + len(ids)) * self.b
        if len(set(ids.tolist())) != len(ids):
            raise ValueError(f"landmark ids {ids.tolist()}: each must appear once in one measurement")
        if new > self._x_m.shape[1]:
            self._grow(_whole_lines(max(new, 2 * self._x_m.shape[1])))
        self._x_m[:, old:new] = mean
        self._P_pm[:, :, old:new] = cross_pose
        self._P_mm[:, :old, old:new] = cross_map
        self._P_mm[:, old:new, :old] = np.swapaxes(cross_map, 1, 2)
        self._P_mm[:, old:new, old:new] = cov
        for i in ids:
            self._index[int(i)] = self.n * self.b
            self.n += 1
        self._set_views()

    def _grow(self, room: int) -> None:
        batch, p, old = self._P_pm.shape
        x_m, P_pm, P_mm = self._x_m, self._P_pm, self._P_mm
        self._x_m, self._P_pm = _zeros(batch, room), _zeros(batch, p, room)
        self._P_mm = _zeros(batch, room, room)
        self._x_m[:, :old], self._P_pm[:, :, :old], self._P_mm[:, :old, :old] = x_m, P_pm, P_mm

    def __deepcopy__(self, memo: dict[int, object]) -> Blocks:
        """Copy the arrays once and look at the copies; a plain deep copy would part views from arrays."""
        twin = copy.copy(self)
        for name in ("x_p", "P_pp", "_x_m", "_P_pm", "_P_mm"):
            mine = getattr(self, name)
            setattr(twin, name, _zeros(*mine.shape))
            getattr(twin, name)[...] = mine
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
    pairs = map_columns(columns)
    H = np.zeros((B, k, p + k))  # in the pose and the landmarks seen; elsewhere it is zero
    H[:, :, :p] = H_p.reshape(B, k, p)
    landmark_blocks(H[:, :, p:])[...] = H_l
    rows = np.empty((B, p + k, p + M))  # the rows of P that H meets
    rows[:, :p, :p], rows[:, :p, p:] = P_pp, P_pm
    rows[:, p:, :p], rows[:, p:, p:] = P_pm.take(pairs, 2).swapaxes(1, 2), P_mm.take(pairs, 1)
    HP = H @ rows
    met = np.concatenate([np.arange(p), p + pairs])
    S = HP.take(met, 2) @ H.swapaxes(1, 2)
    landmark_blocks(S)[...] += cov_z
    W, y = whitened(HP, innovation, S)
    move_means(x_p, x_m, W, y)
    WW = W.swapaxes(1, 2) @ W
    P_pp -= WW[:, :p, :p]
    P_pm -= WW[:, :p, p:]
    P_mm -= WW[:, p:, p:]
    return S


def map_columns(columns: IntArray) -> IntArray:
    """Columns (2 m,) of both coordinates of the landmarks that start at ``columns`` (m,)."""
    return (columns[:, None] + _XY).ravel()


def landmark_blocks(A: Array) -> Array:
    """View (B, m, 2, 2) of the 2 x 2 blocks on the diagonal of A (B, 2 m, 2 m)."""
    m = A.shape[1] // 2
    blocks: Array = np.einsum("bkikj->bkij", A.reshape(len(A), m, 2, m, 2))
    return blocks


def whitened(HP: Array, innovation: Array, S: Array) -> tuple[Array, Array]:
    """W = L^-1 H P (B, k, D) and L^-1 innovation (B, k), with S = L L^T."""
    both = np.concatenate([HP, innovation[:, :, None]], 2)
    both = np.linalg.inv(np.linalg.cholesky(S)) @ both
    return both[:, :, :-1], both[:, :, -1]


def move_means(x_p: Array, x_m: Array, W: Array, y: Array) -> None:
    """Add W^T y, the gain times the innovation, to the means, pose first."""
    step = (y[:, None] @ W)[:, 0]
    x_p += step[:, : x_p.shape[1]]
    x_m += step[:, x_p.shape[1] :]
