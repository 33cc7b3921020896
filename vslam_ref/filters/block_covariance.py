"""Mean and covariance of pose and map in blocks, and the Kalman update of all blocks.

Implements :eq:`eq-blocks`: a SLAM covariance is kept as ::

    P = [ P_pp   P_pm ]      p: the p pose states;  m: the map states, b per landmark
        [ P_pm^T P_mm ]

so that a prediction, which moves the pose only, touches P_pp and P_pm and costs O(n); and a
measurement of k numbers costs O(k n^2).  No full F, H or K H is ever formed.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray

SINGULAR = 64 * float(np.finfo(np.float64).eps)
"""Pivot of S, as a share of its variance, up to which it is rounding and S singular.

Adding, and subtracting again, a few numbers of the size of the variance leaves some eps of it.
"""


class State(NamedTuple):
    """Means and covariance blocks of B runs; a filter's steps change these arrays in place.

    Attributes
    ----------
    x_p, x_m : ndarray, shapes (B, p), (B, M)
        Means of pose and map.
    P_pp, P_pm, P_mm : ndarray, shapes (B, p, p), (B, p, M), (B, M, M)
        Blocks of the covariance.
    """

    x_p: Array
    x_m: Array
    P_pp: Array
    P_pm: Array
    P_mm: Array


def _with_room(A: Array, *shape: int) -> Array:
    """A and zeros behind it, rows an odd number of cache lines (8 numbers) apart, the first on a line.

    Rows a power of two apart would share sets of the cache: a tenth of Numba's update at 200 landmarks.
    """
    row = 8 * (-(-shape[-1] // 8) | 1)
    size = math.prod(shape[:-1]) * row
    buffer = np.zeros(size + 7)
    first = -(buffer.ctypes.data // 8) % 8
    larger = buffer[first : first + size].reshape(*shape[:-1], row)[..., : shape[-1]]
    larger[tuple(slice(length) for length in A.shape)] = A
    return larger


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

    Attributes
    ----------
    state : State
        Views of all blocks.
    """

    def __init__(self, mean: Array, cov: Array, landmark_states: int, capacity: int) -> None:
        (batch, p), room = mean.shape, max(capacity, 1) * landmark_states
        self.b = landmark_states
        self._x_m = _with_room(np.zeros((batch, 0)), batch, room)
        self._P_pm = _with_room(np.zeros((batch, p, 0)), batch, p, room)
        self._P_mm = _with_room(np.zeros((batch, 0, 0)), batch, room, room)
        self._index: dict[int, int] = {}
        self._look(np.array(mean, dtype=np.float64), np.array(cov, dtype=np.float64))

    def _look(self, x_p: Array, P_pp: Array) -> None:
        """Set ``state``: views of all blocks, without the room that is still free."""
        M = self.b * self.n
        self.state = State(x_p, self._x_m[:, :M], P_pp, self._P_pm[:, :, :M], self._P_mm[:, :M, :M])

    def __setstate__(self, parts: dict[str, Any]) -> None:
        """A copy looks at its own arrays."""
        self.__dict__.update(parts)
        self._look(self.x_p, self.P_pp)

    @property
    def n(self) -> int:
        """Landmarks in the map."""
        return len(self._index)

    @property
    def x_p(self) -> Array:
        """Mean of the pose (B, p)."""
        return self.state.x_p

    @property
    def x_m(self) -> Array:
        """Mean of the map (B, M)."""
        return self.state.x_m

    @property
    def P_pp(self) -> Array:
        """Covariance of the pose (B, p, p)."""
        return self.state.P_pp

    @property
    def P_pm(self) -> Array:
        """Cross covariance of pose and map (B, p, M)."""
        return self.state.P_pm

    @property
    def P_mm(self) -> Array:
        """Covariance of the map (B, M, M)."""
        return self.state.P_mm

    @property
    def ids(self) -> IntArray:
        """Identities of the landmarks in the map, in the order in which they entered."""
        return np.fromiter(self._index, dtype=np.int64, count=self.n)

    def columns(self, ids: IntArray) -> IntArray:
        """First map column of each landmark of ``ids``, -1 for one that is not in the map yet."""
        return np.array([self._index.get(i, -1) for i in ids.tolist()], dtype=np.int64)

    def append(self, ids: IntArray, mean: Array, G: Array, noise: Array) -> None:
        """Add m landmarks whose errors are G times the pose's error and errors of their own.

        Implements :eq:`eq-augment`.

        Parameters
        ----------
        ids : ndarray of int, shape (m,)
        mean : ndarray, shape (B, m b)
        G : ndarray, shape (B, m b, p)
            Jacobian of the new states in the pose.
        noise : ndarray, shape (B, m, b, b)
            Covariance of what each landmark's own measurement adds.
        """
        old, new = self.n * self.b, (self.n + len(ids)) * self.b
        self._make_room(new)
        P_pp, P_pm = self.P_pp, self._P_pm[:, :, :old]
        G_T = G.swapaxes(1, 2)
        cov, cross = G @ P_pp @ G_T, P_pm.swapaxes(1, 2) @ G_T  # eq-augment
        diagonal_blocks(cov, self.b)[...] += noise
        self._x_m[:, old:new] = mean
        self._P_pm[:, :, old:new] = P_pp @ G_T
        self._P_mm[:, :old, old:new], self._P_mm[:, old:new, :old] = cross, cross.swapaxes(1, 2)
        self._P_mm[:, old:new, old:new] = cov
        self._index |= {i: old + self.b * j for j, i in enumerate(ids.tolist())}
        self._look(self.x_p, P_pp)

    def _make_room(self, states: int) -> None:
        """Twice the room at least, when there is not enough for so many map states."""
        room = self._x_m.shape[1]
        if states > room:
            more = max(states, 2 * room)
            batch, p, _ = self._P_pm.shape
            self._x_m = _with_room(self._x_m, batch, more)
            self._P_pm = _with_room(self._P_pm, batch, p, more)
            self._P_mm = _with_room(self._P_mm, batch, more, more)

    def full(self) -> tuple[Array, Array]:
        """Mean (B, p + M) and covariance (B, p + M, p + M) as whole arrays (copies)."""
        x_p, x_m, P_pp, P_pm, P_mm = self.state
        return np.concatenate([x_p, x_m], 1), np.block([[P_pp, P_pm], [P_pm.swapaxes(1, 2), P_mm]])


