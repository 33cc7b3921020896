"""Exercise 20.1: a corner with its covariance, the gate's width, and whose corner it is."""

import numpy as np


def corner(
    centre: np.ndarray, angle: np.ndarray, var_offset: np.ndarray, var_angle: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where two lines cross, and how well that is known.

    Parameters
    ----------
    centre : ndarray, shape (2, 2)
        Centroid of each line's points, metres.
    angle : ndarray, shape (2,)
        Direction of each line, radians.
    var_offset : ndarray, shape (2,)
        Variance of each line's place along its normal (-sin, cos), at the centroid, square metres.
    var_angle : ndarray, shape (2,)
        Variance of each line's direction, square radians. All four errors are independent.

    Returns
    -------
    xy : ndarray, shape (2,)
    cov : ndarray, shape (2, 2)
    """
    t = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    n = np.stack([-t[:, 1], t[:, 0]], axis=1)
    inverse = np.linalg.inv(n)
    xy = inverse @ (n * centre).sum(axis=1)
    lever = (t * (xy - centre)).sum(axis=1)
    cov = inverse @ np.diag(var_offset + lever**2 * var_angle) @ inverse.T
    return xy, cov


def innovation_cov(
    J_pose: np.ndarray,
    J_landmark: np.ndarray,
    P_pose: np.ndarray,
    P_landmark: np.ndarray,
    P_cross: np.ndarray,
    cov_z: np.ndarray,
) -> np.ndarray:
    """Covariance of measured minus predicted, for a landmark that is in the filter.

    Parameters
    ----------
    J_pose, J_landmark : ndarray, shapes (2, 3), (2, 2)
        Jacobians of the predicted measurement.
    P_pose, P_landmark, P_cross : ndarray, shapes (3, 3), (2, 2), (3, 2)
        Covariances of the pose, of the landmark, and of the pose with the landmark.
    cov_z : ndarray, shape (2, 2)
        Of the measurement.
    """
    cross = J_pose @ P_cross @ J_landmark.T
    return J_pose @ P_pose @ J_pose.T + J_landmark @ P_landmark @ J_landmark.T + cross + cross.T + cov_z


def claim(innovations: np.ndarray, S: np.ndarray, alike: np.ndarray, gate2: float = 9.2103) -> int:
    """Which landmark a corner belongs to.

    Parameters
    ----------
    innovations : ndarray, shape (n, 2)
        Corner minus each landmark's prediction, metres.
    S : ndarray, shape (n, 2, 2)
        Their covariances.
    alike : ndarray of bool, shape (n,)
        Whether the landmark looks like the corner.
    gate2 : float
        Largest squared Mahalanobis distance.

    Returns
    -------
    int
        Index of the only landmark inside the gate; -1 if there is none; -2 if there are several.
    """
    if len(innovations) == 0:
        return -1
    d2 = np.einsum("ni,ni->n", innovations, np.linalg.solve(S, innovations[:, :, None])[:, :, 0])
    inside = np.flatnonzero(alike & (d2 <= gate2))
    if len(inside) == 0:
        return -1
    return int(inside[0]) if len(inside) == 1 else -2
