"""Exercise 16.1: the prediction of the reduced filter, derived from one sentence.

The car drives ds along its heading, then turns left by dalpha; a landmark stays where it is in the world.
"""

import numpy as np


def predict(
    mean: np.ndarray, cov: np.ndarray, ds: float, dalpha: float, cov_increment: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Move mean and covariance by one increment.

    Parameters
    ----------
    mean : ndarray, shape (4 + 2 n,)
        x, y, sin(heading), cos(heading) of the car in the world; then, for each landmark, its
        coordinates in the car's axes: metres ahead, metres to the left.
    cov : ndarray, shape (4 + 2 n, 4 + 2 n)
        Its covariance.
    ds, dalpha : float
        Distance driven (m) and turn to the left (rad), as measured.
    cov_increment : ndarray, shape (2, 2)
        Covariance of the error of (ds, dalpha); it enters to first order.

    Returns
    -------
    mean : ndarray, shape (4 + 2 n,)
    cov : ndarray, shape (4 + 2 n, 4 + 2 n)
    """
    raise NotImplementedError
