"""Exercise 15.1: add a landmark to the state of an EKF-SLAM filter."""

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
    raise NotImplementedError
