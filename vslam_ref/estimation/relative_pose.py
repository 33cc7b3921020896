r"""The relative pose of two pictures with the smallest Sampson distances, and the whole way to it.

It minimises over the five numbers of a relative pose

.. math:: \sum_j \rho\bigl( s_j(R, t) / \sigma \bigr) ,

by Levenberg-Marquardt, with the left perturbation of
:mod:`vslam_ref.geometry.multiview.two_views.sampson_distance`.
All pairs count, far ones too: those fix the rotation.  No point is triangulated, so none has to have
parallax.

:func:`estimate_motion` is the way from pairs to a motion or to a reason: samples for an essential matrix and
for a homography, the motions of both, each refined, and the choice among them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.estimation.least_squares import Options, Solution, minimise
from vslam_ref.estimation.robust import Loss, tuned
from vslam_ref.geometry.multiview import two_views
from vslam_ref.geometry.multiview.epipolar import essential_from_motion
from vslam_ref.geometry.multiview.two_views import Choice, Consensus, Degeneracy, Draws, Verdict
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, checked_sigma
from vslam_ref.geometry.multiview.two_views.consensus import ONE_EQUATION

LEAST = 5
"""Pairs that determine a relative pose."""
REGULAR = 1e9
"""Condition of a homography from which on it is no map of a plane that is seen."""
PLANE_DRAWS = 500
"""Samples at most for the homography: enough for a plane that holds 35 % of the pairs (confidence 0.999)."""
FEW = 15
"""Pairs that must fit a motion, three samples' worth: the best of thousands fits some by chance."""
NEAR = Options(max_iterations=30, step=1e-4, cost=1e-5)
"""A candidate need be refined only so far that costs can be compared: far within its own uncertainty."""


@dataclass(frozen=True)
class RelativePose:
    """A relative pose, and how it was found.

    Attributes
    ----------
    T_b_a : ndarray, shape (4, 4)
        From camera a to camera b, its translation of length 1.
    cov_motion : ndarray, shape (5, 5), or None
        Covariance of the five numbers (two of the direction, three of the rotation), radians squared; None
        where it does not exist.
    distances : ndarray, shape (N,)
        Signed Sampson distances, in the unit of the positions.
    weights : ndarray, shape (N,)
        Of the robust loss at the end; 1 without.
    iterations : int
        Steps tried.
    converged : bool
    reason : str
        Empty if it converged and all is well; else what is wrong.
    solution : Solution or None
        The solver's own record; None where it never ran.
    """

    T_b_a: Array
    cov_motion: Array | None
    distances: Array
    weights: Array
    iterations: int
    converged: bool
    reason: str
    solution: Solution | None


@dataclass(frozen=True)
class MotionEstimate:
    """The motion between two pictures, with everything that was asked on the way.

    Attributes
    ----------
    T_b_a : ndarray, shape (4, 4)
        The best motion, its translation of length 1; the identity where there is none.
    inliers : ndarray of bool, shape (N,)
        Pairs that fit the motion.
    choice : Choice or None
        The best motion among its rivals, with costs per pair.
    verdict : Verdict or None
        Which case the pairs are.
    essential, homography : Consensus
    reason : str
        Empty if the motion may be used; else why not.
    """

    T_b_a: Array
    inliers: BoolArray
    choice: Choice | None
    verdict: Verdict | None
    essential: Consensus
    homography: Consensus
    reason: str


