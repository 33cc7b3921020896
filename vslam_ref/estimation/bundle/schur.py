r"""The Schur complement: points are eliminated, the views remain.

A step solves, with damping in B and C,

.. math::

    \begin{bmatrix} B & W \\ W^T & C \end{bmatrix}
    \begin{bmatrix} \delta_{\mathrm{view}} \\ \delta_{\mathrm{point}} \end{bmatrix} =
    -\begin{bmatrix} g_{\mathrm{view}} \\ g_{\mathrm{point}} \end{bmatrix} .

The lower row gives the points, once the views are known; put into the upper row it leaves

.. math::

    \delta_{\mathrm{point}} = -C^{-1}(g_{\mathrm{point}} + W^T \delta_{\mathrm{view}}) , \qquad
    S\,\delta_{\mathrm{view}} = -g_{\mathrm{view}} + W C^{-1} g_{\mathrm{point}} , \qquad
    S = B - W C^{-1} W^T .

C is block diagonal, so :math:`C^{-1} = M M^T` with M of 3 x 3 blocks, and S = B - V V^T with V = W M.  This
is symmetric by construction, and half the work.

Residuals are in pixels, or in standard deviations where covariances are given; every block and step has the
unit that follows, with angles in radians and lengths in the unit of the scene.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.bundle.normal import Normal, sum_by_point
from vslam_ref.estimation.bundle.structure import Structure

EPS = float(np.finfo(np.float64).eps)
CHUNK = 200
"""Points whose rows of V are filled into one dense window: it stays in the cache."""


class Reduced(NamedTuple):
    """The system of the views: the lower triangle of S (D, D) in a square array, and its right side (D,)."""

    S: Array
    rhs: Array


class Diagonals(NamedTuple):
    """Diagonal of the normal matrix: of the reduced system's columns (D,), and of the points (N, 3)."""

    view: Array
    point: Array


def diagonals(normal: Normal, table: Structure) -> Diagonals:
    """Squared lengths of the columns of the Jacobian."""
    own = np.einsum("vii->vi", normal.B)
    view = add_at_columns(table.columns, own, table.size)
    return Diagonals(view, np.einsum("nii->ni", normal.C))


def add_at_columns(columns: IntArray, values: Array, size: int) -> Array:
    """Add up values (V, d) of the same column of the reduced system, (size,), by ``columns (V, d)``."""
    total: Array = np.bincount(columns.ravel(), values.ravel(), minlength=size + 1)[:size].astype(np.float64)
    return total


