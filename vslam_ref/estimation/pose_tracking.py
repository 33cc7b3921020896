r"""A camera's pose from one picture to the next: Tukey's loss, reweighted, a fixed number of steps.

The start is near: the prediction of a motion model.  So a plain Gauss-Newton loop does, without damping and
without a test for the end.  In every step the scale is taken anew from the median of the errors, the weights
from the scale, and the step :math:`\mu` from

.. math:: \sum_j w_j\, \frac{J_j^T J_j}{\sigma_j^2}\; \mu
   = -\sum_j w_j\, \frac{J_j^T e_j}{\sigma_j^2}, \qquad T \leftarrow \operatorname{Exp}(\mu)\, T ,

with e predicted minus measured.  It minimises :math:`\sum_j \rho(\lVert e_j \rVert / (\sigma \sigma_j))` over
one pose, as :func:`vslam_ref.estimation.resection.refine_pose` does, with a scale
that follows the errors.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.estimation.robust import L2, Loss, Tukey, covariance_factor, norm_scale, tuned
from vslam_ref.estimation.robust.scale import MAD_NORM_2D
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Pinhole
from vslam_ref.geometry.cameras.interface import MAX_TAN, MIN_DEPTH
from vslam_ref.geometry.cameras.projection import pose_jacobian

STEPS = 10
LEAST_SIGMA = 0.4
"""Pixels of a level; the scale is never less.  PTAM's."""


class TrackedPose(NamedTuple):
    """A pose and how well the measurements agree with it.

    Attributes
    ----------
    T_cam_world : ndarray, shape (4, 4)
        The start, where ``reason`` is not empty.
    weights : ndarray, shape (N,)
        Of Tukey's loss; 0 for what does not belong there, or lies behind the camera.
    sigma : float
        Scale of the errors in one coordinate, in units of ``sigma_px``.
    cov_pose : ndarray, shape (6, 6)
        Of the left perturbation (rho, phi), to first order, for Gaussian errors with ``sigma``.
    reason : str
        Empty, or why there is no pose.
    """

    T_cam_world: Array
    weights: Array
    sigma: float
    cov_pose: Array
    reason: str

    @property
    def inliers(self) -> BoolArray:
        """Measurements (N,) with any weight."""
        return np.asarray(self.weights > 0)


def track_pose(
    camera: Camera,
    X_world: ArrayLike,
    uv: ArrayLike,
    T_start: ArrayLike,
    *,
    sigma_px: ArrayLike = 1.0,
    loss: Loss | None = None,
    steps: int = STEPS,
    least_sigma: float = LEAST_SIGMA,
) -> TrackedPose:
    """Pose near a start by iterated reweighted least squares.

    Implements :eq:`eq-a2-6` (A2.6), with the error of :eq:`eq-a2-7` (A2.7), its sign turned.

    Parameters
    ----------
    camera : Camera
        Any lens.
    X_world : array_like, shape (N, 3)
        Points.
    uv : array_like, shape (N, 2)
        Where they were found, pixels.
    T_start : array_like, shape (4, 4)
    sigma_px : array_like, broadcast to (N,)
        Standard deviation of a coordinate up to a common factor: 2^level.
    loss : Loss, optional
        For norms in units of the scale; by default Tukey's with its 95 % constant, ``L2()`` for squares.
    steps : int
    least_sigma : float
        In units of ``sigma_px``.

    Returns
    -------
    TrackedPose

    Raises
    ------
    ValueError
        If shapes do not fit, or a ``sigma_px`` is not positive.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> camera = Pinhole(500, 500, 320, 240)
    >>> X = np.array([[x, y, 4 + (x - y) ** 2] for x in (-1.0, 0, 1) for y in (-1.0, 0, 1)])
    >>> uv = camera.project(X).uv
    >>> uv[0] += [80.0, 0.0]  # a wrong match
    >>> found = track_pose(camera, X, uv, se3.exp([0.01, 0, 0.02, 0, 0.01, 0]))
    >>> bool(np.abs(found.T_cam_world - np.eye(4)).max() < 1e-6), found.inliers.sum().item()
    (True, 8)
    """
    X, u, T = as_array("X_world", X_world, 3), as_array("uv", uv, 2), as_array("T_start", T_start, 4, 4)
    if X.ndim != 2 or u.shape != (len(X), 2):
        raise ValueError(f"X_world {X.shape} and uv {u.shape}: need (N, 3) and (N, 2)")
    sigma = np.broadcast_to(np.asarray(sigma_px, np.float64), (len(X),))
    if not (np.isfinite(sigma) & (sigma > 0)).all():
        raise ValueError("sigma_px must be finite and more than 0")
    root = 1.0 / sigma
    rho = tuned("tukey", 2) if loss is None else loss
    if isinstance(camera, Pinhole) and isinstance(rho, Tukey) and np.isfinite(rho.c):
        T, w, H, last = _pinhole_steps(camera.params, T, X, u, root, rho.c, steps, least_sigma)
        found = _Steps(T, w, float(last[0]), H, int(last[1]))
    else:
        found = _steps(lambda T: _weighed(camera, X, u, root, T, rho, least_sigma), T, steps)
    return _result(found, rho)


def _result(found: _Steps, rho: Loss) -> TrackedPose:
    cov: Array = np.diag(np.full(6, np.inf))
    if found.trouble == FINE:
        factor = covariance_factor(rho, 2) * found.sigma**2
        cov = np.asarray(factor * np.linalg.inv(found.H))  # eq-weight-covariance
    agree = f"{np.count_nonzero(found.weights)} measurements agree: a pose needs at least {LEAST_POINTS}"
    reason = {FINE: "", FEW: agree, UNDETERMINED: "the points do not determine the pose"}[found.trouble]
    return TrackedPose(found.T_cam_world, found.weights, found.sigma, cov, reason)


