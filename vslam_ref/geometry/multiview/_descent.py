"""Levenberg-Marquardt for many points at once, each with three unknowns of its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.geometry.multiview.views import Views

SETTLED = 1e-16
"""Square of the length, in the point's own standard deviations, of a step that ends the search."""
FIRST, LEAST, MOST = 1e-3, 1e-12, 1e12
"""Damping at the start and its range, as a share of the diagonal of H."""
FLAT = 1e-14
"""Smallest over largest eigenvalue of the scaled H below which a direction is not measured."""


class Descent(NamedTuple):
    """Points (N, 3), whether each settled, covariance, pixels of error, steps tried."""

    X_world: Array
    converged: NDArray[np.bool_]
    cov_X: Array
    rmse_px: Array
    iterations: NDArray[np.int64]


class _Linear(NamedTuple):
    """Cost (N,), gradient (N, 3), Hessian (N, 3, 3)."""

    cost: Array
    g: Array
    H: Array


def descend(views: Views, uv: Array, root: Array, X_start: Array, max_iterations: int) -> Descent:
    """Minimise every point's reprojection error; ``root`` (N, V) is 1/sigma, 0 where not seen."""
    X, at = X_start.copy(), _linearise(views, uv, root, X_start)
    damping = np.full(len(X), FIRST)
    iterations = np.zeros(len(X), dtype=np.int64)
    rounding = _rounding(uv, root)
    settled = SETTLED + rounding
    converged = _decrement(at) <= settled
    stuck = ~np.isfinite(at.cost)
    for _ in range(max_iterations):
        go = np.flatnonzero(~(converged | stuck))
        if len(go) == 0:
            break
        D = np.einsum("nii->ni", at.H[go])
        damped = at.H[go] + damping[go, None, None] * D[:, :, None] * np.eye(3)
        trial = X[go] - _solve(damped, at.g[go])
        new = _linearise(views, uv[go], root[go], trial)
        better = new.cost < at.cost[go]  # False for infinity: behind a camera
        # at the bottom costs differ by rounding, r dr: a step counts if it leaves a shorter one to go
        level = np.abs(new.cost - at.cost[go]) <= np.sqrt(2.0 * at.cost[go] * rounding[go])
        better |= level & (_decrement(new) < 0.25 * _decrement(_Linear(*(a[go] for a in at))))
        won = go[better]
        X[won] = trial[better]
        for held, fresh in zip(at, new, strict=True):
            held[won] = fresh[better]
        damping[go] = np.clip(damping[go] * np.where(better, 0.1, 10.0), LEAST, None)
        iterations[go] += 1
        converged[won] = _decrement(_Linear(*(a[won] for a in at))) <= settled[won]
        stuck |= damping > MOST
    return Descent(X, converged, _covariance(at.H), _rmse(views, uv, root, X), iterations)


def _linearise(views: Views, uv: Array, root: Array, X: Array) -> _Linear:
    """Cost, gradient and Gauss-Newton Hessian; an infinite cost where a view that counts sees nothing."""
    seen = views.project_with_jacobians(X)
    r = (seen.uv - uv) * root[..., None]
    J = seen.J_point * root[..., None, None]
    lost = ((root > 0) & ~seen.valid).any(axis=1)
    cost = np.where(lost, np.inf, 0.5 * np.sum(r * r, axis=(1, 2)))
    return _Linear(cost, np.einsum("nvij,nvi->nj", J, r), np.einsum("nvij,nvik->njk", J, J))


def _solve(H: Array, g: Array) -> Array:
    """H^-1 g of symmetric matrices, scaled to a unit diagonal; zero where H is singular."""
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", H), 1e-300))
    values, vectors = np.linalg.eigh(H / scale[:, :, None] / scale[:, None, :])
    flat = values <= FLAT * values[:, -1:]
    inverse = np.where(flat, 0.0, 1.0 / np.where(flat, 1.0, values))
    along = np.einsum("nij,ni->nj", vectors, g / scale) * inverse
    solved: Array = np.einsum("nij,nj->ni", vectors, along) / scale
    return solved


def _decrement(at: _Linear) -> Array:
    """Squared length of the whole step, in standard deviations of the point: g^T H^-1 g."""
    length: Array = np.sum(at.g * _solve(at.H, at.g), axis=1)
    return length


def _rounding(uv: Array, root: Array) -> Array:
    """Square of what the rounding of the pixels may move a point, in its standard deviations, (N,)."""
    pixel = 16 * np.finfo(np.float64).eps * np.abs(uv).max(axis=(1, 2), initial=1.0)
    square: Array = np.sum((root * pixel[:, None]) ** 2, axis=1)
    return square


def _covariance(H: Array) -> Array:
    """H^-1, or infinity on the diagonal where a direction is not measured."""
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", H), 1e-300))
    scaled = H / scale[:, :, None] / scale[:, None, :]
    values, vectors = np.linalg.eigh(scaled)
    known = values[:, 0] > FLAT * values[:, -1]
    inverse = (vectors / np.where(known[:, None], values, 1.0)[:, None, :]) @ np.swapaxes(vectors, -1, -2)
    cov = inverse / scale[:, :, None] / scale[:, None, :]
    return np.where(known[:, None, None], cov, np.diag([np.inf] * 3))


def _rmse(views: Views, uv: Array, root: Array, X: Array) -> Array:
    """Root of the mean squared distance, pixels; infinite where a view that counts sees nothing."""
    seen, used = views.project(X), root > 0
    squares = np.where(used, np.sum((seen.uv - uv) ** 2, axis=-1), 0.0).sum(axis=1)
    lost = (used & ~seen.valid).any(axis=1)
    return np.where(lost, np.inf, np.sqrt(squares / np.maximum(used.sum(axis=1), 1)))