def point_factor(C: Array, extra: Array, free: BoolArray) -> Array:
    """M (N, 3, 3), upper triangular, with M M^T the inverse of C + diag(extra); zero for a point that stays.

    Parameters
    ----------
    C : ndarray, shape (N, 3, 3)
    extra : ndarray, shape (N, 3)
        Damping.
    free : ndarray of bool, shape (N,)

    Notes
    -----
    The Cholesky factor L and its inverse are written out: ten times as quick as a stack of LAPACK's, which
    would also stop at the first point that is not measured.  A point whose matrix is singular to working
    precision is not measured in some direction: it gets no step.  With damping that is a point without weight
    only; one that was seen once moves onto its ray.
    """
    size = np.einsum("nii->ni", C) + extra
    c00, c11, c22 = size.T
    c10, c20, c21 = C[:, 1, 0], C[:, 2, 0], C[:, 2, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        l00 = np.sqrt(c00)
        l10, l20 = c10 / l00, c20 / l00
        d11 = c11 - l10 * l10
        l11 = np.sqrt(d11)
        l21 = (c21 - l20 * l10) / l11
        d22 = c22 - l20 * l20 - l21 * l21
        l22 = np.sqrt(d22)
        good = free & (c00 > 0) & (d11 > 8 * EPS * c11) & (d22 > 8 * EPS * c22)
        M = np.zeros(C.shape)  # eq-half: C^-1 = M M^T
        M[:, 0, 0], M[:, 1, 1], M[:, 2, 2] = 1 / l00, 1 / l11, 1 / l22
        M[:, 0, 1] = -l10 * M[:, 0, 0] * M[:, 1, 1]
        M[:, 1, 2] = -l21 * M[:, 1, 1] * M[:, 2, 2]
        M[:, 0, 2] = (l10 * l21 - l20 * l11) * M[:, 0, 0] * M[:, 1, 1] * M[:, 2, 2]
    M[~good] = 0.0
    return M


def reduce(normal: Normal, M: Array, extra: Array, table: Structure) -> Reduced:
    """Eliminate the points.

    Implements :eq:`eq-schur`.

    Parameters
    ----------
    normal : Normal
    M : ndarray, shape (N, 3, 3)
        :func:`point_factor` of the points.
    extra : ndarray, shape (D,)
        Damping on the diagonal of the views' part.
    table : Structure
    """
    blocks = (normal.B, normal.g_view, normal.g_point, normal.W, M)
    S, rhs = schur_complement(*blocks, table.links.view, table.columns, table.size, table.offsets)
    at = np.arange(table.size)
    S[at, at] += extra
    return Reduced(S, rhs)


@accelerated("bundle_schur:schur_complement")
def schur_complement(
    B: Array,
    g_view: Array,
    g_point: Array,
    W: Array,
    M: Array,
    view: IntArray,
    columns: IntArray,
    size: int,
    offsets: IntArray,
) -> tuple[Array, Array]:
    """Lower triangle of S (D, D) and right side (D,), undamped; upper entries mean nothing.

    Implements :eq:`eq-covisibility`.

    Parameters
    ----------
    B, g_view, g_point, W : ndarray, shapes (V, d, d), (V, d), (N, 3), (n, d, 3)
        Blocks of the normal equations.
    M : ndarray, shape (N, 3, 3)
        :func:`point_factor` of the points.
    view : ndarray of int, shape (n,)
        View of each observation; observations are sorted by point.
    columns : ndarray of int, shape (V, d)
        Columns of each view's coordinates; ``size`` for what is fixed.
    size : int
        Number D of columns.
    offsets : ndarray of int, shape (N + 1,)
        Where the observations of each point begin.

    Notes
    -----
    V = W M has three rows a point.  Some points at a time, its columns that are not empty are filled into a
    dense window, and one symmetric product makes V^T V.  As one sparse product, S would take 3 to 6 times as
    long, and the goals BA-1 and BA-2 would be missed.
    """
    from scipy.linalg.blas import dsyrk

    S, rhs = np.zeros((size + 1, size + 1)), np.zeros(size + 1)  # what is fixed goes to the last column
    for block, g, at in zip(B, g_view, columns, strict=True):
        S[at[:, None], at] += block
        np.subtract.at(rhs, at, g)  # a shared lens and fixed coordinates have columns twice
    point = np.repeat(np.arange(len(M)), np.diff(offsets))
    V = np.matmul(W, M[point])  # eq-half
    u = np.matmul(g_point[:, None, :], M)[:, 0]
    place = np.zeros(size + 1, dtype=np.int64)
    for first in range(0, len(M), CHUNK):
        last = min(first + CHUNK, len(M))
        part, rows = slice(offsets[first], offsets[last]), 3 * (last - first)
        used = np.unique(columns[np.unique(view[part])])
        place[used] = np.arange(len(used))
        corner = rows * place[columns[view[part]]] + 3 * (point[part] - first)[:, None]
        index = (corner[:, :, None] + np.arange(3)).ravel()
        A = np.bincount(index, V[part].ravel(), minlength=rows * len(used)).reshape(len(used), rows).T
        S[used[:, None], used] -= dsyrk(1.0, A, trans=1, lower=1)  # eq-covisibility
        rhs[used] += A.T @ u[first:last].ravel()  # eq-schur
    return np.ascontiguousarray(S[:size, :size]), rhs[:size]


@accelerated("bundle_schur:point_steps")
def point_steps(
    W: Array, M: Array, g_point: Array, view_steps: Array, view: IntArray, offsets: IntArray
) -> Array:
    """Steps of the points (N, 3), from those of the views (V, d): -C^-1 (g_point + W^T step).

    Implements :eq:`eq-back-substitution`.
    ``W (n, d, 3)``, ``M (N, 3, 3)``, ``g_point (N, 3)``, ``view_steps (V, d)``, ``view (n,)``,
    ``offsets (N + 1,)``.
    """
    pulled = np.matmul(view_steps[view][:, None, :], W)[:, 0]
    total = sum_by_point(pulled, offsets) + g_point
    steps: Array = -np.matmul(M, np.matmul(total[:, None, :], M)[:, 0][..., None])[..., 0]
    return steps
