"""Rigid alignment of a planar trajectory with its reference, without scale.

The best rotation R(phi) and translation t of ``sum |R p_k + t - q_k|^2``: after both point sets are
centred, the sum is smallest where ``sum q_k^T R p_k`` is largest, which
:func:`vslam_ref.geometry.so2.nearest` answers for the 2 x 2 matrix ``sum q_k p_k^T``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import so2


def align_rigid(points: ArrayLike, reference: ArrayLike) -> Array:
    """Pose ``T_reference_points`` (3,) that brings points (N, 2) closest to the reference (N, 2).

    Implements the minimum of :eq:`eq-umeyama` in the plane, with s = 1.  Metres and radians.

    Raises
    ------
    ValueError
        With fewer than two points, different shapes, or points that determine no rotation (all of one
        set at one place).

    Examples
    --------
    >>> align_rigid([[0, 0], [1, 0]], [[5, 5], [5, 6]]).round(4)
    array([5.    , 5.    , 1.5708])
    """
    p, q = np.asarray(points, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    if p.shape != q.shape or p.ndim != 2 or p.shape[1] != 2 or len(p) < 2:
        raise ValueError(f"points {p.shape} and reference {q.shape}: need (N, 2) twice, N >= 2")
    centre_p, centre_q = p.mean(0), q.mean(0)
    R = so2.nearest((q - centre_q).T @ (p - centre_p))
    return np.array([*(centre_q - R @ centre_p), so2.log(R)])


def root_mean_square(errors: ArrayLike) -> float:
    """Root of the mean squared length.

    Parameters
    ----------
    errors : array_like, shape (N, d) or (N,)
        Error vectors, or numbers.

    Returns
    -------
    float
        In the unit of the errors.
    """
    e = np.asarray(errors, dtype=np.float64)
    return float(np.sqrt(np.mean(np.sum(np.atleast_2d(e.T).T ** 2, -1))))