def refine_motion(
    xn_a: ArrayLike,
    xn_b: ArrayLike,
    T_start: ArrayLike,
    *,
    sigma: float,
    loss: Loss | None = None,
    options: Options | None = None,
) -> RelativePose:
    """Relative pose with the smallest (robust) Sampson distances near a start.

    Implements :eq:`eq-motion-refined`.

    Parameters
    ----------
    xn_a, xn_b : array_like, shape (N, 2)
        Normalised positions.
    T_start : array_like, shape (4, 4)
        ``T_b_a`` to start from, with a translation.
    sigma : float
        Standard deviation of one coordinate of the positions: pixels over focal length.
    loss : Loss, optional
        For distances in units of ``sigma``, such as ``tuned("tukey")`` or ``tuned("huber")``; least squares
        without.
    options : Options, optional
        Of the solver; at most 100 steps by default.

    Returns
    -------
    RelativePose
        ``reason`` reports too few pairs, a motion that is not determined, or no convergence.

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite, the start has no translation, or ``sigma`` is not
        positive.

    Examples
    --------
    >>> from vslam_ref.geometry import se3
    >>> X = np.array([[x, y, 4 + x * y - x] for x in (-1.0, 0, 1) for y in (-1.0, 0, 1)])
    >>> a, b = X[:, :2] / X[:, 2:], (X[:, :2] - [1, 0]) / X[:, 2:]
    >>> found = refine_motion(a, b, se3.exp([-1.0, 0.2, 0.1, 0, 0.03, 0]), sigma=1e-3)
    >>> bool(np.abs(found.T_b_a - se3.exp([-1.0, 0, 0, 0, 0, 0])).max() < 1e-9), found.reason
    (True, '')
    """
    a, b = _pairs(xn_a, xn_b)
    T = as_array("T_start", T_start, 4, 4)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise ValueError(f"T_start of shape {T.shape}: need a finite (4, 4)")
    sigma = checked_sigma(sigma)
    T = two_views.perturb(T, np.zeros(5))
    if len(a) < LEAST:
        why = f"{len(a)} pairs: a relative pose needs at least {LEAST}"
        return RelativePose(T, None, _distances(T, a, b), np.ones(len(a)), 0, False, why, None)

    def residual(motion: Array) -> Array:
        return two_views.sampson(motion, a, b).ravel() / sigma

    def with_jacobian(motion: Array) -> tuple[Array, Array]:
        at = two_views.sampson_with_jacobians(motion, a, b)
        return at.residual.ravel() / sigma, at.J_motion[:, 0] / sigma

    settings: Any = {"loss": loss, "plus": two_views.perturb, "coordinates": 5}
    options = options or Options(max_iterations=100)
    found = minimise(residual, T, with_jacobian=with_jacobian, options=options, **settings)
    return _result(a, b, found)


def estimate_motion(
    xn_a: ArrayLike, xn_b: ArrayLike, rng: np.random.Generator, *, sigma: float, draws: Draws | None = None
) -> MotionEstimate:
    """Motion between two pictures from pairs of which many may be wrong, or the reason why there is none.

    Implements A§2.2.2, the start from two frames: :eq:`eq-choice` on the motions of both models, each
    refined by
    :eq:`eq-motion-refined`.

    Parameters
    ----------
    xn_a, xn_b : array_like, shape (N, 2)
        As for :func:`refine_motion`, as ``sigma`` and the errors; many pairs may be wrong.
    rng : numpy.random.Generator
    sigma : float
    draws : Draws, optional
        How samples are drawn.

    Returns
    -------
    MotionEstimate

    Notes
    -----
    A plane is no reason to refuse as long as one of its two motions costs clearly less than the other.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> X = rng.uniform(-1, 1, (60, 3)) + [0, 0, 4]
    >>> a, b = X[:, :2] / X[:, 2:], (X[:, :2] - [1, 0]) / X[:, 2:]
    >>> b[:20] = rng.uniform(-0.5, 0.5, (20, 2))  # wrong matches
    >>> found = estimate_motion(a, b, rng, sigma=1e-3)
    >>> found.T_b_a[:3, 3].round(1) + 0.0, found.reason
    (array([-1.,  0.,  0.]), '')
    """
    a, b = _pairs(xn_a, xn_b)
    draws = draws or Draws()
    E = two_views.essential_consensus(a, b, rng, sigma=sigma, draws=draws)
    fewer = replace(draws, most=min(draws.most, PLANE_DRAWS))
    H = two_views.homography_consensus(a, b, rng, sigma=sigma, draws=fewer)
    nothing = np.zeros(len(a), dtype=bool)
    if E.reason:
        return MotionEstimate(np.eye(4), nothing, None, None, E, H, E.reason)
    motions, names = _candidates(a, b, E, H, sigma)
    choice = two_views.choose(motions, names, a, b, sigma=sigma)
    verdict = _verdict(a, b, choice, H, sigma)
    reason = _reason(choice, verdict)
    return MotionEstimate(choice.T_b_a, choice.inliers, choice, verdict, E, H, reason)


