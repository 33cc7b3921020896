"""Exercise 7.1: a camera from homographies."""

import numpy as np


def sensor(H: np.ndarray) -> np.ndarray | None:
    """Camera matrix of a camera without distortion and skew, by Zhang's closed form.

    Parameters
    ----------
    H : ndarray, shape (V, 3, 3)
        Homographies from the board's plane to pixels, each with a factor of its own that may be negative.

    Returns
    -------
    ndarray, shape (3, 3), or None
        K = [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]; None where the boards do not determine it.
    """
    raise NotImplementedError


def pose(H: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Pose of the board from its homography.

    Parameters
    ----------
    H : ndarray, shape (3, 3)
        From the board's plane to pixels, up to a factor that may be negative.
    K : ndarray, shape (3, 3)
        Camera matrix.

    Returns
    -------
    ndarray, shape (4, 4)
        T_cam_board; its rotation is one, and the board's origin has z > 0 in the camera.
    """
    raise NotImplementedError
