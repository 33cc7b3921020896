"""Which landmark is this corner?  Gates, signatures, and the robot's own position against look-alikes.

A corner z seen from a pose with covariance P belongs to a landmark only if the squared Mahalanobis distance

    d^2 = (z - h)^T S^-1 (z - h),       S = H P H^T + cov_z

lies inside the 99 % gate of chi^2 with two degrees of freedom, 9.21, and if the corner looks the same way
and is of the same kind.  Two landmarks inside one gate are look-alikes that the robot's position cannot
distinguish: then the corner says nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.geometry import so2

GATE = 9.210340371976184
"""99 % quantile of chi^2 with two degrees of freedom, -2 ln 0.01."""


class Signature(NamedTuple):
    """How corners look: ``bisector (n,)`` in one frame and ``opening (n,)``, radians; ``convex (n,)``."""

    bisector: Array
    opening: Array
    convex: BoolArray


class Association(NamedTuple):
    """What became of m corners.

    Attributes
    ----------
    landmark : ndarray of int, shape (m,)
        Index of the landmark; -1: none in the gate; -2: several, ambiguous.
    distance2 : ndarray, shape (m, n)
        Squared Mahalanobis distances; inf where the signatures differ.
    """

    landmark: IntArray
    distance2: Array


NONE, AMBIGUOUS = -1, -2
TURN, OPENING = 0.45, 0.35
"""Radians by which bisectors and openings of look-alikes may differ; runs of 25 cm know them better."""


def look_alike(a: Signature, b: Signature, turn: float = TURN, opening: float = OPENING) -> BoolArray:
    """Whether corners a (m,) and b (n,) look alike, (m, n): of one kind, nearly one direction and opening."""
    bisector = np.abs(so2.wrap(a.bisector[:, None] - b.bisector[None])) <= turn
    angle = np.abs(a.opening[:, None] - b.opening[None]) <= opening
    alike: BoolArray = bisector & angle & (a.convex[:, None] == b.convex[None])
    return alike


def gate(innovation: ArrayLike, S: ArrayLike) -> Array:
    """Squared Mahalanobis distances (...,) of innovations (..., 2) with covariances (..., 2, 2).

    Implements the left side of :eq:`eq-gate`.

    Examples
    --------
    >>> gate([3.0, 0.0], [[9.0, 0.0], [0.0, 1.0]])
    array(1.)
    """
    v, S = np.asarray(innovation, dtype=np.float64), np.asarray(S, dtype=np.float64)
    return np.asarray((v * np.linalg.solve(S, v[..., None])[..., 0]).sum(-1))


def associate(innovation: ArrayLike, S: ArrayLike, alike: ArrayLike, gate2: float = GATE) -> Association:
    """Give each corner at most one landmark, and each landmark at most one corner.

    Parameters
    ----------
    innovation : array_like, shape (m, n, 2)
        Corner minus predicted landmark, in the laser's frame, metres.
    S : array_like, shape (m, n, 2, 2)
        Covariance of the innovation.
    alike : array_like of bool, shape (m, n)
    gate2 : float
        Largest squared distance.

    Returns
    -------
    Association
        A corner with two landmarks in its gate is ambiguous; of two corners that claim one landmark the
        nearer has it if it is the only one in the gate, else both are ambiguous.

    Examples
    --------
    >>> S = np.broadcast_to(np.eye(2), (1, 2, 2, 2))
    >>> associate([[[0.5, 0.0], [9.0, 0.0]]], S, [[True, True]]).landmark
    array([0])
    >>> associate([[[0.5, 0.0], [1.0, 0.0]]], S, [[True, True]]).landmark
    array([-2])
    """
    distance2 = np.where(np.asarray(alike, dtype=bool), gate(innovation, S), np.inf)
    inside = distance2 <= gate2  # eq-gate
    landmark = np.full(len(distance2), NONE)
    if distance2.size == 0:
        return Association(landmark, distance2)
    claims_of_corner, claims_on_landmark = inside.sum(axis=1), inside.sum(axis=0)
    nearest = np.argmin(distance2, axis=1)
    landmark = np.where(claims_of_corner == 1, nearest, landmark)
    landmark = np.where(claims_of_corner > 1, AMBIGUOUS, landmark)
    contested = (claims_of_corner == 1) & (claims_on_landmark[nearest] > 1)
    landmark = np.where(contested, AMBIGUOUS, landmark)
    return Association(landmark, distance2)
