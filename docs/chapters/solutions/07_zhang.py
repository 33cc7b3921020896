"""Solution of exercise 7.1: a camera from homographies.

Each homography gives two rows of a linear system in B11, B22, B13, B23, B33.  Homographies and pixels are
scaled first: rows of length about 1 make the singular values comparable, so that "the second smallest is
zero", more than one solution, can be seen.
"""

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
    N = np.diag([1e-3, 1e-3, 1.0])  # pixels of about one
    M = N @ H
    M = M / np.linalg.norm(M, axis=(1, 2), keepdims=True)
    system = np.concatenate([_row(M, 0, 1), _row(M, 0, 0) - _row(M, 1, 1)])
    _, singular, vt = np.linalg.svd(system)
    if len(singular) < 4 or singular[3] < 1e-9 * singular[0]:
        return None
    b11, b22, b13, b23, b33 = vt[4]
    mu = b33 - b13**2 / b11 - b23**2 / b22
    if not (mu / b11 > 0 and mu / b22 > 0):
        return None
    K = np.array([[np.sqrt(mu / b11), 0, -b13 / b11], [0, np.sqrt(mu / b22), -b23 / b22], [0, 0, 1]])
    return np.linalg.inv(N) @ K


def _row(M: np.ndarray, i: int, j: int) -> np.ndarray:
    """Coefficients (V, 5) of column i, B, column j."""
    (a0, a1, a2), (b0, b1, b2) = M[:, :, i].T, M[:, :, j].T
    return np.stack([a0 * b0, a1 * b1, a0 * b2 + a2 * b0, a1 * b2 + a2 * b1, a2 * b2], axis=1)


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
    M = np.linalg.solve(K, H)
    M = M / np.linalg.norm(M[:, :2], axis=0).mean() * np.sign(M[2, 2])
    U, _, Vt = np.linalg.svd(np.column_stack([M[:, 0], M[:, 1], np.cross(M[:, 0], M[:, 1])]))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = U @ Vt, M[:, 2]
    return T
