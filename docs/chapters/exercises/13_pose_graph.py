"""Exercise 13.1: a pose graph of the plane."""

import numpy as np


def solve(
    poses: np.ndarray, tail: np.ndarray, head: np.ndarray, measured: np.ndarray, information: np.ndarray
) -> np.ndarray:
    """Find the poses with the least sum of e^T Omega e, where e is (translation, angle) of Z^-1 X_i^-1 X_j.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        Start: x, y, theta.
    tail, head : ndarray of int, shape (m,)
        Numbers i and j of each edge.
    measured : ndarray, shape (m, 3)
        Z of each edge: x, y, theta of j as seen from i.
    information : ndarray, shape (m, 3, 3)
        Omega of each edge, symmetric.

    Returns
    -------
    ndarray, shape (n, 3)
        The first pose is that of the start.
    """
    raise NotImplementedError