class _Steps(NamedTuple):
    """Where the steps led: pose (4, 4), weights (N,), scale, normal matrix (6, 6), and what went wrong."""

    T_cam_world: Array
    weights: Array
    sigma: float
    H: Array
    trouble: int


@accelerated("pose:pinhole_steps")
def _pinhole_steps(
    K: Array, T_start: Array, X: Array, u: Array, root: Array, c: float, steps: int, least: float
) -> tuple[Array, Array, Array, Array]:
    """Pose, weights, normal matrix, (scale, trouble) with a pinhole K (4,) and Tukey's constant c."""
    found = _steps(lambda T: _pinhole_weighed(K, X, u, root, T, c, least), T_start, steps)
    return found.T_cam_world, found.weights, found.H, np.array([found.sigma, found.trouble])


def _steps(weighed: Callable[[Array], _Weighed], T: Array, steps: int) -> _Steps:
    """Reweighted steps; the last round only weighs."""
    for _ in range(steps):
        at = weighed(T)
        if at.trouble != FINE:
            return _Steps(T, at.weights, at.sigma, at.H, at.trouble)
        mu = -np.linalg.solve(at.H, at.g)
        T = se3.perturb(T, mu)
    at = weighed(T)
    return _Steps(T, at.weights, at.sigma, at.H, at.trouble)


class _Weighed(NamedTuple):
    """Normal equations H (6, 6), g (6,) at a pose, weights (N,), scale."""

    H: Array
    g: Array
    weights: Array
    sigma: float
    trouble: int


FINE, FEW, UNDETERMINED = 0, 1, 2
LEAST_POINTS = 4
"""Fewer measurements with weight leave no redundancy worth the name."""
WORST = 1e12
"""Condition of the scaled normal matrix beyond which the pose is not determined."""


def _weighed(
    camera: Camera, X: Array, u: Array, root: Array, T: Array, loss: Loss, least_sigma: float
) -> _Weighed:
    """Errors, scale, weights and normal equations at a pose."""
    X_cam = se3.act(T, X)
    at = camera.project_with_jacobians(X_cam)
    e = np.where(at.valid[:, None], (at.uv - u) * root[:, None], 0.0)
    sigma = max(norm_scale(e[at.valid]).sigma, least_sigma) if at.valid.any() else np.inf
    size = np.hypot(e[:, 0], e[:, 1])
    scaled = loss if isinstance(loss, L2) or not np.isfinite(sigma) else loss.scaled(sigma)
    w = np.where(at.valid, scaled.weight(size), 0.0)
    J = (pose_jacobian(at.J_point, X_cam) * root[:, None, None]).reshape(-1, 6)
    Jw = J * np.repeat(w, 2)[:, None]
    H = Jw.T @ J  # eq-track-normal
    g = Jw.T @ e.ravel()
    return _Weighed(H, g, w, sigma, _trouble(H, w))


def _pinhole_weighed(
    K: Array, X: Array, u: Array, root: Array, T: Array, c: float, least_sigma: float
) -> _Weighed:
    """:func:`_weighed` with a pinhole K (4,) and Tukey's loss, a coordinate of all points at a time."""
    x, y, z = T[:3, :3] @ X.T + T[:3, 3:]
    valid = (z > MIN_DEPTH) & (z < np.inf) & (np.abs(x) < MAX_TAN * z) & (np.abs(y) < MAX_TAN * z)
    if not valid.all():
        x, y, z, root = (np.where(valid, *pair) for pair in ((x, 0.0), (y, 0.0), (z, 1.0), (root, 0.0)))
    a, b = x / z, y / z
    e = np.stack([(K[0] * a + K[2] - u[:, 0]) * root, (K[1] * b + K[3] - u[:, 1]) * root])
    square = e[0] * e[0] + e[1] * e[1]
    sigma = max(MAD_NORM_2D * _median_root(square[valid]), least_sigma) if valid.any() else np.inf
    s = np.maximum(1.0 - square / (c * sigma) ** 2, 0.0)
    w = np.where(valid, s * s, 0.0)
    root = root * s  # half of the weight to each factor of J^T J
    J, fx, fy, ab = np.zeros((6, 2, len(z))), K[0] * root, K[1] * root, a * b
    fx_z, fy_z = fx / z, fy / z
    J[0, 0], J[2, 0], J[3, 0], J[4, 0], J[5, 0] = fx_z, -a * fx_z, -fx * ab, fx + fx * a * a, -fx * b
    J[1, 1], J[2, 1], J[3, 1], J[4, 1], J[5, 1] = fy_z, -b * fy_z, -fy - fy * b * b, fy * ab, fy * a
    rows = J.reshape(6, -1)
    H, g = rows @ rows.T, rows @ (e * s).ravel()  # eq-track-normal
    return _Weighed(H, g, w, sigma, _trouble(H, w))


def _median_root(square: Array) -> float:
    """Median of the roots of n squares, n at least 1: roots keep the order, so two of them are enough."""
    middle = [(len(square) - 1) // 2, len(square) // 2]
    return float(np.sqrt(np.partition(square, middle)[middle]).mean())


def _trouble(H: Array, w: Array) -> int:
    """What keeps normal equations from an answer."""
    if np.count_nonzero(w) < LEAST_POINTS:
        return FEW
    d = np.sqrt(np.diag(H))
    if not (d > 0).all():
        return UNDETERMINED
    values = np.linalg.eigvalsh(H / d[:, None] / d)
    return FINE if values[-1] <= WORST * values[0] else UNDETERMINED
