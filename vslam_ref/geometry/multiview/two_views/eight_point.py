r"""Eight pairs and more: the matrix of the epipolar constraint by linear equations.

The constraint is linear in the nine numbers of the matrix,

.. math:: x_b^T M x_a = (x_b \otimes x_a)^T \operatorname{vec} M = 0 ,

one row a pair.  Eight rows in general position leave one matrix up to its size; more rows are solved by the
smallest singular vector.  What noise makes of it is no essential matrix: two singular values must be equal
and the third zero, and the nearest such matrix follows from the singular value decomposition.

**Normalisation.**  Columns of the system that differ by powers of the image's width would be weighed
unequally. So each set is first moved to its centre and scaled to a mean distance of sqrt(2), and the
answer is moved back.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array, transpose
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, conditioner, homogeneous, moved

UNIQUE = 1e-9
"""Share of the largest singular value below which the second smallest counts as zero, too."""


class LinearEssential(NamedTuple):
    """An essential matrix by linear equations.

    Attributes
    ----------
    E : ndarray, shape (..., 3, 3)
        Singular values 1, 1, 0; no unit.
    unique : ndarray of bool, shape (...)
        Whether the equations had one solution.  They have several where all points lie on a plane, and
        where the camera only turned.
    gap : ndarray, shape (...)
        Smallest over second smallest singular value of the equations, a ratio from 0 to 1: near 1 the answer
        is a guess.
    """

    E: Array
    unique: BoolArray
    gap: Array


def linear_essential(xn_a: ArrayLike, xn_b: ArrayLike) -> LinearEssential:
    """Essential matrix of eight or more pairs, in least squares of the algebraic error.

    Implements :eq:`eq-eight-point`.

    Parameters
    ----------
    xn_a, xn_b : array_like, shape (..., N, 2)
        Normalised image positions of the same points, N at least 8; no unit.

    Returns
    -------
    LinearEssential

    Raises
    ------
    ValueError
        If shapes differ, a number is not finite, or there are fewer than eight pairs.

    Examples
    --------
    >>> X = np.array([[x, y, 4 + x * y + (x - y) ** 2 / 3] for x in (-1.0, 0, 1) for y in (-1.0, 0, 1)])
    >>> Y = X + [-1.0, 0, 0]  # camera b stands one to the right
    >>> found = linear_essential(X[:, :2] / X[:, 2:], Y[:, :2] / Y[:, 2:])
    >>> (found.E / found.E[2, 1]).round(9) + 0.0
    array([[ 0.,  0.,  0.],
           [ 0.,  0., -1.],
           [ 0.,  1.,  0.]])
    """
    M, unique, gap = _linear(xn_a, xn_b)
    return LinearEssential(nearest_essential(M), unique, gap)


def linear_fundamental(uv_a: ArrayLike, uv_b: ArrayLike) -> Array:
    """Fundamental matrix (..., 3, 3) of eight or more pairs of pixels ``uv (..., N, 2)``: rank two, norm 1.

    Implements :eq:`eq-eight-point`, with both sets normalised.

    Raises
    ------
    ValueError
        If shapes differ, a number is not finite, or there are fewer than eight pairs.
    """
    M, _, _ = _linear(uv_a, uv_b)
    return M


def nearest_essential(M: ArrayLike) -> Array:
    """Essential matrix (..., 3, 3) with singular values 1, 1, 0 that is nearest to a multiple of M.

    Implements :eq:`eq-nearest-essential`.  ``M (..., 3, 3)`` has any unit.

    Examples
    --------
    >>> nearest_essential(np.diag([3.0, 1.0, 0.5])).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]
    """
    U, _, Vt = np.linalg.svd(as_array("M", M, 3, 3))
    return np.asarray(U[..., :, :2] @ Vt[..., :2, :])


def epipolar_rows(a: Array, b: Array) -> Array:
    """One equation a pair, (..., N, 9), for vec(M) row by row: x_b (x) x_a.

    ``a (..., N, 2)`` and ``b (..., N, 2)`` in any unit.
    """
    rows = homogeneous(b)[..., :, None] * homogeneous(a)[..., None, :]
    return np.asarray(rows.reshape(*rows.shape[:-2], 9))


def _linear(x_a: ArrayLike, x_b: ArrayLike) -> tuple[Array, BoolArray, Array]:
    """Matrix of rank two, whether it is the only one, and the ratio of the smallest singular values."""
    a, b = checked_pairs(x_a, x_b, 8)
    T_a, T_b = conditioner(a), conditioner(b)
    rows = epipolar_rows(moved(T_a, a), moved(T_b, b))
    # with more than nine rows, the triangle has the same null vector and is small
    triangle = np.linalg.qr(rows, mode="r") if rows.shape[-2] > 9 else rows
    _, s, Vt = np.linalg.svd(triangle, full_matrices=True)
    s = np.concatenate([s, np.zeros((*s.shape[:-1], 9 - s.shape[-1]))], axis=-1)
    U, d, Wt = np.linalg.svd(Vt[..., -1, :].reshape(*s.shape[:-1], 3, 3))
    flat = (U[..., :, :2] * d[..., None, :2]) @ Wt[..., :2, :]
    M = transpose(T_b) @ flat @ T_a
    M = M / np.linalg.norm(M, axis=(-2, -1), keepdims=True)
    gap = s[..., 8] / np.where(s[..., 7] > 0, s[..., 7], 1.0)
    return M, s[..., 7] > UNIQUE * s[..., 0], np.where(s[..., 7] > 0, gap, 1.0)
