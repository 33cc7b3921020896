r"""The similarity between two keyframes, from matches of which many may be wrong.

1. Draw three matches, :func:`~vslam_ref.geometry.alignment.align_triples`; 300 times.
2. Judge each similarity on all matches by both reprojections, with the truncated cost

   .. math:: C = \frac1{2N} \sum_j \min(\lVert r_{b,j}\rVert^2, c^2) + \min(\lVert r_{a,j}\rVert^2, c^2) .

3. Refine the cheapest one on the matches that agree with it: Levenberg-Marquardt on both reprojections, and
   on the ratios of distances, as well as these are known.
4. Find who agrees now, and refine once more.

The closed form of *all* agreeing matches, which looks like the natural third step, is worse than the sample
it began with: it squares distances in space, and those are mostly errors in depth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.least_squares import Options, Solution, minimise
from vslam_ref.estimation.robust import MAD_1D, tuned
from vslam_ref.estimation.similarity.matches import (
    LIMIT,
    PointMatches,
    agreeing,
    both_images,
    both_images_with_jacobians,
    distance_ratio,
    distance_ratio_with_jacobians,
    squared,
    whitened,
)
from vslam_ref.geometry import sim3
from vslam_ref.geometry.alignment import align_triples
from vslam_ref.geometry.drawing import different_numbers

DRAWS = 300
"""Samples.  With 70 % wrong matches one of 300 is without a wrong one with probability 0.9997."""
LEAST = 6
"""Matches that must agree before anything is refined: three make the sample, and as many must support it."""
LEAST_SPREAD = 0.01
"""No distance is known better than to a hundredth of it."""
STEPS = Options(max_iterations=50)


@dataclass(frozen=True)
class SimilarityEstimate:
    """A similarity, and who agrees with it.

    Attributes
    ----------
    S_b_a : ndarray, shape (4, 4)
        From the frame and unit of keyframe a to those of b; the identity where there is none.
    inliers : ndarray of bool, shape (N,)
        Matches of which both reprojections are within the limit.
    cost : float
        Truncated cost of the best sample, per error, sigma^2.
    draws : int
        Samples that determined a similarity.
    reason : str
        Empty, or why there is none.
    solution : Solution or None
        The last refinement's own record.
    """

    S_b_a: Array
    inliers: BoolArray
    cost: float
    draws: int
    reason: str
    solution: Solution | None = None


def estimate_similarity(
    matches: PointMatches, rng: np.random.Generator, *, draws: int = DRAWS, limit: float = LIMIT
) -> SimilarityEstimate:
    """Similarity between two keyframes, although many of the matches are wrong.

    Implements :eq:`eq-msac` with both reprojections, on samples by :eq:`eq-umeyama`.

    Parameters
    ----------
    matches : PointMatches
    rng : numpy.random.Generator
    draws : int
        Samples of three, at least 1.
    limit : float
        Of a squared reprojection error, sigma^2.

    Returns
    -------
    SimilarityEstimate

    Raises
    ------
    ValueError
        If ``draws`` or ``limit`` is not positive.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> rng, camera = np.random.default_rng(0), Pinhole(400.0, 400.0, 320.0, 240.0)
    >>> S = sim3.exp([0.3, 0, 0.1, 0, 0.1, 0, np.log(1.35)])
    >>> X_a = rng.uniform(-2, 2, (60, 3)) + [0, 0, 6]
    >>> X_b = sim3.act(S, X_a)
    >>> X_b[40:] = np.roll(X_b[40:], 1, axis=0)  # 20 wrong ones
    >>> uv_a, uv_b = camera.project(X_a).uv, camera.project(X_b).uv
    >>> found = estimate_similarity(PointMatches(camera, X_a, X_b, uv_a, uv_b, 1.0, 1.0), rng)
    >>> bool(np.abs(found.S_b_a - S).max() < 1e-9), int(found.inliers.sum()), found.reason
    (True, 40, '')
    """
    if draws < 1 or not limit > 0:
        raise ValueError(f"draws={draws}, limit={limit}: need at least 1 draw and a limit above 0")
    n, nobody = len(matches), np.zeros(len(matches), dtype=np.bool_)
    if n < 3:
        return SimilarityEstimate(np.eye(4), nobody, limit, 0, f"{n} matches: a similarity needs 3")
    rows = different_numbers(rng, draws, n, 3)
    found = align_triples(matches.X_a[rows], matches.X_b[rows])
    if not found.valid.any():
        why = f"all {draws} samples lie on one line or at one place"
        return SimilarityEstimate(np.eye(4), nobody, limit, 0, why)
    tried = found.S_target_source[found.valid]
    costs = np.minimum(squared(tried, matches), limit).mean((-2, -1))
    best = int(np.argmin(costs))
    S, cost = tried[best], float(costs[best])
    inliers, solution = agreeing(S, matches, limit), None
    for _ in range(2):
        if inliers.sum() < LEAST:
            why = f"{inliers.sum()} of {n} matches agree with the best of {len(tried)} samples, need {LEAST}"
            return SimilarityEstimate(np.eye(4), inliers, cost, len(tried), why)
        solution = refine_similarity(matches.only(inliers), S)
        S = solution.x
        inliers = agreeing(S, matches, limit)
    return SimilarityEstimate(S, inliers, cost, len(tried), "", solution)


def refine_similarity(matches: PointMatches, S_start: Array, *, options: Options | None = None) -> Solution:
    """Similarity with the smallest errors of both images and of the distances, near a start.

    Implements :eq:`eq-squares` with Huber's loss, for left perturbations of Sim(3).

    Parameters
    ----------
    matches : PointMatches
        All nearly right; the start must see them.
    S_start : ndarray, shape (4, 4)
        S_b_a to begin with; translation in the unit of b.
    options : Options, optional
        Of the solver.

    Returns
    -------
    Solution
        ``x`` is S_b_a; the residual has 4 N numbers of the images, then N of the distances, in sigmas.
    """
    m = matches
    spread = distance_spread(S_start, m)

    def residual(S: Array) -> Array:
        images = whitened(both_images(S, m.X_a, m.X_b, camera=m.camera), m)
        return np.concatenate([images.ravel(), distance_ratio(S, m.X_a, m.X_b).ravel() / spread])

    def with_jacobian(S: Array) -> tuple[Array, Array]:
        at = both_images_with_jacobians(S, m.X_a, m.X_b, camera=m.camera)
        far = distance_ratio_with_jacobians(S, m.X_a, m.X_b)
        J = (at.J_S / m.sigma[..., None]).reshape(-1, sim3.DOF)
        r = np.concatenate([whitened(at.uv, m).ravel(), far.value.ravel() / spread])
        return r, np.concatenate([J, far.J_S[:, 0] / spread])

    return minimise(
        residual,
        S_start,
        with_jacobian=with_jacobian,
        loss=tuned("huber"),
        plus=sim3.perturb,
        coordinates=sim3.DOF,
        options=options or STEPS,
    )


def distance_spread(S_b_a: Array, matches: PointMatches) -> float:
    """Standard deviation of the log-ratios of distances, a ratio, from the median of their deviations.

    Implements :eq:`eq-mad` for ``S_b_a (4, 4)``; never less than a hundredth.
    """
    ratio = distance_ratio(S_b_a, matches.X_a, matches.X_b)
    return max(MAD_1D * float(np.median(np.abs(ratio - np.median(ratio)))), LEAST_SPREAD)
