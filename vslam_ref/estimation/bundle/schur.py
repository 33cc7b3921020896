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
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.bundle.normal import Normal, sum_by_point
from vslam_ref.estimation.bundle.structure import Structure

EPS = float(np.finfo(np.float64).eps)


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
    """Add up values (V, d) that belong to the same column of the reduced system, (size,)."""
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
    The Cholesky factor L and its inverse are written out.  A point whose matrix is singular to working
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
        M = np.zeros(C.shape)
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
    blocks = (normal.B, normal.g_view, normal.g_point, normal.W)
    S, rhs = schur_complement(
        *blocks, M, table.links.view, table.columns, table.size, table.offsets, table.runs, *table.windows
    )
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
    runs: IntArray,
    window_points: IntArray,
    window_offsets: IntArray,
    window_columns: IntArray,
    local: IntArray,
) -> tuple[Array, Array]:
    """Lower triangle of S (D, D) and right side (D,), undamped; upper entries mean nothing.

    Notes
    -----
    A chunk of points scatters its V into a dense window, rows the points' coordinates, columns those of the
    reduced system it touches, and one symmetric product does the rest.
    """
    from scipy.linalg.blas import dsyrk

    S, rhs = _view_part(B, g_view, columns, size)
    V = np.matmul(W, M[_points(offsets)])
    u = np.matmul(g_point[:, None, :], M)[:, 0]
    ends = np.append(runs, len(V))
    for c in range(len(window_points) - 1):
        first, last = window_points[c], window_points[c + 1]
        used = window_columns[window_offsets[c] : window_offsets[c + 1]]
        part = slice(offsets[first], offsets[last])
        row = 3 * (_points(offsets[first : last + 1] - offsets[first]))
        A = np.zeros((3 * (last - first), len(used)), order="F")
        joined = V[part]
        place = local[part]
        for k in range(3):
            A[row[:, None] + k, place[:, :6]] = joined[:, :6, k]
        lo, hi = np.searchsorted(runs, (part.start, part.stop))
        if V.shape[1] > 6 and hi > lo:
            starts = ends[lo:hi] - part.start
            lens_part = joined[:, 6:] if hi - lo == len(joined) else np.add.reduceat(joined[:, 6:], starts, 0)
            for k in range(3):
                A[row[starts, None] + k, place[starts, 6:]] = lens_part[:, :, k]
        product = dsyrk(1.0, A, trans=1, lower=1)
        _subtract(S, used, product)
        rhs[used] += A.T @ u[first:last].ravel()
    return np.ascontiguousarray(S[:size, :size]), rhs[:size]


def _view_part(B: Array, g_view: Array, columns: IntArray, size: int) -> tuple[Array, Array]:
    """B and -g_view at their columns, with the waste column."""
    S = np.zeros((size + 1, size + 1))
    for block, at in zip(B, columns, strict=True):
        S[at[:, None], at] += block
    return S, -np.append(add_at_columns(columns, g_view, size), 0.0)


def _subtract(S: Array, used: IntArray, product: Array) -> None:
    """S[used, used] -= product; quicker where the columns are neighbours (all but the waste column)."""
    head = len(used) - 1
    if head and used[head - 1] - used[0] == head - 1:
        begin, end = used[0], used[head - 1] + 1
        S[begin:end, begin:end] -= product[:head, :head]
    else:
        S[used[:, None], used] -= product


def _points(offsets: IntArray) -> IntArray:
    """Point of each observation, from offsets."""
    points: IntArray = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    return points


@accelerated("bundle_schur:point_steps")
def point_steps(
    W: Array, M: Array, g_point: Array, view_steps: Array, view: IntArray, offsets: IntArray
) -> Array:
    """Steps of the points (N, 3), from those of the views (V, d): -C^-1 (g_point + W^T step).

    Implements :eq:`eq-back-substitution`.
    """
    pulled = np.matmul(view_steps[view][:, None, :], W)[:, 0]
    total = sum_by_point(pulled, offsets) + g_point
    steps: Array = -np.matmul(M, np.matmul(total[:, None, :], M)[:, 0][..., None])[..., 0]
    return steps
