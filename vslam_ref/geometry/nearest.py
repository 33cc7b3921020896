"""The rotation of space that is nearest to a matrix: the orthogonal Procrustes problem."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array

_TOLERANCE = 8 * float(np.finfo(np.float64).eps)
"""Relative to the largest singular value: what an SVD of a 3 x 3 matrix may be off."""


class NearestRotation(NamedTuple):
    """``R (..., 3, 3)``, and ``trace (...)``, the largest value of tr(R^T M)."""

    R: Array
    trace: Array


def nearest_rotation(M: ArrayLike) -> NearestRotation:
    """Rotation nearest to a matrix in the Frobenius norm.

    |R - M|^2 = 3 + |M|^2 - 2 tr(R^T M), so the trace is what is maximised.  With M = U S V^T the best
    orthogonal matrix is U V^T.  Where this is a reflection, the column of U that belongs to the smallest
    singular value is turned around: that costs the least.

    Parameters
    ----------
    M : array_like, shape (..., 3, 3)

    Returns
    -------
    NearestRotation

    Raises
    ------
    ValueError
        If the answer is not unique: rank below 2, or a reflection whose two smallest singular values are
        equal.  Also if M is not finite.

    Examples
    --------
    >>> found = nearest_rotation(np.diag([2.0, 3.0, -0.1]))
    >>> found.R.tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    >>> round(float(found.trace), 12)
    4.9
    """
    M = as_array("M", M, 3, 3)
    if not np.isfinite(M).all():
        raise ValueError("nearest rotation undefined: the matrix is not finite")
    U, S, Vt = np.linalg.svd(M)
    sign = np.sign(np.linalg.det(U) * np.linalg.det(Vt))
    gap = S[..., 1] + sign * S[..., 2]
    if np.any(gap <= _TOLERANCE * S[..., 0]):
        raise ValueError(
            f"nearest rotation undefined: singular values {S.reshape(-1, 3)[np.argmin(gap)]} "
            f"with determinant sign {sign.reshape(-1)[np.argmin(gap)]:+.0f}; need s2 + sign * s3 > 0"
        )
    U[..., :, 2] *= sign[..., None]
    return NearestRotation(U @ Vt, S[..., 0] + gap)
