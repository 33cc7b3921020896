"""Solution of exercise 15.1: add a landmark to the state of an EKF-SLAM filter."""

import numpy as np


def augment(
    mean: np.ndarray, cov: np.ndarray, z: np.ndarray, cov_z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Add one landmark, seen for the first time.

    Parameters
    ----------
    mean : ndarray, shape (3 + 2 n,)
        x, y, heading of the vehicle; then x, y of each landmark.  Metres, radians, world frame.
    cov : ndarray, shape (3 + 2 n, 3 + 2 n)
        Its covariance.
    z : ndarray, shape (2,)
        The new landmark in the vehicle's axes: metres ahead, metres to the left.
    cov_z : ndarray, shape (2, 2)
        Covariance of z, in the vehicle's axes.

    Returns
    -------
    mean : ndarray, shape (5 + 2 n,)
        The old state, then the new landmark.
    cov : ndarray, shape (5 + 2 n, 5 + 2 n)
    """
    n = len(mean)
    c, s = np.cos(mean[2]), np.sin(mean[2])
    R = np.array([[c, -s], [s, c]])
    arrow = R @ z  # from the vehicle to the landmark, world axes

    # The new landmark's error is J (old error) + R (sensor error).  J is zero for the other landmarks.
    J = np.zeros((2, n))
    J[:, :2] = np.eye(2)
    J[:, 2] = -arrow[1], arrow[0]

    new_mean = np.concatenate([mean, mean[:2] + arrow])
    new_cov = np.zeros((n + 2, n + 2))
    new_cov[:n, :n] = cov
    new_cov[n:, :n] = J @ cov  # with the vehicle AND with every other landmark
    new_cov[:n, n:] = new_cov[n:, :n].T
    new_cov[n:, n:] = J @ cov @ J.T + R @ cov_z @ R.T
    return new_mean, new_cov
