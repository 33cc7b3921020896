"""The map from the board's plane to the image plane, a homography: normalised direct linear transform."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry.multiview.two_views import apply_homography as homography_images
from vslam_ref.geometry.multiview.two_views import fit_homography


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
    return fit_homography(X, x)


def apply_homography(H: ArrayLike, X_plane: ArrayLike) -> Array:
    """Images (..., N, 2) of points ``X_plane (..., N, 2)`` of the plane by ``H (..., 3, 3)``.

    Implements :eq:`eq-board-homography`.
    """
    return homography_images(H, X_plane)
