r"""The normal equations at a solution, without damping: what covariances are made of.

A point whose observations do not determine it, as one that was seen once, would stand in the equations of
the views as if it were *known*, if it was only left out of the elimination.  So its observations are left
out, too: it tells nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.bundle import reduced_system, schur
from vslam_ref.estimation.bundle.normal import Normal, normal_equations, sum_by_point
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.bundle.result import BundleResult
from vslam_ref.estimation.bundle.structure import Structure
from vslam_ref.estimation.bundle.weights import whitened


class UndampedColumns(NamedTuple):
    """Columns over all unknowns, each row in its coordinate's unit: metres, radians, or the lens's.

    ``view (D + 1, k)`` of the views' coordinates, the last row of what is fixed; ``point (N, 3, k)`` of the
    sorted points.
    """

    view: Array
    point: Array


class UndampedSystem(NamedTuple):
    """Factored normal equations at a solution, without damping.

    Attributes
    ----------
    normal : Normal
    table : Structure
    M : ndarray, shape (N, 3, 3)
        Factors of the points' inverses; zero for a point that is held, or not determined.
    S : ndarray, shape (D, D)
        Reduced system of the views, its lower triangle.
    factor : Factor or None
        Of S; None where it is singular.
    weights : ndarray, shape (n,)
        Of the sorted observations; 0 also where the point is not determined.
    square : float
        Weighted sum of squares of the whitened residuals that count.
    """

    normal: Normal
    table: Structure
    M: Array
    S: Array
    factor: reduced_system.Factor | None
    weights: Array
    square: float

    @classmethod
    def at(cls, problem: BundleProblem, result: BundleResult, table: Structure) -> UndampedSystem:
        """Linearise a problem at the scene and with the weights of a result, and eliminate the points."""
        state, weights = table.state(problem), result.weights[table.order]
        basis = problem.free.intrinsics
        normal = normal_equations(problem.model, state, table, weights, basis)
        M = _factors(normal, table)
        loose = table.free_point & (M[:, 0, 0] == 0.0)
        if (weights[loose[table.links.point]] > 0).any():
            weights = np.where(loose[table.links.point], 0.0, weights)
            normal = normal_equations(problem.model, state, table, weights, basis)
            M = _factors(normal, table)
        S, _ = schur.reduce(normal, M, np.zeros(table.size), table)
        # columns of length 1, so that metres and radians are judged alike
        scale = np.sqrt(np.where(np.diag(S) > 0, np.diag(S), 1.0))
        regular = _is_regular(S / np.outer(scale, scale))
        factor = reduced_system.factor(S, table.border, table.bandwidth, "dense") if regular else None
        errors = whitened(problem.seen.cov_uv, result.residual)[table.order]
        square = float(np.einsum("n,ni,ni->", weights, errors, errors))
        return cls(normal, table, M, S, factor, weights, square)

    @property
    def measured(self) -> BoolArray:
        """Points (N,) that their observations determine."""
        return np.asarray(self.M[:, 0, 0] > 0)

    @property
    def redundancy(self) -> int:
        """Measured coordinates less unknowns."""
        return 2 * int(np.count_nonzero(self.weights)) - self.table.size - 3 * int(self.measured.sum())

    @property
    def sigma(self) -> float:
        """Standard deviation of a whitened coordinate, from the residuals; infinite without redundancy."""
        return math.sqrt(self.square / self.redundancy) if self.redundancy > 0 else math.inf

    def solve(self, view: Array, point: Array) -> UndampedColumns:
        """Inverse normal matrix times some columns, by elimination of the points: the chapter's two rows."""
        assert self.factor is not None
        table, W, M_T = self.table, self.normal.W, np.swapaxes(self.M, 1, 2)
        view, at = view.copy(), table.columns[table.links.view]
        seen = np.matmul(W, (self.M @ (M_T @ point))[table.links.point])
        np.subtract.at(view, at.ravel(), seen.reshape(-1, view.shape[1]))
        x = np.vstack([self.factor.solve(view[:-1]), np.zeros((1, view.shape[1]))])
        back = np.matmul(np.swapaxes(W, 1, 2), x[at]).reshape(len(W), -1)
        pulled = sum_by_point(back, table.offsets).reshape(point.shape)
        return UndampedColumns(x, self.M @ (M_T @ (point - pulled)))


def _factors(normal: Normal, table: Structure) -> Array:
    return schur.point_factor(normal.C, np.zeros((len(normal.C), 3)), table.free_point)


def _is_regular(S: Array) -> bool:
    """Whether the smallest squared pivot of the scaled matrix is above its rounding."""
    from scipy.linalg import LinAlgError, cholesky

    try:
        pivots = np.diag(cholesky(S, lower=True, check_finite=False)) ** 2
    except LinAlgError:
        return False
    return bool(pivots.min(initial=1.0) > 100 * len(S) * schur.EPS)
