"""Motion, pose between and inverse depths that fit three pictures best.

The unit of length is the base line from a to b; directions are on the plane at depth 1, without unit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, times, transpose
from vslam_ref.estimation.pose_tracking import track_pose
from vslam_ref.estimation.robust import tuned
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.geometry.multiview import two_views
from vslam_ref.geometry.multiview._rays import across
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, checked_sigma, homogeneous

LEAST = 6
"""Triples: eleven numbers and an inverse depth each, four equations each, and two more."""
STEPS = 15
ENOUGH = 1e-4
"""Relative gain of a step that ends the search: far below what tells answers apart."""
MOST = 1e6
"""Damping at most: then no step helps."""
BEHIND = 1e12
"""Squared distance of a point behind a camera: finite, and beyond every loss."""
NEAREST = 1e-3
"""Depth in another picture, over that in the first: nearer counts as behind, or C has no Cholesky factor.

The derivatives of a position grow as one over this squared, so the entries of C reach 1e12: the 1 that is
added to them still counts in sixteen digits.
"""
FARTHEST = 1e-4
"""Inverse depth of a point at infinity while the third pose is looked for, over the base line."""


class ThreeViews(NamedTuple):
    """Motions and points that fit three pictures best, near one answer.

    Attributes
    ----------
    T_b_a : ndarray, shape (4, 4)
        The length of its translation is 1.
    T_m_a : ndarray, shape (4, 4)
        Of the picture between, in the same unit.
    inverse_depth : ndarray, shape (N,)
        Of each point along its ray in a, over the base line; not negative.
    squared : ndarray, shape (N,)
        Squared distances in units of sigma^2, three equations each; ``BEHIND`` for points behind a camera.
    """

    T_b_a: Array
    T_m_a: Array
    inverse_depth: Array
    squared: Array


def refine_three(
    T_start: ArrayLike, xn_a: ArrayLike, xn_m: ArrayLike, xn_b: ArrayLike, *, sigma: float, share: float = 0.5
) -> ThreeViews:
    """Motion, pose between and inverse depths with the smallest robust distances, near an answer.

    Implements :eq:`eq-three-views` and :eq:`eq-third-picture`.

    Parameters
    ----------
    T_start : array_like, shape (4, 4)
        Motion from a to b to start at.
    xn_a, xn_m, xn_b : array_like, shapes (N, 2)
        The same points in a, in the picture between, and in b, on the plane at depth 1.
    sigma, share : float
        As for :func:`~vslam_ref.estimation.third_picture.ask_third`.

    Returns
    -------
    ThreeViews

    Raises
    ------
    ValueError
        As for :func:`~vslam_ref.estimation.third_picture.ask_third`.
    """
    a, m = checked_pairs(xn_a, xn_m, LEAST)
    _, b = checked_pairs(xn_a, xn_b, LEAST)
    sigma = checked_sigma(sigma)
    at = _start(as_array("T_start", T_start, 4, 4), a, m, b, sigma, share)
    loss, damping = tuned("tukey", 2), 1e-3
    now = _linearised(at, a, m, b, sigma)
    for _ in range(STEPS):
        size = np.sqrt(now.squared)
        cost = float(loss.cost(size).sum())
        new = _moved(at, _step(now, loss.weight(size), at.inverse_depth, damping))
        then = _linearised(new, a, m, b, sigma)
        gain = cost - float(loss.cost(np.sqrt(then.squared)).sum())
        if gain > 0:
            at, now, damping = new, then, damping / 10.0
        else:
            damping *= 10.0
        if abs(gain) < ENOUGH * cost or damping > MOST:
            break
    return at._replace(squared=now.squared)


def _start(T: Array, a: Array, m: Array, b: Array, sigma: float, share: float) -> ThreeViews:
    """Inverse depths from both ends, and the pose of m that sees those points best."""
    T = two_views.perturb(T, np.zeros(5))
    depth = two_views.depths(T, a, b)[:, 0]
    w = np.where(np.isfinite(depth) & (depth > 0), 1.0 / np.where(depth == 0, 1.0, depth), 0.0)
    X = homogeneous(a) / np.maximum(w, FARTHEST)[:, None]
    guess = se3.exp(share * se3.log_of_motion(T))
    found = track_pose(Pinhole(1.0, 1.0, 0.0, 0.0), X, m, guess, sigma_px=sigma)
    return ThreeViews(T, found.T_cam_world, w, np.zeros(len(a)))


class _Linear(NamedTuple):
    """Whitened errors (N, 4), their derivatives (N, 4, 11) and in w (N, 4), squared lengths (N,)."""

    error: Array
    J: Array
    J_w: Array
    squared: Array


def _linearised(at: ThreeViews, a: Array, m: Array, b: Array, sigma: float) -> _Linear:
    """Errors in m and b, whitened by their covariance, which holds the noise of the ray in a."""
    rays, w = homogeneous(a), at.inverse_depth
    N = len(a)
    error, J, J_w, J_a = np.zeros((N, 4)), np.zeros((N, 4, 11)), np.zeros((N, 4)), np.zeros((N, 4, 2))
    valid = np.ones(N, np.bool_)
    for rows, T, x in ((slice(0, 2), at.T_m_a, m), (slice(2, 4), at.T_b_a, b)):
        R, t = se3.rotation(T), se3.translation(T)
        turned = rays @ R.T
        y = turned + w[:, None] * t
        ahead = y[:, 2] > NEAREST
        valid &= ahead
        depth = np.where(ahead, y[:, 2], 1.0)
        p = y[:, :2] / depth[:, None]
        error[:, rows] = p - x
        D = np.zeros((N, 2, 3))  # of p in y
        D[:, 0, 0] = D[:, 1, 1] = 1.0 / depth
        D[:, :, 2] = -p / depth[:, None]
        J_a[:, rows] = D @ R[:, :2]
        J_w[:, rows] = times(D, t)
        if rows.start == 0:
            J[:, rows, 5:8] = w[:, None, None] * D
            J[:, rows, 8:] = D @ -so3.hat(y)
        else:
            J[:, rows, 0:2] = w[:, None, None] * (D @ across(t).T)
            J[:, rows, 2:5] = D @ -so3.hat(turned)
    L = np.linalg.cholesky(np.eye(4) + J_a @ transpose(J_a))
    all_columns = np.concatenate([error[..., None], J_w[..., None], J], axis=-1)
    white = np.linalg.solve(L, all_columns) / sigma
    white[~valid] = 0.0
    error, J_w, J = white[..., 0], white[..., 1], white[..., 2:]
    squared = np.where(valid, np.sum(error**2, axis=-1), BEHIND)
    return _Linear(error, J, J_w, squared)


class _Step(NamedTuple):
    """Change of the eleven numbers (motion to b, then pose of m), and of the inverse depths (N,)."""

    motion: Array
    inverse_depth: Array


def _step(now: _Linear, weight: Array, w: Array, damping: float) -> _Step:
    """One damped Gauss-Newton step; the inverse depths are eliminated, each by its own equation."""
    own = np.sum(now.J_w**2, axis=-1)
    pull = np.sum(now.J_w * now.error, axis=-1)
    free = (own > 0) & ((w > 0) | (pull < 0))  # at infinity, only nearer is allowed
    share = np.where(free, 1.0 / np.where(free, own, 1.0), 0.0)
    mixed = np.einsum("nr,nrk->nk", now.J_w, now.J)
    left = now.J - (share[:, None] * now.J_w)[..., None] * mixed[:, None, :]
    rest = now.error - (share * pull)[:, None] * now.J_w
    flat = (left * weight[:, None, None]).reshape(-1, 11)
    H = flat.T @ left.reshape(-1, 11)
    g = flat.T @ rest.ravel()
    H = H + damping * np.diag(np.diag(H)) + max(1e-12 * np.trace(H), 1e-300) * np.eye(11)
    motion = -np.linalg.solve(H, g)
    return _Step(motion, -share * (pull + mixed @ motion))


def _moved(at: ThreeViews, step: _Step) -> ThreeViews:
    T_b_a = two_views.perturb(at.T_b_a, step.motion[:5])
    T_m_a = se3.perturb(at.T_m_a, step.motion[5:])
    return ThreeViews(T_b_a, T_m_a, np.maximum(at.inverse_depth + step.inverse_depth, 0.0), at.squared)
