"""Exercise 1.1: a point from several pictures, and how well it is known."""

import numpy as np


def project(P: np.ndarray, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels of one point in all pictures, and their derivatives.

    Parameters
    ----------
    P : ndarray, shape (V, 3, 4)
        Projection matrices K [R t] of V pinhole cameras.
    X : ndarray, shape (3,)
        A point of the world in front of all of them.

    Returns
    -------
    uv : ndarray, shape (V, 2)
        Its pixels.
    J : ndarray, shape (V, 2, 3)
        Derivatives of the pixels with respect to X.
    """
    raise NotImplementedError


def triangulate(P: np.ndarray, uv: np.ndarray, sigma: float) -> tuple[np.ndarray, np.ndarray, str]:
    """Find the point with the smallest sum of squared pixel errors.

    Parameters
    ----------
    P : ndarray, shape (V, 3, 4)
        Projection matrices K [R t], V >= 2; K has the last row (0, 0, 1).
    uv : ndarray, shape (V, 2)
        Measured pixels.
    sigma : float
        Standard deviation of one coordinate of a pixel.

    Returns
    -------
    X : ndarray, shape (3,)
        The point; finite in any case.
    cov : ndarray, shape (3, 3)
        Its covariance to first order; where ``reason`` is not empty, anything finite or infinite, but no NaN.
    reason : str
        Empty; or ``"no depth"`` where the rays do not fix a point (one centre, parallel rays), or
        ``"behind"`` where they meet behind a camera.
    """
    raise NotImplementedError
