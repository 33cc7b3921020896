"""The models of EKF-SLAM that a filter library wants from its user: moved mean, F, Q; predicted sighting, H.

OpenCV, GTSAM and filterpy have Kalman filters and know no vehicles.  These are the models as their user would
write them, apart from this library's own (which would then be compared with itself).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def wrapped(angle: float) -> float:
    """The angle in (-pi, pi].

    >>> wrapped(-math.pi) == wrapped(math.pi) == math.pi
    True
    """
    turned = math.remainder(angle, 2.0 * math.pi)
    return math.pi if turned <= -math.pi else turned


def heading_wrapped(x: Array) -> Array:
    """The state with its third entry wrapped."""
    return np.array([*x[:2], wrapped(float(x[2])), *x[3:]])


def drive(x: Array, control: Array, cov_u: Array, wheelbase: float, dt: float) -> tuple[Array, Array, Array]:
    """Moved state, its Jacobian F, and the covariance Q that the control's noise adds."""
    (v, steering), theta, n = control, x[2], len(x)
    c, s, tan = math.cos(theta), math.sin(theta), math.tan(steering)
    moved = x.copy()
    moved[:2] += v * dt * np.array([c, s])
    moved[2] += v * dt * tan / wheelbase
    F = np.eye(n)
    F[:2, 2] = -v * dt * s, v * dt * c
    G = np.zeros((n, 2))
    G[:3] = [[dt * c, 0.0], [dt * s, 0.0], [dt * tan / wheelbase, v * dt * (1.0 + tan**2) / wheelbase]]
    return heading_wrapped(moved), F, G @ cov_u @ G.T


def sight(x: Array, ids: Array) -> tuple[Array, Array]:
    """Predicted positions (2 m,) of landmarks relative to the vehicle, in its axes, and their Jacobian."""
    c, s = math.cos(x[2]), math.sin(x[2])
    to_vehicle = np.array([[c, s], [-s, c]])
    predicted, H = np.zeros(2 * len(ids)), np.zeros((2 * len(ids), len(x)))
    for k, landmark in enumerate(np.asarray(ids, dtype=int).tolist()):
        at, row = 3 + 2 * landmark, slice(2 * k, 2 * k + 2)
        predicted[row] = to_vehicle @ (x[at : at + 2] - x[:2])
        H[row, :2], H[row, at : at + 2] = -to_vehicle, to_vehicle
        H[row, 2] = predicted[2 * k + 1], -predicted[2 * k]
    return predicted, H


def augment(x: Array, P: Array, z: Array, cov_z: Array) -> tuple[Array, Array]:
    """State and covariance with one landmark more, seen at z."""
    c, s = math.cos(x[2]), math.sin(x[2])
    to_world = np.array([[c, -s], [s, c]])
    turned = to_world @ z
    J = np.zeros((2, len(x)))
    J[:, :2] = np.eye(2)
    J[:, 2] = -turned[1], turned[0]
    cross = J @ P
    corner = cross @ J.T + to_world @ cov_z @ to_world.T
    return np.concatenate([x, x[:2] + turned]), np.block([[P, cross.T], [cross, corner]])
