"""Is a matrix a rotation?  What logarithms and quaternions ask before they answer.

A reflection, a scaled or a sheared matrix has no rotation vector; formulas that read one off some of its
entries answer all the same.  So they check, and name what is wrong.  Rounded digits are let through: an
entry that a file gives with four decimals is 5e-5 off at most, which moves an entry of R^T R - I by
2 sqrt(3) 5e-5 = 1.7e-4; three decimals by 1.7e-3, and a product of a few such matrices by the sum.  One
percent of scale moves it by 2e-2 and is no rounding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, transpose
from vslam_ref.geometry.nearest import nearest_rotation

OFF = 1e-2
"""Largest entry of R^T R - I that is taken for rounding."""
MANY = 1000
"""Numbers from which on the check goes entry by entry over a whole batch."""


def require_rotation(name: str, M: Array) -> None:
    """Raise ValueError unless ``M (..., n, n)``, n = 2 or 3, are rotations up to rounding; no unit.

    Raises
    ------
    ValueError
        With the name, and how the first matrix that is none differs: a number that is not finite, a
        determinant that is not positive (a reflection), or R^T R further than :data:`OFF` from the identity.

    Examples
    --------
    >>> require_rotation("R", np.diag([1.0, 1.0, -1.0]))
    Traceback (most recent call last):
    ValueError: R is a reflection, no rotation: its determinant is -1
    """
    n = M.shape[-1]
    off, det = _by_matrices(M) if M.size < MANY else _by_entries(M)
    good = (off <= OFF) & (det > 0.0)
    if good.all():
        return
    k = int(np.argmin(good.reshape(-1)))
    which = name if M.ndim == 2 else f"{name}[{', '.join(map(str, np.unravel_index(k, good.shape)))}]"
    d, e = float(det.reshape(-1)[k]), float(off.reshape(-1)[k])
    if not np.isfinite(M.reshape(-1, n, n)[k]).all():
        raise ValueError(f"{which} is no rotation: a number is not finite")
    if d < 0.0 and e <= OFF:
        raise ValueError(f"{which} is a reflection, no rotation: its determinant is {d:.6g}")
    raise ValueError(
        f"{which} is no rotation: R^T R is {e:.3g} off the identity (at most {OFF:g} is taken for rounding), "
        f"its determinant is {d:.3g}; with project=True the nearest rotation is taken"
    )


def _by_matrices(M: Array) -> tuple[Array, Array]:
    """Largest entry of R^T R - I, and the determinant, of a few matrices (..., n, n), shapes (...)."""
    off = np.abs(transpose(M) @ M - np.eye(M.shape[-1])).max(axis=(-2, -1))
    return np.asarray(off), np.asarray(np.linalg.det(M))


def _by_entries(M: Array) -> tuple[Array, Array]:
    """The same of many matrices, entry by entry: five to ten times as quick."""
    columns = np.ascontiguousarray(np.moveaxis(M, (-1, -2), (0, 1)))  # (column, row, ...)
    off = np.zeros(M.shape[:-2])
    for i, a in enumerate(columns):
        for j, b in enumerate(columns[i:], i):
            off = np.maximum(off, np.abs(np.sum(a * b, axis=0) - (i == j)))
    if len(columns) == 2:
        (a, b), (c, d) = columns
        return off, a * d - b * c
    a, b, c = columns
    return off, sum(a[k] * (b[k - 2] * c[k - 1] - b[k - 1] * c[k - 2]) for k in range(3))


def rotation_of(name: str, R: ArrayLike, project: bool) -> Array:
    """The rotations that are meant by ``R (..., 3, 3)``: themselves if they are some, or the nearest ones.

    No unit.

    Raises
    ------
    ValueError
        As :func:`require_rotation`, or, with ``project``, where the nearest rotation is not unique.
    """
    R = as_array(name, R, 3, 3)
    if project:
        return nearest_rotation(R).R
    require_rotation(name, R)
    return R
