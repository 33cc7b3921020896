r"""Where rays pass closest: the simplest triangulation, in closed form.

A point X has the distance :math:`\lVert (I - b b^T)(X - p) \rVert` from the line through p along the unit
bearing b.  The sum of the squares over both lines is smallest where

.. math:: A X = \sum_k P_k\, p_k, \qquad P_k = I - b_k b_k^T, \quad A = P_1 + P_2 ,

the middle of the shortest segment between them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, times


class Midpoint(NamedTuple):
    """Point, and its Jacobians in both centres and both directions.

    Attributes
    ----------
    value : ndarray, shape (..., 3)
        In the unit of the centres.
    J_p_a, J_b_a, J_p_b, J_b_b : ndarray, shape (..., 3, 3)
    """

    value: Array
    J_p_a: Array
    J_b_a: Array
    J_p_b: Array
    J_b_b: Array


def midpoint(p_a: ArrayLike, b_a: ArrayLike, p_b: ArrayLike, b_b: ArrayLike) -> Array:
    """Middle of the shortest segment between two lines.

    Implements :eq:`eq-midpoint`.

    Parameters
    ----------
    p_a, b_a : array_like, shapes (..., 3), (..., 3)
        Point on the first line, such as a camera's centre, in any unit, and a direction of any length.
    p_b, b_b : array_like, shapes (..., 3), (..., 3)
        The same of the second line, in the same frame.

    Returns
    -------
    ndarray, shape (..., 3)
        In the unit of the points.

    Raises
    ------
    ValueError
        If two lines are parallel to rounding, or a direction has no length.

    Examples
    --------
    >>> midpoint([0, 0, 0], [0, 0, 1], [1, 0.2, 0], [-1, 0, 5]).round(12) + 0.0
    array([0. , 0.1, 5. ])
    """
    return midpoint_with_jacobians(p_a, b_a, p_b, b_b).value


def midpoint_with_jacobians(p_a: ArrayLike, b_a: ArrayLike, p_b: ArrayLike, b_b: ArrayLike) -> Midpoint:
    """:func:`midpoint` and its Jacobians.

    Implements :eq:`eq-midpoint-jacobian`.
    From A X = sum P p, a change of P moves X by A^-1 dP w with w = p - X, and dP = -(db b^T + b db^T):
    dX/db = -A^-1 ((b.w) I + b w^T).  The direction is normalised first: another factor,
    (I - b b^T) over its length.
    """
    centres = [as_array("p_a", p_a, 3), as_array("p_b", p_b, 3)]
    lengths, units = [], []
    for name, given in (("b_a", b_a), ("b_b", b_b)):
        b = as_array(name, given, 3)
        length = np.linalg.norm(b, axis=-1, keepdims=True)
        if not (np.isfinite(length).all() and (length > 0).all()):
            raise ValueError(f"{name}: a direction must be finite and have a length")
        lengths.append(length)
        units.append(b / length)
    across = [np.eye(3) - b[..., :, None] * b[..., None, :] for b in units]  # P
    A = across[0] + across[1]
    if not (np.linalg.cond(A) < 1e15).all():
        raise ValueError("the two lines are parallel: no point is closest")
    right = times(across[0], centres[0]) + times(across[1], centres[1])
    X = np.linalg.solve(A, right[..., None])[..., 0]
    J = []
    for P, p, b, length in zip(across, centres, units, lengths, strict=True):
        w = p - X
        along = np.sum(b * w, axis=-1)[..., None, None]
        J.append(np.linalg.solve(A, np.broadcast_to(P, A.shape)))
        turning = along * np.eye(3) + b[..., :, None] * w[..., None, :]
        J.append(-np.linalg.solve(A, turning @ P) / length[..., None])
    return Midpoint(X, J[0], J[1], J[2], J[3])
