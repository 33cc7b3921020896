"""Solution of exercise 2.1: the logarithm of a rotation that survives half a turn.

The library goes through the quaternion; here is a second way.  R has a symmetric part, cos I + (1 - cos) a
a^T, and an antisymmetric one, sin hat(a).  The angle comes from both, by atan2.  The axis comes from the
antisymmetric part where sin is not small against 1 - cos, and else from the symmetric one; the sign is
always that of the former.
"""

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
    turn = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2  # sin a
    sine, cosine = np.linalg.norm(turn), (np.trace(R) - 1) / 2
    if cosine > 0:
        # below a quarter turn: angle / sin is smooth, and 1 where both vanish
        return turn if sine == 0 else np.arctan2(sine, cosine) / sine * turn
    outer = (R + R.T) / 2 - cosine * np.eye(3)  # (1 - cos) a a^T: every column points along the axis
    column = outer[:, np.argmax(np.diag(outer))]
    axis = column / np.linalg.norm(column)
    return np.arctan2(sine, cosine) * (axis if axis @ turn >= 0 else -axis)
