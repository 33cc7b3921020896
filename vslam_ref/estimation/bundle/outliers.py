"""Wrong observations, found by their errors, and taken out.

Errors are in pixels, or in standard deviations where covariances are given.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import BoolArray
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.bundle.projection import reprojection
from vslam_ref.estimation.bundle.result import BundleResult
from vslam_ref.estimation.bundle.solver import Options, Progress, bundle_adjust
from vslam_ref.estimation.bundle.weights import Robust, whitened

RAYLEIGH_99 = 3.034854258770293
"""Length of a plane Gaussian error, in standard deviations, that one honest error in a hundred exceeds."""


class Cleaned(NamedTuple):
    """Result on the observations that were kept, which they are (n,), and how often it was adjusted."""

    result: BundleResult
    kept: BoolArray
    rounds: int


def wrong(problem: BundleProblem, sigma: float, limit: float = RAYLEIGH_99) -> BoolArray:
    """Which observations are wrong: longer than ``limit`` times the scale, or without an image.

    Parameters
    ----------
    problem : BundleProblem
        Judged at its scene.
    sigma : float
        Standard deviation of one coordinate of an honest error.
    limit : float
        Standard deviations, > 0.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    if not limit > 0:
        raise ValueError(f"limit={limit}: need a number > 0")
    at = reprojection(problem)
    errors = whitened(problem.seen.cov_uv, at.r)
    return np.asarray((np.hypot(errors[:, 0], errors[:, 1]) > limit * sigma) | ~at.valid)


def adjust_and_clean(
    problem: BundleProblem,
    robust: Robust,
    options: Options | None = None,
    *,
    limit: float = RAYLEIGH_99,
    max_rounds: int = 10,
    progress: Progress | None = None,
) -> Cleaned:
    """Adjust, take out what is wrong, and adjust again until nothing new is wrong.

    An observation that was taken out is looked at again in every round, and comes back if the scene now
    explains it.  With a loss that gives up (Tukey), start near the minimum: what it gave up cannot pull
    the scene to where it would be explained.

    Parameters
    ----------
    problem : BundleProblem
    robust : Robust
        Loss and scale.
    options : Options, optional
        Of each adjustment.
    limit : float
        Standard deviations beyond which an observation is wrong.
    max_rounds : int
        Adjustments at most, >= 1.

    Returns
    -------
    Cleaned
        ``result.problem`` has the observations that were kept.
    """
    if max_rounds < 1:
        raise ValueError(f"max_rounds={max_rounds}: need at least 1")
    everything = problem.seen
    kept = np.ones(len(everything), dtype=np.bool_)
    rounds = 0
    while True:
        rounds += 1
        result = bundle_adjust(replace(problem, seen=everything.only(kept)), robust, options, progress)
        problem = replace(result.problem, seen=everything)
        good = ~wrong(problem, result.sigma, limit)
        if rounds == max_rounds or np.array_equal(good, kept) or not good.any():
            return Cleaned(result, kept, rounds)
        kept = good
