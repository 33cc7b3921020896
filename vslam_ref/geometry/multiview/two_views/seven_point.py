r"""Seven pairs of pixels: the fundamental matrices that fit them, one or three.

Seven rows of the epipolar constraint leave a line of matrices, :math:`F = \lambda A + (1 - \lambda) B`, and
:math:`\det F = 0` is a cubic in :math:`\lambda`.  No camera is needed, and one pair less than for eight
points means fewer samples until one is clean.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, transpose
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, conditioner, moved
from vslam_ref.geometry.multiview.two_views.eight_point import epipolar_rows

REAL = 1e-8
"""Imaginary part of a root below which it counts as real."""


class SevenPointMatrices(NamedTuple):
    """Fundamental matrices of samples of seven pairs.

    Attributes
    ----------
    F : ndarray, shape (..., 3, 3, 3)
        Up to three, of norm 1; zero where there is none.  Pixels of a and b: x_b^T F x_a = 0.
    valid : ndarray of bool, shape (..., 3)
        Which there are; no unit.
    """

    F: Array
    valid: BoolArray


def seven_point_fundamentals(uv_a: ArrayLike, uv_b: ArrayLike) -> SevenPointMatrices:
    """Find all fundamental matrices of seven pairs.

    Parameters
    ----------
    uv_a, uv_b : array_like, shape (..., 7, 2)
        Positions, pixels.

    Returns
    -------
    SevenPointMatrices

    Raises
    ------
    ValueError
        If shapes are others, or a number is not finite.

    Notes ----- Where the pairs lie on a plane, the seven rows leave more than a line of matrices, and the
    answer is some of those that fit.

    Examples
    --------
    >>> X = np.random.default_rng(1).uniform(-1, 1, (7, 3)) + [0, 0, 4]
    >>> a, b = 500 * X[:, :2] / X[:, 2:], 500 * (X[:, :2] - [1, 0]) / X[:, 2:]
    >>> found = seven_point_fundamentals(a, b)  # camera b stands one to the right
    >>> ranked = found.F[found.valid] / found.F[found.valid][:, 2:, 1:2]
    >>> bool(np.abs(ranked - [[0, 0, 0], [0, 0, -1], [0, 1, 0]]).max((1, 2)).min() < 1e-9)
    True
    """
    a, b = checked_pairs(uv_a, uv_b, 7, exact=True)
    T_a, T_b = conditioner(a), conditioner(b)
    _, _, Vt = np.linalg.svd(epipolar_rows(moved(T_a, a), moved(T_b, b)), full_matrices=True)
    A, B = (Vt[..., k, :].reshape(*Vt.shape[:-2], 3, 3) for k in (7, 8))
    root, valid = _real_roots(_determinants(A, B))
    share = root[..., None, None]
    F = transpose(T_b)[..., None, :, :] @ (share * A[..., None, :, :] + (1 - share) * B[..., None, :, :])
    F = F @ T_a[..., None, :, :]
    size = np.linalg.norm(F, axis=(-2, -1), keepdims=True)
    valid = valid & (size[..., 0, 0] > 0)
    return SevenPointMatrices(np.where(valid[..., None, None], F / np.where(size > 0, size, 1.0), 0.0), valid)


def _determinants(A: Array, B: Array) -> Array:
    """Coefficients (..., 4) of det(x A + (1 - x) B), that of x^3 first, from its values at four x."""
    at = np.array([-1.0, 0.0, 1.0, 2.0])
    shape = at.reshape(4, 1, 1)
    values = np.linalg.det(shape * A[..., None, :, :] + (1 - shape) * B[..., None, :, :])
    return np.asarray(values @ np.linalg.inv(np.vander(at)).T)


def _real_roots(c: Array) -> tuple[Array, BoolArray]:
    """Roots (..., 3) of cubics (..., 4), and which of them are real."""
    lead = np.where(np.abs(c[..., 0]) > 1e-12 * np.abs(c).max(-1), c[..., 0], np.inf)  # else none: very rare
    companion = np.zeros((*c.shape[:-1], 3, 3))
    companion[..., 0, :] = -c[..., 1:] / lead[..., None]
    companion[..., 1, 0] = companion[..., 2, 1] = 1.0
    roots = np.linalg.eigvals(companion)
    real = (np.abs(roots.imag) <= REAL * (1 + np.abs(roots.real))) & np.isfinite(lead)[..., None]
    return np.where(real, roots.real, 0.0), real