class Expected(NamedTuple):
    """What a measurement of k numbers meets: innovation (B, k), its covariance S (B, k, k), and H P.

    H P has the shape (B, k, p + M), the pose's columns first.
    """

    innovation: Array
    S: Array
    HP: Array


def kalman_update_in_place(state: State, seen: Expected, gate: float = np.inf) -> None:
    """Kalman update of means and covariance, in place.

    Implements :eq:`eq-gain`.  With S = L L^T and W = L^-1 H P ::

        x += W^T L^-1 innovation          P -= W^T W

    which is K = P H^T S^-1 without K, and keeps P symmetric to the last bit.  The normalised innovation
    squared is the square of L^-1 innovation: a run in which it exceeds ``gate`` stays as it is.

    Raises
    ------
    numpy.linalg.LinAlgError
        If S is not positive definite to rounding in one of the runs; nothing is changed then.
    """
    x_p, x_m, P_pp, P_pm, P_mm = state
    p = x_p.shape[1]
    both = np.concatenate([seen.HP, seen.innovation[:, :, None]], 2)
    both = np.linalg.inv(innovation_root(seen.S)) @ both
    if gate < np.inf:
        both[np.sum(both[:, :, -1] ** 2, 1) > gate] = 0.0
    W, y = both[:, :, :-1], both[:, :, -1:]
    step = (y.swapaxes(1, 2) @ W)[:, 0]
    x_p += step[:, :p]  # eq-gain
    x_m += step[:, p:]
    WW = W.swapaxes(1, 2) @ W
    P_pp -= WW[:, :p, :p]
    P_pm -= WW[:, :p, p:]
    P_mm -= WW[:, p:, p:]


def innovation_root(S: Array) -> Array:
    """Lower Cholesky factors of the covariances ``S (B, k, k)`` of an innovation.

    Raises
    ------
    numpy.linalg.LinAlgError
        If a pivot, the part of a variance that the numbers before it leave open, is no more than
        :data:`SINGULAR` of that variance: then it is rounding.
    """
    L = np.asarray(np.linalg.cholesky(S), dtype=np.float64)
    if (np.einsum("bii->bi", L) ** 2 <= SINGULAR * np.einsum("bii->bi", S)).any():
        raise np.linalg.LinAlgError("Matrix is not positive definite to rounding")
    return L


def expected_landmarks(
    state: State, columns: IntArray, H_p: Array, H_l: Array, innovation: Array, cov_z: Array
) -> Expected:
    """H P and S = H P H^T + cov_z of m landmarks; H is zero elsewhere.  Nothing is changed.

    Implements :eq:`eq-innovation`.

    Parameters
    ----------
    state : State
    columns : ndarray of int, shape (m,)
        First map column of each landmark.
    H_p : ndarray, shape (B, m, 2, p) or (m, 2, p)
        Jacobian of each landmark's measurement in the pose.
    H_l : ndarray, shape (B, m, 2, 2) or (m, 2, 2)
        Jacobian in the two map states that start at ``columns``.
    innovation : ndarray, shape (B, 2 m)
        measured - predicted.
    cov_z : ndarray, shape (m, 2, 2)
        Measurement covariance of each landmark; the measurements are independent.
    """
    (B, k), p, pairs = innovation.shape, state.x_p.shape[1], map_columns(columns)
    H = np.zeros((B, k, p + k))  # in the pose and the landmarks seen
    H[:, :, :p] = H_p.reshape(-1, k, p)
    diagonal_blocks(H[:, :, p:])[...] = H_l
    rows = np.empty((B, p + k, p + state.x_m.shape[1]))  # the rows of P that H meets
    rows[:, :p, :p], rows[:, :p, p:] = state.P_pp, state.P_pm
    rows[:, p:, :p], rows[:, p:, p:] = state.P_pm.take(pairs, 2).swapaxes(1, 2), state.P_mm.take(pairs, 1)
    HP = H @ rows
    S = HP.take(np.concatenate([np.arange(p), p + pairs]), 2) @ H.swapaxes(1, 2)
    diagonal_blocks(S)[...] += cov_z  # eq-innovation
    return Expected(innovation, S, HP)


def map_columns(columns: IntArray) -> IntArray:
    """Columns of both coordinates of landmarks.

    Parameters
    ----------
    columns : ndarray of int, shape (m,)
        First map column of each.

    Returns
    -------
    ndarray of int, shape (2 m,)
    """
    return (columns[:, None] + np.arange(2)).ravel()


def diagonal_blocks(A: Array, b: int = 2) -> Array:
    """Square blocks on the diagonal, as a view where A lies in one piece.

    Parameters
    ----------
    A : ndarray, shape (B, b m, b m)
    b : int
        Rows of a block.

    Returns
    -------
    ndarray, shape (B, m, b, b)
    """
    m = A.shape[1] // b
    blocks: Array = np.einsum("bkikj->bkij", A.reshape(len(A), m, b, m, b))
    return blocks
