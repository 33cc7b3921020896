r"""A camera's pose with the smallest reprojection error, with any lens and any robust loss.

It minimises over one pose

.. math:: \sum_j \rho\bigl( \lVert h(C, X_j) - u_j \rVert / \sigma_j \bigr)

by Levenberg-Marquardt, with the left perturbation :math:`T \leftarrow \operatorname{Exp}(\xi)\, T`.  The
start comes from :mod:`vslam_ref.geometry.multiview.resection`, one floor down, unless it is given.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, as_array
from vslam_ref.estimation.least_squares import Options, Solution, minimise
from vslam_ref.estimation.robust import Loss, norm_scale, tuned
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Camera, Projection, WorldProjectionJacobians
from vslam_ref.geometry.multiview.resection import resect_linear, tilted_twin


@dataclass(frozen=True)
class Resection:
    """A pose, and how it was found.

    Attributes
    ----------
    T_cam_world : ndarray, shape (4, 4)
        The best pose; the start where no better one was found.
    cov_pose : ndarray, shape (6, 6), or None
        Covariance of the left perturbation (rho, phi) to first order; None where it does not exist.
    errors_px : ndarray, shape (N,)
        Distance of each projected point from its pixel; infinite for points that the camera cannot see.
    weights : ndarray, shape (N,)
        Of the robust loss at the end; 1 without.
    iterations : int
        Steps tried.
    converged : bool
    reason : str
        Empty if it converged and all is well; else what is wrong.
    solution : Solution or None
        The solver's own record, with the history; None where it never ran.
    rival : float
        For points of a plane, cost of the other tilt over this one's; near 1 the tilt is a guess.  Infinite
        if there is no other valley.
    """

    T_cam_world: Array
    cov_pose: Array | None
    errors_px: Array
    weights: Array
    iterations: int
    converged: bool
    reason: str
    solution: Solution | None
    rival: float = np.inf

    @property
    def inliers(self) -> NDArray[np.bool_]:
        """Points with at least half of the full weight, (N,)."""
        return (self.weights >= 0.5) & np.isfinite(self.errors_px)

    @property
    def rmse_px(self) -> float:
        """Root of the mean squared distance over the inliers, pixels; infinite if there are none."""
        kept = self.errors_px[self.inliers]
        return float(np.sqrt(np.mean(kept**2))) if len(kept) else np.inf


def refine_pose(
    camera: Camera,
    X_world: ArrayLike,
    uv: ArrayLike,
    T_start: ArrayLike,
    *,
    loss: Loss | None = None,
    sigma_px: ArrayLike = 1.0,
    options: Options | None = None,
) -> Resection:
    """Pose with the smallest (robust) reprojection error near a start.

    Implements :eq:`eq-resection-refined`.

    Parameters
    ----------
    camera : Camera
        Any lens.
    X_world : array_like, shape (N, 3)
        Points.
    uv : array_like, shape (N, 2)
        Where they were seen, pixels.
    T_start : array_like, shape (4, 4)
        ``T_cam_world`` to start from.
    loss : Loss, optional
        For norms of errors in units of ``sigma_px``, such as ``tuned("tukey", 2)``; least squares without.
    sigma_px : array_like, broadcast to (N,)
        Standard deviation of one coordinate of a pixel.
    options : Options, optional
        Of the solver; at most 200 steps by default.

    Returns
    -------
    Resection
        ``reason`` reports too few points (3 at least), points that the start cannot see, a pose that is
        not determined, or a solver that did not converge.

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite, or a ``sigma_px`` is not positive.

    Notes
    -----
    A step after which the camera cannot see one of the points is refused.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> camera, X = Pinhole(500, 500, 320, 240), [[0, 0, 4], [1, 0, 5], [0, 2, 6], [-1, 1, 5.0]]
    >>> found = refine_pose(camera, X, camera.project(X).uv, se3.exp([0.1, 0, 0.2, 0, 0.05, 0]))
    >>> bool(np.abs(found.T_cam_world - np.eye(4)).max() < 1e-9), found.iterations > 0, found.reason
    (True, True, '')
    """
    X, u, sigma = _checked(X_world, uv, sigma_px)
    T = as_array("T_start", T_start, 4, 4)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise ValueError(f"T_start of shape {T.shape}: need a finite (4, 4)")
    seen = camera.pixel_from_world(T, X).valid
    if len(X) < 3:
        return _failed(camera, X, u, T, f"{len(X)} points: a pose needs at least 3")
    if not seen.all():
        why = f"{np.count_nonzero(~seen)} of {len(X)} points cannot be seen from the start"
        return _failed(camera, X, u, T, why)

    def residual(pose: Array) -> Array:
        return _whitened(camera.pixel_from_world(pose, X), u, sigma)

    def with_jacobian(pose: Array) -> tuple[Array, Array]:
        at = camera.pixel_from_world_with_jacobians(pose, X)
        return _whitened(at, u, sigma), (at.J_pose / sigma[:, None, None]).reshape(-1, 6)

    settings: Any = {"loss": loss, "block": 2, "plus": se3.perturb, "coordinates": 6}
    options = options or Options(max_iterations=200)
    found = minimise(residual, T, with_jacobian=with_jacobian, options=options, **settings)
    return _result(camera, X, u, found)


def _whitened(at: Projection | WorldProjectionJacobians, u: Array, sigma: Array) -> Array:
    """Residuals (2 N,) in standard deviations; NaN without an image: the solver takes another step."""
    return np.where(at.valid[:, None], (at.uv - u) / sigma[:, None], np.nan).ravel()


def resect(
    camera: Camera,
    X_world: ArrayLike,
    uv: ArrayLike,
    *,
    loss: Loss | None = None,
    sigma_px: ArrayLike = 1.0,
    options: Options | None = None,
) -> Resection:
    """Pose from points and pixels without a start: linear equations, then :func:`refine_pose`.

    Parameters, returns and errors as for :func:`refine_pose`.  The linear start uses all points; where many
    are wrong, choose a start from a few of them instead.  Points of a plane have two valleys: the search
    begins in both (:func:`~vslam_ref.geometry.multiview.resection.tilted_twin`), and the deeper one counts.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> camera = Pinhole(500, 500, 320, 240)
    >>> X = np.array([[0, 0, 4], [1, 0, 5], [0, 2, 6], [-1, 1, 5], [1, 1, 4], [-2, -1, 7.0]])
    >>> found = resect(camera, X, camera.project(X).uv + [[0.3, -0.2]] * 6, sigma_px=0.5)
    >>> bool(found.rmse_px < 0.1), found.reason  # a common shift is nearly a turn
    (True, '')
    """
    X, u, _ = _checked(X_world, uv, sigma_px)
    rays = camera.unproject(u)
    if not rays.valid.all():
        why = f"{np.count_nonzero(~rays.valid)} of {len(u)} pixels lie outside the camera's invertible field"
        return _failed(camera, X, u, np.eye(4), why)
    start = resect_linear(rays.bearing, X)
    if not start.ok:
        return _failed(camera, X, u, start.T_cam_world, f"no linear start: {start.reason}")
    starts = [start.T_cam_world]
    if start.method == "planar":
        starts.append(tilted_twin(start.T_cam_world, X))
    found = [refine_pose(camera, X, u, T, loss=loss, sigma_px=sigma_px, options=options) for T in starts]
    best, *others = sorted(found, key=_cost)
    return replace(best, rival=_rival(best, others))


def refine_pose_robust(
    camera: Camera,
    X_world: ArrayLike,
    uv: ArrayLike,
    T_start: ArrayLike,
    *,
    least_sigma_px: float = 0.1,
    options: Options | None = None,
) -> Resection:
    """Pose although some pixels belong to other points, with the scale of the errors from the errors.

    Three passes: Huber's loss, which pulls from any distance; Tukey's with the scale of the errors that
    are left, which gives up what is far off; Tukey's again with the scale that is then left.

    Parameters, returns and errors as for :func:`refine_pose`, and

    least_sigma_px : float
        The scale is never taken to be smaller, pixels; > 0.

    Notes
    -----
    ``iterations`` is the sum over the passes.  Tukey's loss alone would not move from a start whose errors
    are all large: there its slope is zero.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> camera = Pinhole(500, 500, 320, 240)
    >>> X = np.array([[x, y, 4 + (x - y) ** 2] for x in (-1.0, 0, 1) for y in (-1.0, 0, 1)])
    >>> uv = camera.project(X).uv
    >>> uv[0] += [80.0, 0.0]  # a wrong match
    >>> found = refine_pose_robust(camera, X, uv, se3.exp([0.1, 0, 0.2, 0, 0.05, 0]))
    >>> bool(np.abs(found.T_cam_world - np.eye(4)).max() < 1e-9), found.inliers.sum().item()
    (True, 8)
    """
    if not 0 < least_sigma_px < np.inf:
        raise ValueError(f"least_sigma_px={least_sigma_px}: must be finite and more than 0")
    sigma, loss, tried, T = 1.0, tuned("huber", 2), 0, as_array("T_start", T_start, 4, 4)
    for last in (False, False, True):
        found = refine_pose(camera, X_world, uv, T, loss=loss, sigma_px=sigma, options=options)
        tried += found.iterations
        if last or found.solution is None:
            break
        left = found.solution.residual.reshape(-1, 2) * sigma
        scale = norm_scale(left, parameters=6)
        if not np.isfinite(scale.sigma):
            why = f"too few points for a robust loss: {scale.reason}"
            return replace(found, iterations=tried, converged=False, reason=why)
        sigma, loss, T = max(scale.sigma, least_sigma_px), tuned("tukey", 2), found.T_cam_world
    return replace(found, iterations=tried)


def _rival(best: Resection, others: list[Resection]) -> float:
    """Cost of the next valley over the best one's; a turn of less than 1e-4 is the same valley."""
    for other in others:
        turn = so3.log_of_rotation(se3.rotation(other.T_cam_world) @ se3.rotation(best.T_cam_world).T)
        if np.isfinite(_cost(other)) and np.linalg.norm(turn) > 1e-4:
            return _cost(other) / _cost(best) if _cost(best) > 0 else np.inf
    return np.inf


