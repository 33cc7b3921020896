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

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.estimation.three_views import LEAST, ThreeViews, refine_three
from vslam_ref.geometry.multiview import two_views
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, checked_sigma
from vslam_ref.geometry.multiview.two_views.choice import MARGIN, RATIO, SAME_VALLEY
from vslam_ref.geometry.multiview.two_views.consensus import ONE_EQUATION, truncated_cost

THREE_EQUATIONS = 7.814727903251179
"""What chi-square of three degrees of freedom stays below with probability 0.95."""


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
    >>> from vslam_ref.geometry import se3
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
