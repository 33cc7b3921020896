r"""What a third picture says about motions that two pictures leave open.

Two pictures of a plane have two answers.  Both explain the pairs equally well, with two different planes;
only one of these planes stays where it is when a third picture is looked at::

    picture a            picture m            picture b
        \                    |                    /           right answer: one plane, three rays meet
         o - - - - - - - - - o - - - - - - - - - o
    wrong answer: rays of a and b meet on another plane; no pose of m sees those points where m saw them

For every answer all is refined together: the motion from a to b (five numbers), the pose of m (six), and the
inverse depth :math:`w_j \ge 0` of each point on its ray in a.  A point :math:`(x_a, 1)/w` lies in camera c at

.. math:: y_c = R_c\, (x_a, 1)^T + w\, t_c, \qquad p_c = (y_{c1}, y_{c2}) / y_{c3} .

Its four errors :math:`e = (p_m - x_m,\; p_b - x_b)` carry the noise of the ray as well.  To first order
their covariance is

.. math:: C = \sigma^2 \bigl( I + J_a J_a^T \bigr), \qquad J_a = \partial p / \partial x_a ,

and :math:`e^T C^{-1} e`, at the best inverse depth, is the squared distance of the three positions from the
nearest three that fit: the Sampson distance, of three pictures.  No point can lie behind: infinity,
:math:`w = 0`, is the last place that is allowed.

**What decides.**  The costs per triple, truncated.  A pair leaves one equation, a triple three.  So

* an answer is told apart from another one as in :mod:`~vslam_ref.geometry.multiview.two_views.choice`;
* the best answer must *agree* with the third picture: the two equations that it adds may not cost more, each,
  than the one of the pair, by the same ratio (or ``agree``) and margin.  What moved while it was seen
  (people, a rolling shutter) can fit two pictures, and then fails here.

A straight path without a turn is the exception: the plane of the wrong answer then lies across the direction
of motion in every picture, and moves only with the square of the base line.  Then nothing is told apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array, times, transpose
from vslam_ref.estimation.pose_tracking import track_pose
from vslam_ref.estimation.robust import tuned
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.geometry.multiview import two_views
from vslam_ref.geometry.multiview._rays import across
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, checked_sigma, homogeneous
from vslam_ref.geometry.multiview.two_views.choice import MARGIN, RATIO, SAME_VALLEY
from vslam_ref.geometry.multiview.two_views.consensus import ONE_EQUATION, truncated_cost

THREE_EQUATIONS = 7.814727903251179
"""What chi-square of three degrees of freedom stays below with probability 0.95."""
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


@dataclass(frozen=True)
class ThirdPicture:
    """The answer that the third picture chose.

    Attributes
    ----------
    best : int
        Its number among the answers; -1 where there is none.
    views : ThreeViews or None
        Refined in all three pictures.
    costs : ndarray, shape (K,)
        Of the answers, refined, per triple that fits one of them: three equations, units of sigma^2.
    pair_cost : float
        Of the best, as it came or refined, in the two pictures alone, per pair that fits: one equation.
    added : float
        What each of the two equations of the third picture costs the same pairs.
    inliers : ndarray of bool, shape (N,)
        Triples that fit the best.
    reason : str
        Empty if the best is clearly the best, and the third picture agrees with it.
    """

    best: int
    views: ThreeViews | None
    costs: Array
    pair_cost: float
    added: float
    inliers: BoolArray
    reason: str


def ask_third(
    answers: ArrayLike,
    xn_a: ArrayLike,
    xn_m: ArrayLike,
    xn_b: ArrayLike,
    *,
    sigma: float,
    share: float = 0.5,
    agree: float = RATIO,
) -> ThirdPicture:
    """Let a third picture choose among the motions that two pictures allow, or refuse them all.

    Implements :eq:`eq-choice` on the distances of :eq:`eq-third-picture`.

    Parameters
    ----------
    answers : array_like, shape (K, 4, 4)
        Motions ``T_b_a``, each of another valley.
    xn_a, xn_m, xn_b : array_like, shape (N, 2)
        Normalised positions in the first, the third and the second picture; wrong ones may be among them.
    sigma : float
        Standard deviation of one coordinate, pixels over focal length.
    share : float
        About how much of the motion is done at m, a ratio: where the pose of m is looked for first.
    agree : float
        An equation of the third picture may cost so many times as much as one of the pair, a ratio.

    Returns
    -------
    ThirdPicture

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite, or ``sigma`` is not positive.

    Examples
    --------
    >>> X = np.array([[x, y, 4 + 0.2 * x] for x in (-1.0, 0, 1) for y in (-1.0, 0, 1)])  # a plane
    >>> T_m, T_b = se3.exp([-0.4, 0.3, 0, 0, 0, 0]), se3.exp([-1.0, 0, 0, 0, 0.1, 0])
    >>> a, m, b = (x[:, :2] / x[:, 2:] for x in (X, se3.act(T_m, X), se3.act(T_b, X)))
    >>> both = two_views.homography_motions(two_views.fit_homography(a, b), a).T_b_a
    >>> found = ask_third(both, a, m, b, sigma=1e-3)
    >>> bool(two_views.apart(found.views.T_b_a, T_b) < 1e-3), found.reason
    (True, '')
    """
    T = as_array("answers", answers, 4, 4)
    a, m = checked_pairs(xn_a, xn_m)
    _, b = checked_pairs(xn_a, xn_b)
    sigma = checked_sigma(sigma)
    if T.ndim != 3 or not np.isfinite(T).all():
        raise ValueError(f"answers of shape {T.shape}: need finite (K, 4, 4)")
    if len(T) == 0 or len(a) < LEAST:
        why = f"{len(a)} points are seen in all three pictures, {len(T)} answers: need {LEAST}, and 1"
        nothing = np.zeros(len(a), np.bool_)
        return ThirdPicture(-1, None, np.zeros(len(T)), np.inf, np.inf, nothing, why)
    each = [refine_three(t, a, m, b, sigma=sigma, share=share) for t in T]
    # an answer may have moved to its valley's floor only now
    refined = np.stack([views.T_b_a for views in each])
    pairs = two_views.cheirality(np.stack([T, refined]), a, b, sigma).squared
    triples = np.stack([views.squared for views in each])
    fits = triples <= THREE_EQUATIONS
    # a triple that fits none of the answers is a wrong match: it would only make all costs alike
    costs = truncated_cost(triples[:, _some(np.asarray(fits.any(axis=0)))], THREE_EQUATIONS)
    best = int(np.argmin(costs))
    # but a pair that fits the best must fit the third picture, too
    pair = pairs[:, best].min(axis=0)
    known = _some(pair <= ONE_EQUATION)
    pair_cost = float(truncated_cost(pair[known], ONE_EQUATION))
    added = (float(truncated_cost(triples[best, known], THREE_EQUATIONS)) - pair_cost) / 2.0
    reason = _disagreement(pair_cost, added, agree) or _rival(each, costs, best)
    return ThirdPicture(best, each[best], costs, pair_cost, added, fits[best], reason)


def _some(chosen: BoolArray) -> BoolArray:
    """What was chosen, or everything if nothing was."""
    return chosen if chosen.any() else np.ones(len(chosen), np.bool_)


def _disagreement(pair_cost: float, added: float, agree: float) -> str:
    if added > agree * pair_cost + MARGIN:
        return (
            "a picture between does not agree with the motion of the two: mean squared error "
            f"{added:.3g} there, {pair_cost:.3g} in the two"
        )
    return ""


def _rival(each: list[ThreeViews], costs: Array, best: int) -> str:
    """Empty, or which other motion stands in the way."""
    cost = float(costs[best])
    for k in np.argsort(costs, kind="stable"):
        other = two_views.apart(each[k].T_b_a, each[best].T_b_a) >= SAME_VALLEY
        if other and costs[k] < RATIO * cost + MARGIN:
            return (
                "two different motions explain three pictures about equally well, with mean squared errors "
                f"of {cost:.3g} and {costs[k]:.3g}: not told apart"
            )
    return ""


def refine_three(
    T_start: ArrayLike, xn_a: ArrayLike, xn_m: ArrayLike, xn_b: ArrayLike, *, sigma: float, share: float = 0.5
) -> ThreeViews:
    """Motion, pose between and inverse depths with the smallest robust distances, near an answer.

    Implements :eq:`eq-three-views` and :eq:`eq-third-picture`.  Parameters and errors as for
    :func:`ask_third`, with one start ``T_start (4, 4)``, from a to b.
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
