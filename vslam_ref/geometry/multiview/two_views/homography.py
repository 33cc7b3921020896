r"""The map of a plane, or of a camera that only turns, from one picture to the other.

Points of a plane :math:`n^T X_a = d` in the frame of camera a move as

.. math:: X_b = R X_a + t = (R + t n^T / d) X_a = H X_a ,

so :math:`x_b \sim H x_a`.  Each pair gives two linear equations for the nine numbers of H; four pairs, no
three on a line, are enough.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, conditioner, homogeneous, moved


def fit_homography(x_a: ArrayLike, x_b: ArrayLike) -> Array:
    """Homography H with x_b ~ H x_a, in least squares of the algebraic error, for many sets at once.

    Implements :eq:`eq-homography-dlt`.

    Parameters
    ----------
    x_a, x_b : array_like, shape (..., N, 2)
        The same points in both pictures, normalised positions or pixels, N at least 4.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Norm 1; its sign is such that H (x_a, 1) has a positive third coordinate on average.

    Raises
    ------
    ValueError
        If shapes differ, a number is not finite, or there are fewer than four pairs.

    Notes
    -----
    Both sets are first moved to their centre and scaled to mean distance sqrt(2).  Where three of four points
    lie on a line the answer is singular, or one of many.

    Examples
    --------
    >>> x = [[0, 0], [1, 0], [1, 1], [0, 1]]
    >>> H = fit_homography(x, [[10, 20], [12, 20], [12, 24], [10, 24]])
    >>> (np.round(H / H[2, 2], 9) + 0.0).tolist()
    [[2.0, 0.0, 10.0], [0.0, 4.0, 20.0], [0.0, 0.0, 1.0]]
    """
    a, b = checked_pairs(x_a, x_b, 4)
    T_a, T_b = conditioner(a), conditioner(b)
    rows = _rows(moved(T_a, a), moved(T_b, b))
    # with more than nine rows, the triangle has the same null vector and is small
    triangle = np.linalg.qr(rows, mode="r") if rows.shape[-2] > 9 else rows
    H = np.linalg.svd(triangle, full_matrices=True)[2][..., -1, :].reshape(*a.shape[:-2], 3, 3)
    H = np.linalg.inv(T_b) @ H @ T_a
    depth = (a @ H[..., 2, :2, None])[..., 0].mean(axis=-1) + H[..., 2, 2]
    sign = np.where(depth < 0, -1.0, 1.0) / np.linalg.norm(H, axis=(-2, -1))
    return np.asarray(H * sign[..., None, None])


def plane_homography(T_b_a: ArrayLike, normal: ArrayLike, distance: ArrayLike) -> Array:
    """R + t n^T / d (..., 3, 3), the homography of a plane between normalised positions.

    Implements :eq:`eq-plane-homography`.

    Parameters
    ----------
    T_b_a : array_like, shape (..., 4, 4)
        From camera a to camera b.
    normal : array_like, shape (..., 3)
        Of the plane n . X_a = d in the frame of camera a.
    distance : array_like, shape (...)
        d, in the unit of the translation; not zero.

    Raises
    ------
    ValueError
        If shapes do not fit, or a distance is zero.

    Examples
    --------
    >>> plane_homography(np.eye(4), [0.0, 0.0, 1.0], 2.0).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    T, n = as_array("T_b_a", T_b_a, 4, 4), as_array("normal", normal, 3)
    d = np.asarray(distance, dtype=np.float64)[..., None, None]
    if (d == 0.0).any():
        raise ValueError("the plane passes through camera a: its distance must not be 0")
    return np.asarray(T[..., :3, :3] + T[..., :3, 3, None] * n[..., None, :] / d)


def apply_homography(H: ArrayLike, x: ArrayLike) -> Array:
    """Images (..., N, 2) of points ``x (..., N, 2)`` under ``H (..., 3, 3)``; normalised, or in pixels.

    Implements :eq:`eq-plane-homography`.  On the line that H sends to infinity the answer is infinite.
    """
    H, x = as_array("H", H, 3, 3), as_array("x", x, 2)
    Y = homogeneous(x) @ np.swapaxes(H, -1, -2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(Y[..., :2] / Y[..., 2:])


def _rows(a: Array, b: Array) -> Array:
    """Two equations a pair, (..., 2 N, 9): h1.x - u h3.x = 0 and h2.x - v h3.x = 0."""
    full = homogeneous(a)
    rows = np.zeros((*a.shape[:-1], 2, 9))
    rows[..., 0, 0:3] = rows[..., 1, 3:6] = full
    rows[..., 6:9] = -b[..., :, None] * full[..., None, :]
    return rows.reshape(*a.shape[:-2], -1, 9)
