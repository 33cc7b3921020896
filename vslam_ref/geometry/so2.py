"""SO(2), the rotations of the plane.

An element is stored as its angle (radians, wrapped to (-pi, pi]) or as a 2 x 2 matrix.  All
functions take any batch shape ``(...)``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def wrap(angle: ArrayLike) -> Array:
    """Wrap angles to (-pi, pi].

    Parameters
    ----------
    angle : array_like, shape (...)
        Radians.

    Returns
    -------
    ndarray, shape (...)
        The same rotation in (-pi, pi].  Angles already inside come back bit for bit.

    Examples
    --------
    >>> bool(wrap(3 * np.pi) == np.pi)
    True
    """
    a = np.asarray(angle, dtype=np.float64)
    inside = (a > -np.pi) & (a <= np.pi)
    if inside.all():
        return a.copy()
    turned = np.pi - np.mod(np.pi - a, 2.0 * np.pi)
    # mod of a number a hair below 0 rounds to 2 pi, which would give -pi, the excluded end
    turned = np.where(turned <= -np.pi, np.pi, turned)
    return np.where(inside, a, turned)


def exp(phi: ArrayLike) -> Array:
    """Rotation matrix of an angle, shape (...) -> (..., 2, 2): ``[[cos, -sin], [sin, cos]]``."""
    phi = np.asarray(phi, dtype=np.float64)
    c, s = np.cos(phi), np.sin(phi)
    return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)


def log(R: ArrayLike) -> Array:
    """Angle in (-pi, pi] of a rotation matrix, shape (..., 2, 2) -> (...)."""
    R = np.asarray(R, dtype=np.float64)
    angle: Array = np.arctan2(R[..., 1, 0] - R[..., 0, 1], R[..., 0, 0] + R[..., 1, 1])
    return angle


def act(phi: ArrayLike, x: ArrayLike) -> Array:
    """Rotate points ``x (..., 2)`` by angles ``phi (...)``."""
    phi, x = np.asarray(phi, dtype=np.float64), np.asarray(x, dtype=np.float64)
    c, s = np.cos(phi), np.sin(phi)
    return np.stack([c * x[..., 0] - s * x[..., 1], s * x[..., 0] + c * x[..., 1]], -1)


def nearest(M: ArrayLike) -> Array:
    """Rotation matrix nearest to ``M (..., 2, 2)`` in the Frobenius norm.

    It maximises tr(R^T M); with R = R(phi) that is cos(phi)(M00 + M11) + sin(phi)(M10 - M01),
    so :func:`log`'s arctan2 of these two sums is the answer.

    Raises
    ------
    ValueError
        If both sums vanish: then every rotation is equally near.
    """
    M = np.asarray(M, dtype=np.float64)
    even, odd = M[..., 0, 0] + M[..., 1, 1], M[..., 1, 0] - M[..., 0, 1]
    if np.any(np.hypot(even, odd) == 0.0):
        raise ValueError("nearest rotation undefined: M00 + M11 and M10 - M01 both vanish")
    angle: Array = np.arctan2(odd, even)
    return exp(angle)
