"""EKF-SLAM's update by range and bearing as they are, without the way over Cartesian coordinates.

The sketch, with the vehicle at (x, y, theta) and a landmark at (X, Y)::

                   * (X, Y)          r = |(X - x, Y - y)|
                 .                   b = atan2(Y - y, X - x) - theta,  in (-pi, pi]
               .  r
             .   ) b                 dr = u . d(X - x, Y - y)
      (x, y) o------ theta           r db = n . d(X - x, Y - y) - r dtheta

u points to the landmark, n is u turned to the left by a right angle.  The filters of this room convert a
sighting first (:mod:`.range_bearing`), which has no bias; this update is what most programs have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from vslam_ref.arrays import Array
from vslam_ref.geometry import so2


class PolarUpdate(NamedTuple):
    """State and its covariance.

    Attributes
    ----------
    x : ndarray, shape (3 + 2n,)
        Metres and radians.
    P : ndarray, shape (3 + 2n, 3 + 2n)
        Squares of them.
    """

    x: Array
    P: Array


def predicted_polar(x: ArrayLike, slot: int) -> tuple[Array, Array]:
    """Range and bearing of a landmark of the map, and their Jacobian in the whole state.

    Implements :eq:`eq-b21` in polar coordinates.

    Parameters
    ----------
    x : array_like, shape (3 + 2n,)
        Pose (x, y, theta), then the landmarks; metres and radians.
    slot : int
        Which landmark, from 0.

    Returns
    -------
    value : ndarray, shape (2,)
        Metres and radians, the bearing in (-pi, pi].
    H : ndarray, shape (2, 3 + 2n)

    Examples
    --------
    >>> value, H = predicted_polar([0.0, 0.0, np.pi / 2, 0.0, 2.0], 0)
    >>> value.tolist(), H[1].tolist()
    ([2.0, 0.0], [0.5, -0.0, -1.0, -0.5, 0.0])
    """
    state = np.asarray(x, dtype=np.float64)
    at = slice(3 + 2 * slot, 5 + 2 * slot)
    d = state[at] - state[:2]
    r = float(np.hypot(*d))
    u = d / r
    H = np.zeros((2, len(state)))
    H[0, at], H[1, at] = u, np.array([-u[1], u[0]]) / r
    H[:, :2], H[1, 2] = -H[:, at], -1.0
    return np.array([r, float(so2.wrap(np.arctan2(d[1], d[0]) - state[2]))]), H


def update_polar(x: ArrayLike, P: ArrayLike, ids: ArrayLike, polar: ArrayLike, cov: ArrayLike) -> PolarUpdate:
    """Update a state with ranges and bearings of landmarks of the map, all at once.

    Implements :eq:`eq-gain` with range and bearing in the place of relative coordinates.

    Parameters
    ----------
    x : array_like, shape (3 + 2n,)
    P : array_like, shape (3 + 2n, 3 + 2n)
    ids : array_like of int, shape (m,)
        Landmarks of the map, from 0.
    polar : array_like, shape (m, 2)
        Ranges (m) and bearings (rad, to the left).
    cov : array_like, shape (2, 2)
        Of each.

    Returns
    -------
    PolarUpdate
        The heading in (-pi, pi].

    Examples
    --------
    >>> x, P = update_polar([0.0, 0, 0, 2, 0], np.diag([1.0, 1, 1, 0, 0]), [0], [[1.0, 0.0]], np.eye(2))
    >>> x.tolist()
    [0.5, 0.0, 0.0, 2.0, 0.0]
    """
    state, P = np.asarray(x, dtype=np.float64), np.asarray(P, dtype=np.float64)
    seen = [predicted_polar(state, int(i)) for i in np.asarray(ids)]
    if not seen:
        return PolarUpdate(state.copy(), P.copy())
    H = np.concatenate([slope for _, slope in seen])
    innovation = np.asarray(polar, dtype=np.float64).reshape(-1, 2) - [value for value, _ in seen]
    innovation[:, 1] = so2.wrap(innovation[:, 1])  # a difference of bearings is an angle, too
    S = H @ P @ H.T + block_diag(*[np.asarray(cov, dtype=np.float64)] * len(seen))
    K = np.linalg.solve(S, H @ P).T
    after, kept = state + K @ innovation.ravel(), P - K @ S @ K.T
    after[2] = so2.wrap(after[2])
    return PolarUpdate(after, (kept + kept.T) / 2)
