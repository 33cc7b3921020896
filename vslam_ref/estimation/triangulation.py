r"""Points with the smallest reprojection error, from two views or more, with any lens.

The linear rows of :mod:`vslam_ref.geometry.multiview.triangulation` measure distances from rays; the noise
is in pixels.  From the linear point Levenberg-Marquardt goes to the minimum of

.. math:: c(X) = \tfrac12 \sum_i \lVert h(C_i, X) - u_i \rVert^2 / \sigma_i^2 ,

for all points at once, in lockstep: each has three unknowns and a damping of its own.  The inverse of its
Gauss-Newton Hessian :math:`H = \sum_i J_i^T J_i / \sigma_i^2` is the covariance of X.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.geometry.multiview.point_state import PointState, StateArray
from vslam_ref.geometry.multiview.triangulation import MIN_PARALLAX, as_mask, refuse, triangulate_linear
from vslam_ref.geometry.multiview.views import Views

SETTLED = 1e-16
"""Square of the length, in the point's own standard deviations, of a step that ends the search."""
FIRST, LEAST, MOST = 1e-3, 1e-12, 1e12
"""Damping at the start and its range, as a share of the diagonal of H."""
FLAT = 1e-14
"""Smallest over largest eigenvalue of the scaled H below which a direction is not measured."""


@dataclass(frozen=True)
class Triangulation:
    """Optimal points.

    Attributes
    ----------
    X_world : ndarray, shape (N, 3)
        Always finite.  The linear point where ``state`` forbids a refinement, and the origin where there
        is no point at all (``TOO_FEW``, ``NO_RAY``, ``NO_DEPTH``).
    state : ndarray, shape (N,)
        :class:`~vslam_ref.geometry.multiview.point_state.PointState` of each point.
    parallax : ndarray, shape (N,)
        Largest angle between two of its rays, radians.
    cov_X : ndarray, shape (N, 3, 3)
        Covariance to first order; infinite on the diagonal where there is none.
    rmse_px : ndarray, shape (N,)
        Root of the mean squared distance in the images, pixels; infinite where the point was not refined.
    iterations : ndarray, shape (N,)
        Steps tried.
    """

    X_world: Array
    state: StateArray
    parallax: Array
    cov_X: Array
    rmse_px: Array
    iterations: NDArray[np.int64]

    @property
    def ok(self) -> BoolArray:
        """Which points may be used, (N,)."""
        return np.asarray(self.state == PointState.OK)

    def counts(self) -> dict[str, int]:
        """How many points are in which state."""
        return {s.name: int(np.count_nonzero(self.state == s)) for s in PointState if (self.state == s).any()}


def triangulate(
    views: Views,
    uv: ArrayLike,
    mask: ArrayLike | None = None,
    *,
    sigma_px: ArrayLike = 1.0,
    min_parallax: float = MIN_PARALLAX,
    max_iterations: int = 50,
) -> Triangulation:
    """Points with the smallest reprojection error, and their covariance.

    Implements :eq:`eq-triangulation-optimal` and :eq:`eq-triangulation-covariance`.

    Parameters
    ----------
    views : Views
        Cameras and poses.
    uv : array_like, shape (N, V, 2)
        Measured pixels.
    mask : array_like of bool, shape (N, V), optional
        Which of them count; all by default.
    sigma_px : array_like, broadcast to (N, V)
        Standard deviation of one coordinate of a pixel.
    min_parallax : float
        Flag points whose rays differ by less, radians.
    max_iterations : int
        Steps tried at most.

    Returns
    -------
    Triangulation

    Raises
    ------
    ValueError
        If shapes do not fit, a pixel that counts is not finite, or a ``sigma_px`` is not positive.

    Notes
    -----
    A step ends the search when it is shorter than 1e-8 standard deviations of the point itself.  Rays
    with a small angle are refined too, and flagged.

    Examples
    --------
    >>> from vslam_ref.geometry import se3
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> views = Views(Pinhole(500, 500, 320, 240), [se3.identity(), se3.exp([-1.0, 0, 0, 0, 0, 0])])
    >>> found = triangulate(views, [[[320.0, 240.5], [220.0, 239.5]]], sigma_px=0.5)
    >>> found.X_world.round(9) + 0.0, found.rmse_px.round(9).tolist(), found.counts()
    (array([[0., 0., 5.]]), [0.5], {'OK': 1})
    >>> np.sqrt(np.diag(found.cov_X[0])).round(4).tolist()  # depth: Z^2/(f B) sqrt(2) sigma
    [0.005, 0.0035, 0.0354]
    """
    pixels = views.pixels(uv)
    used = as_mask(mask, pixels.shape[:2])
    refuse(used & ~np.isfinite(pixels).all(axis=-1), pixels, "pixel", "must be finite, or masked out")
    sigma = np.broadcast_to(np.asarray(sigma_px, dtype=np.float64), used.shape)
    if not (np.isfinite(sigma) & (sigma > 0)).all():
        raise ValueError("sigma_px must be finite and more than 0")
    pixels = np.where(used[..., None], pixels, 0.0)
    rays = views.rays(pixels)
    start = triangulate_linear(views.T_cam_world, rays.bearing, used, min_parallax=min_parallax)
    state = start.state.copy()
    X = start.X_world.copy()
    blind = (used & ~rays.valid).any(axis=1) & (state != PointState.TOO_FEW)
    state[blind] = PointState.NO_RAY
    X[blind] = 0.0
    seen = (views.project(X).valid | ~used).all(axis=1)
    go = np.flatnonzero(seen & ((state == PointState.OK) | (state == PointState.SMALL_PARALLAX)))
    end = _end(views, pixels[go], np.where(used, 1.0 / sigma, 0.0)[go], X[go], max_iterations)
    X[go] = end.X_world
    state[~seen & (state == PointState.OK)] = PointState.NOT_CONVERGED  # outside a field: nowhere to start
    state[go[~end.converged & (state[go] == PointState.OK)]] = PointState.NOT_CONVERGED
    cov, rmse = np.tile(np.diag([np.inf] * 3), (len(X), 1, 1)), np.full(len(X), np.inf)
    cov[go], rmse[go] = _covariance(end.H), end.rmse_px
    iterations = np.zeros(len(X), dtype=np.int64)
    iterations[go] = end.iterations
    return Triangulation(X, state, start.parallax, cov, rmse, iterations)


