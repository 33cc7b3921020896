"""Exercise 3.1: the FOV camera, there and back."""

import numpy as np


def project(params: np.ndarray, X_cam: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Project points with the FOV camera, equations (A2.2) to (A2.4).

    Parameters
    ----------
    params : ndarray, shape (5,)
        fx, fy, cx, cy in pixels, and omega in radians, 0 <= omega < pi.
    X_cam : ndarray, shape (N, 3)
        Points in the camera's frame.

    Returns
    -------
    uv : ndarray, shape (N, 2)
        Pixels; the principal point where not valid.
    valid : ndarray of bool, shape (N,)
        False behind the camera, z <= 0.
    """
    raise NotImplementedError


def unproject(params: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the normalised position (x/z, y/z) that appears at a pixel.

    Parameters
    ----------
    params : ndarray, shape (5,)
        As for ``project``.
    uv : ndarray, shape (N, 2)
        Pixels.

    Returns
    -------
    xn : ndarray, shape (N, 2)
        Normalised positions; zero where not valid.
    valid : ndarray of bool, shape (N,)
        False where no ray in front of the camera appears.
    """
    raise NotImplementedError
