r"""One motion of many: by its cost on all pairs, with its rivals named.

An essential matrix gives four motions, a homography two.  All are judged alike, by the truncated cost of
:mod:`~vslam_ref.geometry.multiview.two_views.in_front` per pair, in units of :math:`\sigma^2`.  A motion is
chosen only if it is clearly cheaper than every other: while a rival in another valley costs less than

.. math:: 1.5\, C_{\text{best}} + 0.01 ,

the pictures do not tell; a third one may.  Candidates should be refined first, or a good
valley is judged by a poor start in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, checked_sigma
from vslam_ref.geometry.multiview.two_views.consensus import ONE_EQUATION, truncated_cost
from vslam_ref.geometry.multiview.two_views.in_front import cheirality

RATIO, MARGIN = 1.5, 0.01
"""A rival is told apart if it costs at least RATIO times the best cost, and MARGIN sigma^2 a pair more."""
SAME_VALLEY = 0.1
"""Motions whose rotations and directions differ by less, radians, are one answer: adjusting joins them."""


@dataclass(frozen=True)
class Choice:
    """The cheapest motion, and what the others cost.

    Attributes
    ----------
    T_b_a : ndarray, shape (4, 4)
        The best one; the length of its translation is 1.
    name : str
        What it came from.
    cost : float
        Per pair that fits at least one of the motions, in units of sigma^2.
    rivals : tuple of (str, float)
        Names and costs of the other answers, cheapest first; each valley once.
    inliers, front : ndarray of bool, shape (N,)
        Pairs below the threshold, and pairs whose rays meet in front of both cameras.
    parallax : ndarray, shape (N,)
        Angles between the rays, radians.
    reason : str
        Empty if the best is clearly the best; else which rival stands in the way.
    answers : ndarray, shape (1 + rivals, 4, 4)
        The motions of the best and of the rivals, in their order; translations of length 1.
    """

    T_b_a: Array
    name: str
    cost: float
    rivals: tuple[tuple[str, float], ...]
    inliers: BoolArray
    front: BoolArray
    parallax: Array
    reason: str
    answers: Array


def choose(
    motions: ArrayLike, names: Sequence[str], xn_a: ArrayLike, xn_b: ArrayLike, *, sigma: float
) -> Choice:
    """Cheapest of K motions, or the reason why it is not clearly the cheapest.

    Implements :eq:`eq-choice`.

    Parameters
    ----------
    motions : array_like, shape (K, 4, 4)
        Candidates ``T_b_a``.
    names : sequence of K str
        Where each comes from, such as ``essential`` or ``plane 1``.
    xn_a, xn_b : array_like, shape (N, 2)
        Normalised positions; wrong pairs may be among them.
    sigma : float
        Standard deviation of one coordinate, pixels over focal length.

    Returns
    -------
    Choice

    Raises
    ------
    ValueError
        If there is no motion, counts disagree, or input is not finite.

    Examples
    --------
    >>> X = np.array([[x, y, 4 + x * y] for x in (-1.0, 0, 1) for y in (-1.0, 0, 1)])
    >>> a, b = X[:, :2] / X[:, 2:], (X[:, :2] - [1, 0]) / X[:, 2:]
    >>> right, left = se3.exp([-1.0, 0, 0, 0, 0, 0]), se3.exp([1.0, 0, 0, 0, 0, 0])
    >>> found = choose([left, right], ["left", "right"], a, b, sigma=1e-3)
    >>> found.name, round(found.cost, 9), found.reason
    ('right', 0.0, '')
    """
    T = as_array("motions", motions, 4, 4)
    if T.ndim != 3 or len(T) == 0 or len(T) != len(names):
        raise ValueError(f"{len(names)} names for motions {T.shape}: need (K, 4, 4), K at least 1")
    if not np.isfinite(T).all():
        raise ValueError("motions must be finite")
    a, b = checked_pairs(xn_a, xn_b, 1)
    at = cheirality(T, a, b, checked_sigma(sigma))
    # a pair that fits none of the motions is a wrong match: it would only make all costs alike
    known = (at.squared <= ONE_EQUATION).any(axis=0)
    squared = at.squared[:, known] if known.any() else at.squared
    costs = truncated_cost(squared, ONE_EQUATION)
    order = np.argsort(costs, kind="stable")
    best, rivals, seen = int(order[0]), [], [int(order[0])]
    for k in map(int, order[1:]):
        if min(apart(T[k], T[j]) for j in seen) >= SAME_VALLEY:
            rivals.append((names[k], float(costs[k])))
            seen.append(k)
    answers = T[seen]
    length = np.linalg.norm(answers[:, :3, 3], axis=-1, keepdims=True)
    answers[:, :3, 3] /= np.where(length > 0, length, 1.0)
    return Choice(
        T_b_a=answers[0],
        name=names[best],
        cost=float(costs[best]),
        rivals=tuple(rivals),
        inliers=at.squared[best] <= ONE_EQUATION,
        front=at.front[best],
        parallax=at.parallax[best],
        reason=_reason(float(costs[best]), rivals),
        answers=answers,
    )


def apart(T: ArrayLike, S: ArrayLike) -> float:
    """Larger of two angles, radians: between the rotations, and between the directions of motion.

    Of ``T (4, 4)`` and ``S (4, 4)``, translations in any unit.      Implements :eq:`eq-motion-error`.

    >>> round(apart(se3.exp([1.0, 0, 0, 0, 0, 0]), se3.exp([0, 1.0, 0, 0, 0, 0.1])), 3)
    1.621
    """
    T, S = as_array("T", T, 4, 4), as_array("S", S, 4, 4)
    turn = float(np.linalg.norm(so3.log_of_rotation(se3.rotation(T) @ se3.rotation(S).T)))
    t, s = se3.translation(T), se3.translation(S)
    return max(turn, float(np.arctan2(np.linalg.norm(np.cross(t, s)), t @ s)))


def _reason(cost: float, rivals: list[tuple[str, float]]) -> str:
    if rivals and rivals[0][1] < RATIO * cost + MARGIN:
        return (
            "two different motions explain the pairs about equally well, with mean squared errors of "
            f"{cost:.3g} and {rivals[0][1]:.3g}: the pictures do not tell them apart"
        )
    return ""