def _cost(found: Resection) -> float:
    return found.solution.cost if found.converged and found.solution is not None else np.inf


def _result(camera: Camera, X: Array, u: Array, found: Solution) -> Resection:
    spread = found.covariance(sigma=1.0) if found.jacobian.size else None
    reason = "" if found.converged else found.message
    if found.converged and spread is not None and spread.matrix is None:
        reason = f"the pose is not determined: {spread.reason}"
    return Resection(
        T_cam_world=found.x,
        cov_pose=None if spread is None else spread.matrix,
        errors_px=_errors(camera, X, u, found.x),
        weights=found.weights[::2],
        iterations=found.iterations,
        converged=found.converged,
        reason=reason,
        solution=found,
    )


def _failed(camera: Camera, X: Array, u: Array, T: Array, reason: str) -> Resection:
    return Resection(T, None, _errors(camera, X, u, T), np.ones(len(X)), 0, False, reason, None)


def _errors(camera: Camera, X: Array, u: Array, T: Array) -> Array:
    at = camera.pixel_from_world(T, X)
    return np.where(at.valid, np.linalg.norm(at.uv - u, axis=-1), np.inf)


def _checked(X_world: ArrayLike, uv: ArrayLike, sigma_px: ArrayLike) -> tuple[Array, Array, Array]:
    X, u = as_array("X_world", X_world, 3), as_array("uv", uv, 2)
    if X.ndim != 2 or u.shape != (len(X), 2):
        raise ValueError(f"X_world {X.shape} and uv {u.shape}: need (N, 3) and (N, 2)")
    for name, values in (("point", X), ("pixel", u)):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            raise ValueError(f"{name} {bad[0]} is {values[bad[0]].tolist()}: must be finite")
    sigma = np.broadcast_to(np.asarray(sigma_px, dtype=np.float64), (len(X),))
    if not (np.isfinite(sigma) & (sigma > 0)).all():
        raise ValueError("sigma_px must be finite and more than 0")
    return X, u, sigma
