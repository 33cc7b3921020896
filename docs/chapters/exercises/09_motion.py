"""Exercise 9.1: find the motion.

Positions are normalised and homogeneous: rows x = (x, y, 1).  A motion is a rotation R (3, 3) and a
translation t (3,) of length 1 from camera a to camera b, X_b = R X_a + t; E = hat(t) R, and x_b^T E x_a = 0.
"""

import numpy as np


def nearest_essential(M: np.ndarray) -> np.ndarray:
    """Essential matrix (3, 3) with singular values 1, 1, 0 and the singular vectors of ``M (3, 3)``."""
    raise NotImplementedError


def motions(E: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Four motions (R, t) of an essential matrix ``E (3, 3)``, in any order; every R with det R = +1."""
    raise NotImplementedError


def cost(R: np.ndarray, t: np.ndarray, x_a: np.ndarray, x_b: np.ndarray) -> float:
    """Squared distance of one pair from the nearest point that is not behind a camera.

    Parameters
    ----------
    R : ndarray, shape (3, 3)
    t : ndarray, shape (3,)
    x_a, x_b : ndarray, shape (3,)

    Returns
    -------
    float
        The squared Sampson distance where the rays meet in front of both cameras; else the squared Sampson
        distance from the map x_b ~ R x_a, which needs (I + J J^T)^-1.
    """
    raise NotImplementedError


def find_motion(
    x_a: np.ndarray, x_b: np.ndarray, sigma: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Motion (R, t) between two pictures, from pairs of which up to a fifth are wrong.

    Parameters
    ----------
    x_a, x_b : ndarray, shape (N, 3)
        N is at least 50, and the points do not lie on a plane.
    sigma : float
        Standard deviation of a coordinate of the right pairs.
    rng : numpy.random.Generator
        For the samples.

    Returns
    -------
    (ndarray of shape (3, 3), ndarray of shape (3,))
        Within a few degrees of the truth: take samples of eight pairs, judge each by the mean of
        min(distance^2 / sigma^2, 4) over all pairs, and fit the best one again to all its pairs.
    """
    raise NotImplementedError