class _Descent(NamedTuple):
    """Points (N, 3), whether each settled, Hessian (N, 3, 3), pixels of error, steps tried."""

    X_world: Array
    converged: NDArray[np.bool_]
    H: Array
    rmse_px: Array
    iterations: NDArray[np.int64]


class _Linear(NamedTuple):
    """Cost (N,), gradient (N, 3), Hessian (N, 3, 3)."""

    cost: Array
    g: Array
    H: Array


def _end(views: Views, uv: Array, root: Array, X_start: Array, max_iterations: int) -> _Descent:
    """Where the descent ends, by the form for pinholes where all cameras are some."""
    if all(isinstance(camera, Pinhole) for camera in views.each):
        K = np.stack([camera.params for camera in views.each]).reshape(-1, 4)
        found = _pinhole_descent(K, views.T_cam_world, uv, root, X_start, max_iterations)
        return _Descent(*found)
    return _descend(views, uv, root, X_start, max_iterations)


@accelerated("points:pinhole_descent")
def _pinhole_descent(
    K: Array, T_cam_world: Array, uv: Array, root: Array, X_start: Array, max_iterations: int
) -> tuple[Array, NDArray[np.bool_], Array, Array, NDArray[np.int64]]:
    """Fields of :class:`_Descent` with pinholes K (V, 4) at ``T_cam_world (V, 4, 4)``, any unit of length."""
    same = (K[:1] == K).all()
    cameras = Pinhole.from_params(K[0]) if same else [Pinhole.from_params(k) for k in K]
    return tuple(_descend(Views(cameras, T_cam_world), uv, root, X_start, max_iterations))  # type: ignore[return-value]


def _descend(views: Views, uv: Array, root: Array, X_start: Array, max_iterations: int) -> _Descent:
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
    return _Descent(X, converged, at.H, _rmse(views, uv, root, X), iterations)


def _linearise(views: Views, uv: Array, root: Array, X: Array) -> _Linear:
    """Cost, gradient and Gauss-Newton Hessian; an infinite cost where a view that counts sees nothing."""
    seen = views.project_with_jacobians(X)
    r = (seen.uv - uv) * root[..., None]
    J = seen.J_point * root[..., None, None]
    lost = ((root > 0) & ~seen.valid).any(axis=1)
    cost = np.where(lost, np.inf, 0.5 * np.sum(r * r, axis=(1, 2)))
    return _Linear(cost, np.einsum("nvij,nvi->nj", J, r), np.einsum("nvij,nvik->njk", J, J))


def _scaled_eigen(H: Array) -> tuple[Array, Array, Array]:
    """Eigenvalues (N, 3) and vectors (N, 3, 3) of symmetric matrices scaled to a unit diagonal; the scale."""
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", H), 1e-300))
    values, vectors = np.linalg.eigh(H / scale[:, :, None] / scale[:, None, :])
    return values, vectors, scale


def _solve(H: Array, g: Array) -> Array:
    """H^-1 g; zero along directions in which H is singular."""
    values, vectors, scale = _scaled_eigen(H)
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
    values, vectors, scale = _scaled_eigen(H)
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
