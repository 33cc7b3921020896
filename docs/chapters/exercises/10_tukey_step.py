"""Exercise 10.1: one reweighted step.

An error is predicted minus measured, divided by the size of its level's pixel: ``e``, shape (n, 2).
A perturbation of a pose is xi = (rho, phi), from the left: T <- Exp(xi) T.
"""

import numpy as np


def scale(e: np.ndarray) -> float:
    """Standard deviation of one coordinate, from the median of the norms; at least 0.4 pixels.

    Parameters
    ----------
    e : ndarray, shape (n, 2)
        Plane errors, pixels; up to half of them may be wrong.

    Returns
    -------
    float
    """
    raise NotImplementedError


def weights(e: np.ndarray, sigma: float) -> np.ndarray:
    """Tukey's weights (n,) of errors (n, 2): 95 % efficient for norms of plane errors of the scale sigma."""
    raise NotImplementedError


def step(e: np.ndarray, J: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Step mu (6,) of least weighted squares.

    Parameters
    ----------
    e : ndarray, shape (n, 2)
        Predicted minus measured.
    J : ndarray, shape (n, 2, 6)
        Derivative of e in mu.
    w : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (6,)
    """
    raise NotImplementedError


def pose(X_world: np.ndarray, xn: np.ndarray, f: float, T: np.ndarray, steps: int = 10) -> np.ndarray:
    """Pose of a pinhole camera after some reweighted steps.

    Parameters
    ----------
    X_world : ndarray, shape (n, 3)
    xn : ndarray, shape (n, 2)
        Where the points were found: (u - u0)/f, (v - v0)/f, without unit.
    f : float
        Pixels: errors count in pixels of level 0.
    T : ndarray, shape (4, 4)
        Start, T_cam_world.
    steps : int

    Returns
    -------
    ndarray, shape (4, 4)
        A rigid motion: use ``vslam_ref.geometry.se3.exp`` for Exp.
    """
    raise NotImplementedError
