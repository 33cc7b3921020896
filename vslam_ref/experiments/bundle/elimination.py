"""Jacobians as matrices, and what it costs to factor J^T J in a given order.

Costs are counted, not timed.  A column of a Cholesky factor with c nonzeros costs c^2 multiplications and
additions to a few percent, so the cost of a factor is the sum of c^2.  *Measured* counts are those of factors
computed by SciPy's sparse solver in a given order, which knows nothing of views and points; *predicted* ones
follow from who sees what.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.bundle import BundleProblem, Scene
from vslam_ref.estimation.bundle.projection import BundleState, Links, linearise, reprojection
from vslam_ref.geometry import se3

DAMPING = 1e-3
"""Share of the diagonal that is added, so that the factor exists with a free gauge."""


def state_and_links(problem: BundleProblem) -> tuple[BundleState, Links]:
    """Scene and observations of a problem, in its own order, for the functions of ``projection``."""
    T, seen = problem.scene.T_cam_world, problem.seen
    links = Links(seen.view, seen.point, problem.lens_of_view[seen.view], seen.uv)
    return BundleState(T[:, :3, :3], T[:, :3, 3], problem.scene.X_world, problem.scene.intrinsics), links


def differenced(problem: BundleProblem) -> Array:
    """J (2 n, d V + 3 N) of all residuals in all unknowns, one column after the other, by differences.

    No structure is assumed: each unknown is moved, and every residual is looked at.
    """
    scene, basis = problem.scene, problem.free.intrinsics
    V, N, n = problem.sizes
    d = 6 + basis.shape[1]
    J = np.zeros((2 * n, d * V + 3 * N))
    for column in range(d * V + 3 * N):
        J[:, column] = _difference(problem, scene, column, d, d * V)
    return J


def _difference(problem: BundleProblem, scene: Scene, column: int, d: int, points: int) -> Array:
    """Central difference of all residuals in one unknown; the step is a share of its size."""
    sides = []
    for sign in (1.0, -1.0):
        T, X, K = scene.T_cam_world.copy(), scene.X_world.copy(), scene.intrinsics.copy()
        if column >= points:
            step = 1e-6 * max(1.0, float(np.abs(X).max()))
            X[(column - points) // 3, (column - points) % 3] += sign * step
        elif column % d < 6:
            step = 1e-6
            xi = np.zeros(6)
            xi[column % d] = sign * step
            T[column // d] = se3.perturb(T[column // d], xi)
        else:
            direction = problem.free.intrinsics[:, column % d - 6]
            lens = problem.lens_of_view[column // d]
            step = 1e-6 * max(1.0, float(np.abs(direction @ K[lens])))
            K[lens] += sign * step * direction
        sides.append(reprojection(problem.at(Scene(T, X, K))).r)
    return np.asarray((sides[0] - sides[1]).ravel() / (2.0 * step))


def analytic(problem: BundleProblem) -> Any:
    """J as a sparse matrix, by the package's derivatives; columns of views first."""
    from scipy.sparse import coo_array

    V, N, n = problem.sizes
    state, links = state_and_links(problem)
    at = linearise(problem.model, state, links, problem.free.intrinsics)
    d = at.J_view.shape[2]
    columns = np.concatenate(
        [d * links.view[:, None] + np.arange(d), d * V + 3 * links.point[:, None] + np.arange(3)], axis=1
    )
    values = np.concatenate([at.J_view, at.J_point], axis=2)
    row = np.broadcast_to((2 * np.arange(n)[:, None] + np.arange(2))[:, :, None], values.shape)
    column = np.broadcast_to(columns[:, None, :], values.shape)
    return coo_array((values.ravel(), (row.ravel(), column.ravel())), shape=(2 * n, d * V + 3 * N)).tocsr()


def factor_pattern(H: Any, order: IntArray) -> Any:
    """Cholesky factor's pattern of the damped H in an order, a sparse matrix."""
    from scipy.sparse import csc_matrix, diags_array
    from scipy.sparse.linalg import splu

    damped = H + DAMPING * diags_array(H.diagonal())
    turned = csc_matrix(damped[order][:, order])
    # nothing is reordered, nothing is pivoted, nothing is gathered: it is the Cholesky factor's pattern
    factor = splu(
        turned,
        permc_spec="NATURAL",
        diag_pivot_thresh=0.0,
        relax=1,
        panel_size=1,
        options={"SymmetricMode": True},
    )
    if not (np.array_equal(factor.perm_r, factor.perm_c) and np.all(np.diff(factor.perm_c) == 1)):
        raise ValueError("the sparse solver changed the order")
    return factor.L.tocsc()


def elimination_cost(H: Any, order: IntArray) -> tuple[float, IntArray]:
    """Sum of c^2 over the columns of the factor of H in an order; and the counts c of the columns."""
    counts = np.diff(factor_pattern(H, order).indptr).astype(np.int64)
    return float(np.sum(counts.astype(np.float64) ** 2)), counts


def dense_cost(size: int) -> float:
    """Sum of c^2 for a full factor: columns of 1 to ``size`` numbers."""
    return size * (size + 1) * (2 * size + 1) / 6.0


def banded_cost(size: int, bandwidth: int) -> float:
    """Sum of c^2 for a factor with a full band of ``bandwidth`` diagonals below the main one."""
    inside = min(bandwidth, size - 1)
    return dense_cost(inside) + (size - inside) * (inside + 1.0) ** 2


def point_cost(seen: IntArray, d: int) -> float:
    """Sum of c^2 for the columns of points that are seen by so many views each (N,)."""
    tail = d * seen.astype(np.float64)
    return float(np.sum((tail + 1) ** 2 + (tail + 2) ** 2 + (tail + 3) ** 2))
