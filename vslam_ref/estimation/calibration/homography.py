"""The map from the board's plane to the image plane, a homography: normalised direct linear transform."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array


def homography(X_plane: ArrayLike, x_image: ArrayLike) -> Array:
    """Homography H with x_image ~ H (X_plane, 1), in least squares of the algebraic error.

    Implements :eq:`eq-board-dlt`.

    Parameters
    ----------
    X_plane : array_like, shape (..., N, 2)
        Points of the board's plane, at least four, no three of four on a line.
    x_image : array_like, shape (..., N, 2)
        Their images, in pixels or normalised.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Frobenius norm 1, and the plane's points in front: the third coordinate is positive on average.

    Raises
    ------
    ValueError
        On wrong shapes, or fewer than four points.

    Notes
    -----
    Both sets are first moved to their centre and scaled to mean distance sqrt(2) (Hartley): the columns of
    the linear system then have like lengths, and its condition falls by orders of magnitude.

    Examples
    --------
    >>> X = [[0, 0], [1, 0], [1, 1], [0, 1]]
    >>> H = homography(X, [[10, 20], [12, 20], [12, 24], [10, 24]])
    >>> (np.round(H / H[2, 2], 9) + 0.0).tolist()
    [[2.0, 0.0, 10.0], [0.0, 4.0, 20.0], [0.0, 0.0, 1.0]]
    """
    X, x = np.asarray(X_plane, dtype=np.float64), np.asarray(x_image, dtype=np.float64)
    if X.ndim < 2 or X.shape != x.shape or X.shape[-1] != 2 or X.shape[-2] < 4:
        raise ValueError(f"X_plane {X.shape} and x_image {x.shape}: need (..., N, 2), N at least 4")
    T_X, T_x = _conditioner(X), _conditioner(x)
    a, b = _apply_affine(T_X, X), _apply_affine(T_x, x)
    rows = _rows(a, b)
    # the triangle has the same null vector and is small
    triangle = np.linalg.qr(rows, mode="r")
    H = np.linalg.svd(triangle, full_matrices=True)[2][..., -1, :].reshape(*X.shape[:-2], 3, 3)
    H = np.linalg.inv(T_x) @ H @ T_X
    depth = (X @ H[..., 2, :2, None])[..., 0].mean(axis=-1) + H[..., 2, 2]
    sign = np.where(depth < 0, -1.0, 1.0) / np.linalg.norm(H, axis=(-2, -1))
    oriented: Array = H * sign[..., None, None]
    return oriented


def apply_homography(H: ArrayLike, X_plane: ArrayLike) -> Array:
    """Images (..., N, 2) of points ``X_plane (..., N, 2)`` of the plane by ``H (..., 3, 3)``.

    Implements :eq:`eq-board-homography`.
    """
    H, X = np.asarray(H, dtype=np.float64), np.asarray(X_plane, dtype=np.float64)
    Y = X @ np.swapaxes(H[..., :, :2], -1, -2) + H[..., None, :, 2]
    image: Array = Y[..., :2] / Y[..., 2:]
    return image


def _rows(X: Array, x: Array) -> Array:
    """Two equations a point, (..., 2 N, 9): h1.X - u h3.X = 0 and h2.X - v h3.X = 0."""
    full = np.concatenate([X, np.ones((*X.shape[:-1], 1))], axis=-1)
    rows = np.zeros((*X.shape[:-1], 2, 9))
    rows[..., 0, 0:3] = rows[..., 1, 3:6] = full
    rows[..., 6:9] = -x[..., :, None] * full[..., None, :]
    return rows.reshape(*X.shape[:-2], -1, 9)


def _conditioner(x: Array) -> Array:
    """Similarity (..., 3, 3) that moves the points to centre 0 and mean distance sqrt(2)."""
    centre = x.mean(axis=-2)
    distance = np.linalg.norm(x - centre[..., None, :], axis=-1).mean(axis=-1)
    scale = np.sqrt(2.0) / np.where(distance > 0, distance, 1.0)
    T = np.zeros((*centre.shape[:-1], 3, 3))
    T[..., 0, 0] = T[..., 1, 1] = scale
    T[..., :2, 2] = -scale[..., None] * centre
    T[..., 2, 2] = 1.0
    return T


def _apply_affine(T: Array, x: Array) -> Array:
    moved: Array = x * T[..., None, [0, 1], [0, 1]] + T[..., None, :2, 2]
    return moved
