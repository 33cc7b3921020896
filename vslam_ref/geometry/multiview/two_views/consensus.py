r"""A model that most pairs agree on, although many pairs are wrong: random samples, the cheapest model wins.

A model is computed from the fewest pairs that determine it (five, or four), so that a sample without a wrong
pair is likely; and every model is judged on all pairs, by the truncated cost

.. math:: C = \sum_j \min(e_j^2 / \sigma^2,\; c^2) ,

with :math:`c^2` the value that a right pair stays below with probability 0.95 (MSAC).  RANSAC counts the
pairs below it, and cannot tell a model that fits its inliers well from one that hardly fits them.

**How many draws?**  With a share w of right pairs, a sample of m has no wrong one with probability
:math:`w^m`, so after

.. math:: k = \log(1 - p) / \log(1 - w^m)

draws one was clean with the confidence p.  w is taken from the best model so far.  The confidence speaks of
wrong pairs only: a clean sample of noisy pairs may still give a poor model.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.geometry.drawing import different_numbers
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, checked_sigma
from vslam_ref.geometry.multiview.two_views.eight_point import linear_essential, linear_fundamental
from vslam_ref.geometry.multiview.two_views.five_point import five_point_essentials
from vslam_ref.geometry.multiview.two_views.homography import fit_homography
from vslam_ref.geometry.multiview.two_views.sampson_distance import essential_sampson, homography_squared
from vslam_ref.geometry.multiview.two_views.seven_point import seven_point_fundamentals

ONE_EQUATION, TWO_EQUATIONS = 3.841458820694124, 5.991464547107979
"""What chi-square of one and of two degrees of freedom stays below with probability 0.95."""


@dataclass(frozen=True)
class Draws:
    """How samples are drawn.

    Parameters
    ----------
    confidence : float
        Probability in (0, 1) that at least one sample has no wrong pair.
    least, most : int
        Samples at least and at most.  Some more than the confidence asks for choose among clean samples the
        one that noise has harmed least.
    batch : int
        Samples that are solved at once.

    Raises
    ------
    ValueError
        If a number is outside its range.
    """

    confidence: float = 0.999
    least: int = 200
    most: int = 2000
    batch: int = 50

    def __post_init__(self) -> None:
        """Refuse settings that mean nothing."""
        if not 0.0 < self.confidence < 1.0 or min(self.least, self.most, self.batch) < 1:
            raise ValueError(f"{self}: need a confidence in (0, 1), and counts of at least 1")


@dataclass(frozen=True)
class Consensus:
    """The best model, and how it was found.

    Attributes
    ----------
    model : ndarray, shape (3, 3)
        E, F or H; zero where there is none.
    inliers : ndarray of bool, shape (N,)
        Pairs whose squared distance is below the threshold.
    cost : float
        MSAC cost per pair, in units of sigma^2, at most the squared threshold.
    draws : int
        Samples drawn.
    enough : bool
        Whether these were as many as the confidence asks for.
    reason : str
        Empty, or why there is no model.
    """

    model: Array
    inliers: BoolArray
    cost: float
    draws: int
    enough: bool
    reason: str


def essential_consensus(
    xn_a: ArrayLike, xn_b: ArrayLike, rng: np.random.Generator, *, sigma: float, draws: Draws | None = None
) -> Consensus:
    """Essential matrix of pairs of which many may be wrong, from samples of five.

    Implements :eq:`eq-msac` and :eq:`eq-draws`.

    Parameters
    ----------
    xn_a, xn_b : array_like, shape (N, 2)
        Normalised positions.
    rng : numpy.random.Generator
    sigma : float
        Standard deviation of one coordinate of the right pairs, pixels over focal length.
    draws : Draws, optional

    Returns
    -------
    Consensus

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite, or ``sigma`` is not positive.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> X = rng.uniform(-1, 1, (40, 3)) + [0, 0, 4]
    >>> a, b = X[:, :2] / X[:, 2:], (X[:, :2] - [1, 0]) / X[:, 2:]
    >>> b[:12] = rng.uniform(-0.5, 0.5, (12, 2))  # wrong matches
    >>> found = essential_consensus(a, b, rng, sigma=1e-3)
    >>> bool(found.inliers[12:].all()), found.reason
    (True, '')
    """
    a, b = checked_pairs(xn_a, xn_b)

    def models(sample_a: Array, sample_b: Array) -> Array:
        found = five_point_essentials(sample_a, sample_b)
        return found.E[found.valid]

    def refit(good_a: Array, good_b: Array) -> Array:
        return linear_essential(good_a, good_b).E

    kind = _Kind(5, 8, ONE_EQUATION, models, refit, _squared_E)
    return _consensus(a, b, rng, checked_sigma(sigma), draws or Draws(), kind)


def fundamental_consensus(
    uv_a: ArrayLike, uv_b: ArrayLike, rng: np.random.Generator, *, sigma: float, draws: Draws | None = None
) -> Consensus:
    """Fundamental matrix of pairs of which many may be wrong, from samples of seven: no camera is known.

    Implements :eq:`eq-msac` and :eq:`eq-draws`.  Parameters (``uv_a (N, 2)``, ``uv_b (N, 2)`` and ``sigma``,
    pixels), returns and errors as for :func:`essential_consensus`.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> X = rng.uniform(-1, 1, (40, 3)) + [0, 0, 4]
    >>> a, b = 500 * X[:, :2] / X[:, 2:], 500 * (X[:, :2] - [1, 0]) / X[:, 2:]
    >>> b[:12] = rng.uniform(-200, 200, (12, 2))  # wrong matches
    >>> found = fundamental_consensus(a, b, rng, sigma=0.5)
    >>> bool(found.inliers[12:].all()), found.reason
    (True, '')
    """
    a, b = checked_pairs(uv_a, uv_b)

    def models(sample_a: Array, sample_b: Array) -> Array:
        found = seven_point_fundamentals(sample_a, sample_b)
        return found.F[found.valid]

    kind = _Kind(7, 8, ONE_EQUATION, models, linear_fundamental, _squared_E)
    return _consensus(a, b, rng, checked_sigma(sigma), draws or Draws(), kind)


def homography_consensus(
    xn_a: ArrayLike, xn_b: ArrayLike, rng: np.random.Generator, *, sigma: float, draws: Draws | None = None
) -> Consensus:
    """Homography of pairs of which many may be wrong or off the plane, from samples of four.

    Implements :eq:`eq-msac` and :eq:`eq-draws`.  Parameters (``xn_a (N, 2)``, ``xn_b (N, 2)``, normalised
    or in pixels, with ``sigma`` in the same unit), returns and errors as for :func:`essential_consensus`.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> a = rng.uniform(-0.5, 0.5, (30, 2))
    >>> b = a + [0.1, 0.0]
    >>> b[:9] = rng.uniform(-0.5, 0.5, (9, 2))
    >>> found = homography_consensus(a, b, rng, sigma=1e-3)
    >>> bool(found.inliers[9:].all()), found.reason
    (True, '')
    """
    a, b = checked_pairs(xn_a, xn_b)
    kind = _Kind(4, 5, TWO_EQUATIONS, fit_homography, fit_homography, _squared_H)
    return _consensus(a, b, rng, checked_sigma(sigma), draws or Draws(), kind)


def draws_needed(share: float, size: int, confidence: float) -> float:
    """Samples after which one of ``size`` pairs had no wrong one, with the given confidence; a count.

    Implements :eq:`eq-draws`.  ``share`` of right pairs in [0, 1], a ratio.

    >>> round(draws_needed(0.5, 5, 0.99))
    145
    """
    clean = min(max(share, 0.0), 1.0) ** size
    if clean >= 1.0:
        return 0.0
    return math.log1p(-confidence) / math.log1p(-clean) if clean > 0.0 else math.inf


def truncated_cost(squared: Array, most: float) -> Array:
    """Mean of min(e^2, c^2) over the last axis, (...); ``squared (..., N)`` in units of sigma^2.

    Implements :eq:`eq-msac`.
    """
    return np.asarray(np.minimum(squared, most).mean(axis=-1))


class _Kind(NamedTuple):
    """A model: pairs of a sample, pairs of a fit to many, squared threshold, and its three functions."""

    size: int
    many: int
    most: float
    models: Callable[[Array, Array], Array]
    refit: Callable[[Array, Array], Array]
    squared: Callable[[Array, Array, Array], Array]


def _consensus(
    a: Array, b: Array, rng: np.random.Generator, sigma: float, draws: Draws, kind: _Kind
) -> Consensus:
    """Draw batches of samples until the confidence is reached."""
    if a.ndim != 2:
        raise ValueError(f"xn_a has shape {a.shape}: need (N, 2)")
    best, cost, drawn, needed = np.zeros((3, 3)), kind.most, 0, math.inf
    inliers = np.zeros(len(a), dtype=bool)
    if len(a) < kind.size:
        return Consensus(best, inliers, cost, 0, False, f"{len(a)} pairs: need at least {kind.size}")
    while drawn < min(max(needed, draws.least), draws.most):
        rows = different_numbers(rng, min(draws.batch, draws.most - drawn), len(a), kind.size)
        drawn += len(rows)
        candidate, price = _cheapest(kind.models(a[rows], b[rows]), a, b, sigma, kind)
        if price < cost:
            best, cost = _improved(candidate, price, a, b, sigma, kind)
            inliers = kind.squared(best, a, b) <= kind.most * sigma**2
            needed = draws_needed(float(inliers.mean()), kind.size, draws.confidence)
    reason = "" if inliers.sum() >= kind.size else f"no model of {drawn} samples fits {kind.size} pairs"
    return Consensus(best, inliers, cost, drawn, drawn >= needed, reason)


def _cheapest(models: Array, a: Array, b: Array, sigma: float, kind: _Kind) -> tuple[Array, float]:
    """Return the model with the smallest truncated cost, and that cost."""
    if len(models) == 0:
        return np.zeros((3, 3)), math.inf
    costs = truncated_cost(kind.squared(models, a, b) / sigma**2, kind.most)
    best = int(np.argmin(costs))
    return models[best], float(costs[best])


def _improved(
    model: Array, cost: float, a: Array, b: Array, sigma: float, kind: _Kind
) -> tuple[Array, float]:
    """Return the model or the linear one of all pairs that fit it, whichever is cheaper."""
    good = kind.squared(model, a, b) <= kind.most * sigma**2
    if good.sum() < kind.many:
        return model, cost
    other, price = _cheapest(kind.refit(a[good], b[good])[None], a, b, sigma, kind)
    return (other, price) if price < cost else (model, cost)


def _squared_E(E: Array, a: Array, b: Array) -> Array:
    return np.asarray(essential_sampson(E, a, b) ** 2)


def _squared_H(H: Array, a: Array, b: Array) -> Array:
    return homography_squared(H, a, b)
