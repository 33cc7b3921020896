"""A Gaussian carried through a function by a few points: the step of the unscented Kalman filter.

The sketch, for one dimension; the points' mean and covariance are those of the Gaussian::

          .-'''-.                      every point goes through f,
        .'   |   '.          f         and moments are taken anew
    ---*-----*-----*---   ------>   ----*---*-------*----
     x - a   x   x + a                 a = sqrt((n + lambda) P)

The filters of this room linearise.  This step is here for comparison with programs that do not: a pose under
the rear-axle car, whose control is noisy, and a landmark of known place, seen by range and bearing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from vslam_ref.arrays import Array
from vslam_ref.filters.vehicle import ackermann, propagate
from vslam_ref.geometry import so2


class SigmaPoints(NamedTuple):
    """Points and their weights.

    Attributes
    ----------
    points : ndarray, shape (2n + 1, n)
        The mean; plus the columns of the root; minus them; in the units of the mean.
    w_mean, w_cov : ndarray, shape (2n + 1,)
        Weights of means, and of covariances; no unit.
    """

    points: Array
    w_mean: Array
    w_cov: Array


class PoseMoments(NamedTuple):
    """A pose and its covariance.

    Attributes
    ----------
    x : ndarray, shape (3,)
        Metres and radians, the heading in (-pi, pi].
    P : ndarray, shape (3, 3)
        Squares of them.
    """

    x: Array
    P: Array


def sigma_points(
    mean: ArrayLike, cov: ArrayLike, alpha: float = 1.0, beta: float = 2.0, kappa: float = 0.0
) -> SigmaPoints:
    """Points with the mean and the covariance of a Gaussian.

    Implements :eq:`eq-sigma-points`.

    Parameters
    ----------
    mean : array_like, shape (n,)
    cov : array_like, shape (n, n)
        Positive definite; its root is the lower Cholesky factor.
    alpha : float
        How far the points are spread, positive.
    beta : float
        What is known of the fourth moments; 2 for a Gaussian.
    kappa : float
        More spread; n + kappa must be positive.

    Returns
    -------
    SigmaPoints

    Raises
    ------
    ValueError
        If the spread is not positive, or the covariance not positive definite.

    Examples
    --------
    >>> points, w_mean, w_cov = sigma_points([0.0], [[4.0]])
    >>> points.tolist(), w_mean.tolist(), w_cov.tolist()
    ([[0.0], [2.0], [-2.0]], [0.0, 0.5, 0.5], [2.0, 0.5, 0.5])
    """
    mean, cov = np.asarray(mean, dtype=np.float64), np.asarray(cov, dtype=np.float64)
    n = len(mean)
    spread = alpha**2 * (n + kappa)  # n + lambda
    if not spread > 0:
        raise ValueError(f"alpha^2 (n + kappa) is {spread:g}; it must be positive")
    try:
        root = np.linalg.cholesky(spread * cov)
    except np.linalg.LinAlgError:
        raise ValueError("the covariance is not positive definite") from None
    points = np.concatenate([mean[None], mean + root.T, mean - root.T])
    w_mean = np.full(2 * n + 1, 0.5 / spread)
    w_mean[0] = (spread - n) / spread
    w_cov = w_mean.copy()
    w_cov[0] += 1.0 - alpha**2 + beta
    return SigmaPoints(points, w_mean, w_cov)


def predict_pose(
    x: ArrayLike,
    P: ArrayLike,
    control: ArrayLike,
    cov_u: ArrayLike,
    wheelbase: float,
    dt: float,
    **spread: float,
) -> PoseMoments:
    """Predict the pose of a rear-axle car whose control is noisy: points of pose and control together.

    Implements :eq:`eq-sigma-moments`.

    Parameters
    ----------
    x : array_like, shape (3,)
        Pose (x, y, theta), metres and radians.
    P : array_like, shape (3, 3)
    control : array_like, shape (2,)
        Speed (m/s) and steering angle (rad).
    cov_u : array_like, shape (2, 2)
    wheelbase, dt : float
        Metres and seconds.
    **spread
        alpha, beta, kappa of :func:`sigma_points`.

    Returns
    -------
    PoseMoments

    Examples
    --------
    >>> x, P = predict_pose([0.0, 0, 0], np.eye(3) * 1e-4, [1.0, 0.0], np.diag([0.01, 0.01]), 2.0, 1.0)
    >>> np.allclose(x, [1, 0, 0], atol=1e-3)
    True
    """
    mean = np.concatenate([np.asarray(x, dtype=np.float64), np.asarray(control, dtype=np.float64)])
    given = sigma_points(mean, block_diag(P, cov_u), **spread)
    moved = propagate(given.points[:, :3], ackermann(given.points[:, 3:], wheelbase, dt))
    middle, off = _mean(moved, given.w_mean, angle=2)
    return PoseMoments(middle, (given.w_cov * off.T) @ off)


def update_pose(
    x: ArrayLike, P: ArrayLike, landmark: ArrayLike, polar: ArrayLike, cov: ArrayLike, **spread: float
) -> PoseMoments:
    """Update a pose with range and bearing of a landmark whose place is known.

    Implements :eq:`eq-gain` with the covariances of :eq:`eq-sigma-moments`.

    Parameters
    ----------
    x : array_like, shape (3,)
    P : array_like, shape (3, 3)
    landmark : array_like, shape (2,)
        World, metres.
    polar : array_like, shape (2,)
        Range (m) and bearing (rad, to the left).
    cov : array_like, shape (2, 2)
    **spread
        alpha, beta, kappa of :func:`sigma_points`.

    Returns
    -------
    PoseMoments

    Examples
    --------
    >>> x, P = update_pose([0.0, 0, 0], np.eye(3) * 1e-4, [2.0, 0.0], [2.0, 0.0], np.eye(2) * 1e-4)
    >>> bool(np.linalg.eigvalsh(P).max() < 1.1e-4)
    True
    """
    x = np.asarray(x, dtype=np.float64)
    given = sigma_points(x, P, **spread)
    d = np.asarray(landmark, dtype=np.float64) - given.points[:, :2]
    seen = np.stack([np.hypot(d[:, 0], d[:, 1]), np.arctan2(d[:, 1], d[:, 0]) - given.points[:, 2]], 1)
    middle, off = _mean(seen, given.w_mean, angle=1)
    S = (given.w_cov * off.T) @ off + np.asarray(cov, dtype=np.float64)
    cross = (given.w_cov * (given.points - x).T) @ off
    K = np.linalg.solve(S, cross.T).T
    innovation = np.asarray(polar, dtype=np.float64) - middle
    innovation[1] = so2.wrap(innovation[1])
    after, kept = x + K @ innovation, np.asarray(P, dtype=np.float64) - K @ S @ K.T
    after[2] = so2.wrap(after[2])
    return PoseMoments(after, (kept + kept.T) / 2)


def _mean(values: Array, weights: Array, angle: int) -> tuple[Array, Array]:
    """Weighted mean, and the differences from it; one column is an angle, averaged about the first point."""
    off = values - values[0]
    off[:, angle] = so2.wrap(off[:, angle])
    step = weights @ off
    middle = values[0] + step
    middle[angle] = so2.wrap(middle[angle])
    return middle, off - step
