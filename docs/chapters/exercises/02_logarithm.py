"""Exercise 2.1: the logarithm of a rotation that survives half a turn."""

import numpy as np


def log(R: np.ndarray) -> np.ndarray:
    """Find the rotation vector of a rotation matrix.

    Parameters
    ----------
    R : ndarray, shape (3, 3)
        A rotation: R R^T = I and det R = 1, up to rounding.

    Returns
    -------
    ndarray, shape (3,)
        phi, along the axis (right-hand rule), as long as the angle in radians, between 0 and pi.  At pi
        itself either end of the axis will do.
    """
    raise NotImplementedError