def _candidates(
    a: Array, b: Array, E: Consensus, H: Consensus, sigma: float
) -> tuple[list[Array], list[str]]:
    """Refined motions of both models and their names."""
    four = two_views.essential_motions(E.model)
    costs = two_views.cheirality(four, a, b, sigma).squared
    best = four[int(np.argmin(two_views.truncated_cost(costs, ONE_EQUATION)))]
    refined = _polished(a, b, best, E.inliers, sigma)
    # the other three share its distances: they differ in what lies in front
    motions = list(two_views.essential_motions(essential_from_motion(refined)))
    names = [f"essential {k + 1}" for k in range(4)]
    if not H.reason and np.linalg.cond(H.model) < REGULAR:
        fit = two_views.fit_homography(a[H.inliers], b[H.inliers])
        planes = two_views.homography_motions(fit, a[H.inliers])
        for k, T in enumerate(planes.T_b_a):
            if np.linalg.norm(T[:3, 3]) > 0:
                motions.append(_polished(a, b, T, H.inliers, sigma))
                names.append(f"plane {k + 1}")
    return motions, names


def _polished(a: Array, b: Array, T: Array, near: BoolArray, sigma: float) -> Array:
    """A motion after least squares on the pairs near it, then Tukey's loss on all pairs."""
    first = refine_motion(a[near], b[near], T, sigma=sigma, options=NEAR)
    return refine_motion(a, b, first.T_b_a, sigma=sigma, loss=tuned("tukey"), options=NEAR).T_b_a


def _reason(choice: Choice, verdict: Verdict) -> str:
    """Empty, or why the best motion may not be used."""
    fitting = int(choice.inliers.sum())
    if fitting < FEW:
        return f"too few pairs: {fitting} fit the best motion, need {FEW}"
    if verdict.degeneracy not in (Degeneracy.NONE, Degeneracy.PLANE):
        return verdict.reason
    return choice.reason


def _verdict(a: Array, b: Array, choice: Choice, H: Consensus, sigma: float) -> Verdict:
    """Name the case, from the pairs that fit the motion or the homography."""
    kept = choice.inliers | H.inliers
    a, b = a[kept], b[kept]
    model = H.model
    if not H.reason:
        both = H.inliers[kept]
        model = two_views.fit_homography(a[both], b[both])
    return two_views.degeneracy(a, b, essential_from_motion(choice.T_b_a), model, sigma=sigma)


def _pairs(xn_a: ArrayLike, xn_b: ArrayLike) -> tuple[Array, Array]:
    a, b = checked_pairs(xn_a, xn_b)
    if a.ndim != 2:
        raise ValueError(f"xn_a has shape {a.shape}: need (N, 2)")
    return a, b


def _distances(T: Array, a: Array, b: Array) -> Array:
    return two_views.sampson(T, a, b)[..., 0] if len(a) else np.zeros(0)


def _result(a: Array, b: Array, found: Solution) -> RelativePose:
    spread = found.covariance(sigma=1.0) if found.jacobian.size else None
    reason = "" if found.converged else found.message
    if found.converged and spread is not None and spread.matrix is None:
        reason = f"the motion is not determined: {spread.reason}"
    return RelativePose(
        T_b_a=found.x,
        cov_motion=None if spread is None else spread.matrix,
        distances=_distances(found.x, a, b),
        weights=found.weights,
        iterations=found.iterations,
        converged=found.converged,
        reason=reason,
        solution=found,
    )
