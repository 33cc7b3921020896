r"""How sure the scene is: covariances of chosen views and points.

To first order the covariance of all parameters is :math:`\sigma^2 H^{-1}` with the normal matrix H.  Only the
part that is asked for is computed, from the reduced system (V = W M as in :mod:`.schur`, C^-1 = M M^T):

======================  ======================================================
of                      covariance / sigma^2
======================  ======================================================
views                   S^-1
views and points        -S^-1 V M^T
points                  M (I + V^T S^-1 V) M^T
======================  ======================================================

**The gauge matters.**  With a fixed gauge, H is regular and the covariance is that of coordinates *relative
to what is fixed*: the fixed view is perfectly known, and the farther away a point is, the less.  With a free
gauge the inverse is the pseudo-inverse: of all reconstructions that look the same, the one nearest to this
one is meant, and no view is special.  What images can show, such as ratios of lengths, is as sure either way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.bundle.gauge import fix_gauge, gauge_directions
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.bundle.result import BundleResult
from vslam_ref.estimation.bundle.structure import Structure, structure
from vslam_ref.estimation.bundle.undamped import UndampedColumns, UndampedSystem

Gauge = Literal["fixed", "free"]


@dataclass(frozen=True)
class BundleCovariance:
    """Covariance of chosen views and points.

    Attributes
    ----------
    matrix : ndarray, shape (6 k + 3 m, 6 k + 3 m), or None
        Of the k views' tangent vectors (rho, phi), left perturbation, then of the m points; zero rows for
        what is fixed.  None where it does not exist.
    view : ndarray, shape (k, 6, 6), or None
        Its blocks of views.
    point : ndarray, shape (m, 3, 3), or None
        Its blocks of points.
    sigma : float
        Standard deviation of a whitened coordinate.
    reason : str
        Empty, or why there is none.
    """

    matrix: Array | None
    view: Array | None
    point: Array | None
    sigma: float
    reason: str


def covariance(
    result: BundleResult,
    views: ArrayLike = (),
    points: ArrayLike = (),
    *,
    gauge: Gauge = "fixed",
    sigma: float | None = None,
) -> BundleCovariance:
    """Covariance of chosen views and points at a solution.

    Implements :eq:`eq-ba-covariance`.

    Parameters
    ----------
    result : BundleResult
        At a minimum.
    views, points : array_like of int, shapes (v,), (p,)
        Numbers of what is asked for.
    gauge : {"fixed", "free"}
        ``fixed``: what the problem holds is known.  ``free``: nothing may be held; see the module.
    sigma : float, optional
        Standard deviation of one coordinate of an error, in the unit of the covariances given, or pixels.
        Default: from the weighted residuals and their redundancy.

    Returns
    -------
    BundleCovariance

    Raises
    ------
    ValueError
        If a number is out of range, or the gauge is to be free and something is held.

    Notes
    -----
    With a robust loss the final weights are taken as given, which is slightly too sure.
    """
    problem = result.problem
    chosen = _Chosen(
        _numbers("view", views, problem.sizes[0]), _numbers("point", points, problem.sizes[1]), problem
    )
    if gauge == "free":
        if not (problem.free.pose.all() and problem.free.point.all()):
            raise ValueError("gauge='free': the problem holds a view or a point; say gauge='fixed'")
        problem = fix_gauge(problem)
    table = structure(problem)
    system = UndampedSystem.at(problem, result, table)
    sigma = system.sigma if sigma is None else sigma
    reason = _open(system, chosen, sigma)
    if reason:
        return BundleCovariance(None, None, None, sigma, reason)
    rows = chosen.of(system.solve(*chosen.units(table)), table)
    matrix = sigma**2 * (_projected(rows, chosen, system) if gauge == "free" else (rows + rows.T) / 2)
    k = 6 * len(chosen.views)
    view = np.array([matrix[a : a + 6, a : a + 6] for a in range(0, k, 6)]).reshape(-1, 6, 6)
    point = np.array([matrix[a : a + 3, a : a + 3] for a in range(k, len(matrix), 3)]).reshape(-1, 3, 3)
    return BundleCovariance(matrix, view, point, sigma, "")


class _Chosen(NamedTuple):
    """What is asked for: numbers of views and points in the problem."""

    views: IntArray
    points: IntArray
    problem: BundleProblem

    def places(self, table: Structure) -> tuple[IntArray, IntArray]:
        """Columns of the views' coordinates, and numbers of the sorted points."""
        return table.columns[self.views][:, :6].ravel(), np.argsort(table.point_order)[self.points]

    def units(self, table: Structure) -> UndampedColumns:
        """Unit vectors of the chosen coordinates; zero for what is fixed."""
        columns, points = self.places(table)
        k, count = len(columns), len(columns) + 3 * len(points)
        view, point = np.zeros((table.size + 1, count)), np.zeros((len(table.point_order), 3, count))
        view[columns, np.arange(k)] = 1.0
        view[table.size] = 0.0
        for axis in range(3):
            point[points, axis, k + axis + 3 * np.arange(len(points))] = 1.0
        return UndampedColumns(view, point)

    def of(self, blocks: UndampedColumns, table: Structure) -> Array:
        """Rows of the chosen coordinates, (6 k + 3 m, columns)."""
        columns, points = self.places(table)
        return np.concatenate([blocks.view[columns], blocks.point[points].reshape(-1, blocks.view.shape[1])])


def _open(system: UndampedSystem, chosen: _Chosen, sigma: float) -> str:
    """Why there is no covariance, or nothing."""
    if math.isinf(sigma):
        return f"{system.redundancy} redundant measurements: the noise is unknown; say sigma"
    if system.factor is None:
        return "the normal matrix is singular: the gauge is free (fix it, or ask for it), or a view is loose"
    _, points = chosen.places(system.table)
    bad = np.flatnonzero(system.table.free_point[points] & ~system.measured[points])
    if len(bad):
        return f"point {chosen.points[bad[0]]} is not determined by its observations"
    return ""


def _projected(rows: Array, chosen: _Chosen, system: UndampedSystem) -> Array:
    """From the covariance with one gauge to that of the free one: P Sigma P with P = I - G G^T.

    Implements :eq:`eq-free-covariance`.
    G are orthonormal directions of the gauge.  Sigma G is solved for, so that only chosen rows are needed.
    """
    table = system.table
    views, points = gauge_directions(chosen.problem.scene)
    turn = np.linalg.inv(
        np.linalg.qr(np.concatenate([views.reshape(-1, 7), points.reshape(-1, 7)]), mode="r")
    )
    views, points = views @ turn, points[table.point_order] @ turn
    view = np.zeros((table.size + 1, 7))
    np.add.at(view, table.columns[:, :6].ravel(), views.reshape(-1, 7))
    solved = system.solve(view, points)
    inner = np.einsum("vig,vih->gh", views, solved.view[table.columns[:, :6]])
    inner += np.einsum("nig,nih->gh", points, solved.point)
    # what is held has a direction, too: rows of G are not those of the columns
    G = np.concatenate([views[chosen.views].reshape(-1, 7), points[chosen.places(table)[1]].reshape(-1, 7)])
    X = chosen.of(solved, table)
    free = rows - G @ X.T - X @ G.T + G @ inner @ G.T
    return np.asarray((free + free.T) / 2)


def _numbers(name: str, given: ArrayLike, count: int) -> IntArray:
    numbers = np.asarray(given, dtype=np.int64).ravel()
    bad = numbers[(numbers < 0) | (numbers >= count)]
    if len(bad):
        raise ValueError(f"{name} {bad[0]}: there are {count} (numbers 0 to {count - 1})")
    return numbers
