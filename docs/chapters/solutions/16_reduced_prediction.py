"""Solution of exercise 16.1: the prediction of the reduced filter, derived from one sentence.

The car drives ds along its heading, then turns left by dalpha; a landmark stays where it is in the world.
Seen from the car it first comes nearer by ds, along the axis ahead; then it turns to the *right* by dalpha.
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
    size = len(mean)
    s, c = np.sin(dalpha), np.cos(dalpha)
    right = np.array([[c, s], [-s, c]])  # turns (ahead, left) of a point to the right by dalpha

    # The transition is linear in the state: mean' = F mean + f.
    F, f = np.eye(size), np.zeros(size)
    F[0, 3] = F[1, 2] = ds
    F[2:4, 2:4] = right  # sin' = sin c + cos s,  cos' = cos c - sin s: the same matrix
    for i in range(4, size, 2):
        F[i : i + 2, i : i + 2] = right
        f[i : i + 2] = -right @ [ds, 0.0]
    new = F @ mean + f

    # One error of ds and one of dalpha move everything at once: one G for the whole state.
    G = np.zeros((size, 2))
    G[0, 0], G[1, 0] = mean[3], mean[2]
    G[2, 1], G[3, 1] = new[3], -new[2]
    for i in range(4, size, 2):
        G[i : i + 2, 0] = -right[:, 0]
        G[i : i + 2, 1] = new[i + 1], -new[i]
    return new, F @ cov @ F.T + G @ cov_increment @ G.T
