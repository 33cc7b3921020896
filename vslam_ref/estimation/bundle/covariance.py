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

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.bundle import reduced_system, schur
from vslam_ref.estimation.bundle.gauge import fix_gauge, gauge_directions
from vslam_ref.estimation.bundle.normal import Normal, normal_equations
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.bundle.result import BundleResult
from vslam_ref.estimation.bundle.structure import Structure, structure
from vslam_ref.estimation.bundle.weights import whitened

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
    views, points : array_like of int
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
    chosen_views = _numbers("view", views, problem.sizes[0])
    chosen_points = _numbers("point", points, problem.sizes[1])
    if gauge == "free":
        if not (problem.free.pose.all() and problem.free.point.all()):
            raise ValueError("gauge='free': the problem holds a view or a point; say gauge='fixed'")
        problem = fix_gauge(problem)
    table = structure(problem)
    system = _System.at(problem, result, table)
    dof = 2 * int(np.count_nonzero(result.weights)) - table.size - 3 * int(system.measured.sum())
    if sigma is None:
        sigma = math.sqrt(system.square / dof) if dof > 0 else math.inf
    told = _open(system, table, chosen_points, dof, sigma)
    if told or system.factor is None:
        return BundleCovariance(None, None, None, sigma, told)
    rows = _Selection(system, table, chosen_views, chosen_points)
    matrix = rows.covariance()
    if gauge == "free":
        matrix = _projected(matrix, rows, problem, table, system)
    matrix *= sigma**2
    k = 6 * len(chosen_views)
    view = np.array([matrix[a : a + 6, a : a + 6] for a in range(0, k, 6)]).reshape(-1, 6, 6)
    point = np.array([matrix[a : a + 3, a : a + 3] for a in range(k, len(matrix), 3)]).reshape(-1, 3, 3)
    return BundleCovariance(matrix, view, point, sigma, "")


class _System(NamedTuple):
    """Factored normal equations at a solution, without damping."""

    normal: Normal
    M: Array
    measured: BoolArray
    factor: reduced_system.Factor | None
    weakest: float
    square: float

    @classmethod
    def at(cls, problem: BundleProblem, result: BundleResult, table: Structure) -> _System:
        """Linearise and eliminate the points."""
        state, weights = table.state(problem), result.weights[table.order]
        normal = normal_equations(problem.model, state, table, weights, problem.free.intrinsics)
        M = schur.point_factor(normal.C, np.zeros((len(normal.C), 3)), table.free_point)
        S, _ = schur.reduce(normal, M, np.zeros(table.size), table)
        # columns of length 1, so that metres and radians are judged alike
        scale = np.sqrt(np.where(np.diag(S) > 0, np.diag(S), 1.0))
        weakest = _weakest(S / np.outer(scale, scale))
        factor = reduced_system.factor(S, table.border, table.bandwidth, "dense") if weakest > 0 else None
        errors = whitened(problem.seen.cov_uv, result.residual)
        square = float(np.einsum("n,ni,ni->", result.weights, errors, errors))
        return cls(normal, M, M[:, 0, 0] > 0, factor, weakest, square)


def _weakest(S: Array) -> float:
    """Smallest squared pivot of the scaled matrix above its rounding, else 0."""
    from scipy.linalg import LinAlgError, cholesky

    if len(S) == 0:
        return 1.0
    try:
        pivots = np.diag(cholesky(S, lower=True, check_finite=False)) ** 2
    except LinAlgError:
        return 0.0
    smallest = float(pivots.min())
    return smallest if smallest > 100 * len(S) * schur.EPS else 0.0


def _open(system: _System, table: Structure, chosen: IntArray, dof: int, sigma: float) -> str:
    """Why there is no covariance, or nothing."""
    if math.isinf(sigma):
        return f"{dof} redundant measurements: the noise is unknown; say sigma"
    if system.factor is None:
        return "the normal matrix is singular: the gauge is free (fix it, or ask for it), or a view is loose"
    sorted_points = np.argsort(table.point_order)[chosen]
    bad = np.flatnonzero(table.free_point[sorted_points] & ~system.measured[sorted_points])
    if len(bad):
        return f"point {chosen[bad[0]]} is not determined by its observations"
    return ""


