r"""How much each observation counts: a robust loss on the length of its whitened error.

The error of an observation is :math:`\lVert e \rVert_\Sigma = (e^T \Sigma^{-1} e)^{1/2}`, a length in
standard deviations, or in pixels where no covariance was given.  The objective is the sum of
:math:`\rho(\lVert e \rVert_\Sigma)`.

*Scale.*  A loss needs to know how large honest errors are.  It is given, or it is estimated: the adaptive
scale is taken from the median error anew after every accepted step, as PTAM does.  It changes the objective
as it goes; a step is always judged at one scale.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.robust import L2, Loss, norm_scale

ScaleRule = float | Literal["adaptive"]


@dataclass(frozen=True)
class Robust:
    """A loss and its scale.

    Parameters
    ----------
    loss : Loss
        In units of the scale; for the norm of a plane error (``TUNED_95`` has 95 % constants of both kinds).
    scale : float or "adaptive"
        Standard deviation of one coordinate of an honest error: pixels, or 1 where covariances are given.
    least_scale : float
        The adaptive scale is never less.  PTAM's is 0.4 pixels.

    Raises
    ------
    ValueError
        On a scale that is not positive.

    Notes
    -----
    The adaptive scale is that of the *residuals*.  Those of a fit with p parameters to m coordinates are
    smaller than the errors by about (1 - p/m)^(1/2): with each point seen four times, by a fifth or more.
    """

    loss: Loss = field(default_factory=L2)
    scale: ScaleRule = 1.0
    least_scale: float = 0.4

    def __post_init__(self) -> None:
        numbers = [self.least_scale] + ([] if self.scale == "adaptive" else [self.scale])
        if not all(isinstance(s, float | int) and s > 0 for s in numbers):
            what = "need a number > 0, or 'adaptive' for the scale"
            raise ValueError(f"scale={self.scale!r}, least_scale={self.least_scale!r}: {what}")

    def sigma(self, errors: Array, valid: BoolArray) -> float:
        """Scale for whitened errors (n, 2), of which the valid ones count."""
        if self.scale != "adaptive":
            return float(self.scale)
        found = norm_scale(errors[valid])
        return max(found.sigma, self.least_scale)


def whitener(cov_uv: Array) -> Array:
    """U (n, 2, 2) with U^T U the inverse of a covariance (n, 2, 2): the inverse of its Cholesky factor."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(cov_uv)))


def whitened(cov_uv: Array | None, r: Array) -> Array:
    """Residuals ``r (n, 2)`` in standard deviations of ``cov_uv (n, 2, 2)``; as they are without covariances.

    Examples
    --------
    >>> whitened(np.diag([4.0, 9.0])[None], np.array([[2.0, 3.0]]))
    array([[1., 1.]])
    """
    return r if cov_uv is None else np.einsum("nab,nb->na", whitener(cov_uv), r)


class Weighted(NamedTuple):
    """What errors cost at one scale.

    Attributes
    ----------
    costs, weights : ndarray, shape (n,)
        Of each observation; no unit.
    sigma : float
        The scale, in the unit of the errors.
    """

    costs: Array
    weights: Array
    sigma: float

    @property
    def cost(self) -> float:
        """Sum of all costs."""
        return float(self.costs.sum())


def weigh(robust: Robust, sigma: float, errors: Array, valid: BoolArray) -> Weighted:
    """Cost and weight of whitened errors (n, 2).

    An observation without an image (``valid (n,)`` is False) costs what an infinite error costs: a constant
    for a loss that gives up, infinity for one that does not.
    """
    loss = robust.loss.scaled(sigma) if math.isfinite(sigma) else L2()
    if isinstance(loss, L2):
        costs = 0.5 * np.einsum("ni,ni->n", errors, errors)  # eq-reprojection-sum
        return Weighted(np.where(valid, costs, np.inf), valid.astype(np.float64), sigma)
    sizes = np.hypot(errors[:, 0], errors[:, 1])
    worst = most(loss)
    costs = np.where(valid, loss.cost(sizes), worst)
    return Weighted(costs, np.where(valid, loss.weight(sizes), 0.0), sigma)


def most(loss: Loss) -> float:
    """What the largest error costs: a bound of the loss, or infinity.

    Examples
    --------
    >>> from vslam_ref.estimation.robust import Huber, Tukey
    >>> round(most(Tukey(3.0)), 12), most(Huber())
    (1.5, inf)
    """
    size = 1e8 * loss.c if math.isfinite(loss.c) else math.inf
    if math.isinf(size):
        return math.inf
    far, farther = float(loss.cost(size)), float(loss.cost(1e4 * size))
    return farther if farther <= far * (1.0 + 1e-9) else math.inf