class _Selection:
    """Rows of the inverse for chosen views and points."""

    def __init__(self, system: _System, table: Structure, views: IntArray, points: IntArray) -> None:
        self.system, self.table = system, table
        self.views = views
        self.columns = table.columns[views][:, :6].ravel()
        self.points = np.argsort(table.point_order)[points]

    def covariance(self) -> Array:
        """Block of the inverse normal matrix for the selection."""
        assert self.system.factor is not None
        size = self.table.size
        right = np.zeros((size + 1, len(self.columns) + 3 * len(self.points)))
        right[self.columns, np.arange(len(self.columns))] = 1.0
        k = len(self.columns)
        for number, j in enumerate(self.points):
            right[:, k + 3 * number : k + 3 * number + 3] = -self._coupling(int(j))
        right[size] = 0.0
        solved = np.vstack([self.system.factor.solve(right[:size]), np.zeros((1, right.shape[1]))])
        matrix = right.T @ solved
        for number, j in enumerate(self.points):
            at = slice(k + 3 * number, k + 3 * number + 3)
            matrix[at, at] += self.system.M[j] @ self.system.M[j].T
        return np.asarray((matrix + matrix.T) / 2)

    def _coupling(self, j: int) -> Array:
        """W C^-1 of one point, (D + 1, 3)."""
        table, out = self.table, np.zeros((self.table.size + 1, 3))
        part = slice(table.offsets[j], table.offsets[j + 1])
        inverse = self.system.M[j] @ self.system.M[j].T
        at = table.columns[table.links.view[part]]
        np.add.at(out, at.ravel(), (self.system.normal.W[part] @ inverse).reshape(-1, 3))
        out[table.size] = 0.0
        return out


def _projected(
    matrix: Array, rows: _Selection, problem: BundleProblem, table: Structure, system: _System
) -> Array:
    """From the covariance with one gauge to that of the free one: P Sigma P with P = I - G G^T.

    Implements :eq:`eq-free-covariance`.

    G are orthonormal directions of the gauge.  Sigma G is solved for, so that only chosen rows are needed.
    """
    assert system.factor is not None
    views, points = gauge_directions(problem.scene)
    points = points[table.point_order]
    joint = np.concatenate([views.reshape(-1, 7), points.reshape(-1, 7)])
    turn = np.linalg.inv(np.linalg.qr(joint, mode="r"))
    views, points = views @ turn, points @ turn
    size = table.size
    G_view = np.zeros((size + 1, 7))
    np.add.at(G_view, table.columns[:, :6].ravel(), views.reshape(-1, 7))
    pulled = np.einsum("nij,njk->nik", np.swapaxes(system.M, 1, 2), points)
    V = np.matmul(system.normal.W, system.M[table.links.point])
    seen = (V @ pulled[table.links.point]).reshape(-1, 7)
    np.subtract.at(G_view, table.columns[table.links.view].ravel(), seen)
    x_view = np.vstack([system.factor.solve(G_view[:size]), np.zeros((1, 7))])
    back = np.zeros_like(points)
    at_view = x_view[table.columns[table.links.view]]
    np.add.at(back, table.links.point, np.einsum("ndk,ndg->nkg", system.normal.W, at_view))
    x_point = system.M @ (np.swapaxes(system.M, 1, 2) @ (points - back))
    inner = np.einsum("vig,vih->gh", views, x_view[table.columns[:, :6]])
    inner += np.einsum("nig,nih->gh", points, x_point)
    G_rows = np.concatenate([views[rows.views].reshape(-1, 7), points[rows.points].reshape(-1, 7)])
    X_rows = np.concatenate(
        [x_view[table.columns[rows.views][:, :6]].reshape(-1, 7), x_point[rows.points].reshape(-1, 7)]
    )
    return np.asarray(matrix - G_rows @ X_rows.T - X_rows @ G_rows.T + G_rows @ inner @ G_rows.T)


def _numbers(name: str, given: ArrayLike, count: int) -> IntArray:
    numbers = np.asarray(given, dtype=np.int64).ravel()
    bad = numbers[(numbers < 0) | (numbers >= count)]
    if len(bad):
        raise ValueError(f"{name} {bad[0]}: there are {count} (numbers 0 to {count - 1})")
    return numbers
