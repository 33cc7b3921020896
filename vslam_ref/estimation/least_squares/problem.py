"""What is minimised: residuals, their Jacobian (given or numeric), a robust loss, and a way to add a step.

Values that are not finite are no error here: an exponential may overflow at a bold step, and the solver
then takes a shorter one.  Residuals may have any unit, and parameters each its own unit.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.least_squares.damping import Damping, Nielsen
from vslam_ref.estimation.least_squares.linear import EPS, column_lengths, damped_step
from vslam_ref.estimation.least_squares.questions import Step
from vslam_ref.estimation.robust import L2, Loss

Function = Callable[[Any], ArrayLike]
Plus = Callable[[Array, Array], Array]


class Iterate(NamedTuple):
    """Everything known at one x.

    Attributes
    ----------
    x : ndarray, shape (k,)
    residual, costs, weights : ndarray, shapes (m,), (m / block,), (m,)
    jacobian : ndarray, shape (m, n)
    rows, target : ndarray, shapes (m, n), (m,)
        Jacobian and residual, multiplied by the roots of the weights.
    scale : ndarray, shape (n,)
        Diagonal of D.
    gradient_norm, stiffness : float
        As in :class:`~vslam_ref.estimation.least_squares.questions.LinearModel`.
    """

    x: Array
    residual: Array
    costs: Array
    weights: Array
    jacobian: Array
    rows: Array
    target: Array
    scale: Array
    gradient_norm: float
    stiffness: float


def add(x: Array, step: Array) -> Array:
    """Return ``x (n,)`` + ``step (n,)``, the way to add in a vector space."""
    return x + step


@dataclass(frozen=True)
class Problem:
    """Residuals r(x) = predicted - measured, (m,), and how to treat them.

    Parameters
    ----------
    residual : callable
        Maps x to (m,).
    with_jacobian : callable, optional
        Maps x to a pair: residual (m,) and Jacobian (m, n) with respect to the step.  Without it the
        Jacobian is numeric.
    loss : Loss
        Applied to each residual or, with ``block`` > 1, to the norm of each block of residuals.
    block : int
        Residuals that belong together: 2 for image errors.
    plus : callable
        ``plus(x, step)``; for poses the left perturbation, for vectors the sum.
    coordinates : int, optional
        Length n of a step, for a numeric Jacobian where it is not the length of x.
    damping : Damping
        Its metric D.
    """

    residual: Function
    with_jacobian: Callable[[Array], Any] | None = None
    loss: Loss = field(default_factory=L2)
    block: int = 1
    plus: Plus = add
    coordinates: int | None = None
    damping: Damping = field(default_factory=Nielsen)

    def residual_at(self, x: Array) -> Array:
        """Residual (m,), finite or not.

        Raises
        ------
        ValueError
            If it has not the shape (m,), m a multiple of ``block``.
        """
        with np.errstate(all="ignore"):
            r = np.asarray(self.residual(x), dtype=np.float64)
        if r.ndim != 1 or len(r) % self.block:
            raise ValueError(f"residual {r.shape}: need (m,) with m a multiple of {self.block}")
        return r

    def costs(self, x: Array) -> Array:
        """Cost of each block, (m / block,), finite or not."""
        return self._costs(self.residual_at(x))

    def linearise(self, x: Array, before: Iterate | None = None) -> Iterate | None:
        """Residual, weights and Jacobian at x; None where one of them is not finite.

        Implements :eq:`eq-linearised` and :eq:`eq-reweighted`.
        """
        residual, jacobian = self._linearise(x)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return None
        sizes, costs = self._sizes(residual), self._costs(residual)
        if not np.isfinite(costs.sum()):
            return None
        weights = np.repeat(self.loss.weight(sizes), self.block)
        root = np.repeat(self.loss.sqrt_weight(sizes), self.block)
        rows, target = jacobian * root[:, None], residual * root
        lengths = column_lengths(rows)
        scale = self.damping.scale(lengths, None if before is None else before.scale)
        slope, stiffness = (
            gradient_norm(rows, target, lengths),
            float(np.max(lengths / scale, initial=0.0)) ** 2,
        )
        return Iterate(x, residual, costs, weights, jacobian, rows, target, scale, slope, stiffness)

    def step(self, here: Iterate, damping: float) -> Step | None:
        """Damped step and its promise, the denominator of :eq:`eq-gain-ratio`."""
        change = damped_step(here.rows, here.target, damping, here.scale)
        if change is None:
            return None
        length = float(np.linalg.norm(here.scale * change))
        size = here.scale * here.x if self.plus is add else here.scale
        promised = 0.5 * float(np.sum((here.rows @ change) ** 2)) + damping * length**2  # eq-gain-ratio
        return Step(change, length, promised, length / max(float(np.linalg.norm(size)), 1e-300))

    def move(self, here: Iterate, step: Step) -> Array:
        """Return x after a step."""
        return self.plus(here.x, step.change)

    def _costs(self, residual: Array) -> Array:
        with np.errstate(all="ignore"):
            return self.loss.cost(self._sizes(residual))

    def _sizes(self, residual: Array) -> Array:
        """Residuals (m,), or norms of blocks (m / block,)."""
        if self.block == 1:
            return residual
        blocks: Array = np.linalg.norm(residual.reshape(-1, self.block), axis=1)
        return blocks

    def _linearise(self, x: Array) -> tuple[Array, Array]:
        if self.with_jacobian is None:
            residual = self.residual_at(x)
            with np.errstate(all="ignore"):
                return residual, numeric_jacobian(
                    self.residual, x, plus=self.plus, coordinates=self.coordinates
                )
        with np.errstate(all="ignore"):
            value, slope = self.with_jacobian(x)
        residual, jacobian = np.asarray(value, dtype=np.float64), np.asarray(slope, dtype=np.float64)
        if residual.ndim != 1 or jacobian.ndim != 2 or len(jacobian) != len(residual):
            raise ValueError(f"residual {residual.shape} and Jacobian {jacobian.shape}: need (m,) and (m, n)")
        return residual, jacobian


def gradient_norm(rows: Array, target: Array, lengths: Array) -> float:
    """Largest cosine between a column of ``rows (m, n)`` and ``target (m,)``; 0 where one of them is zero.

    ``lengths (n,)`` are those of the columns.  It has no unit, so one threshold serves pixels and metres.
    """
    length = float(np.linalg.norm(target))
    if length == 0.0 or rows.size == 0:
        return 0.0
    return float(np.abs((rows / lengths).T @ (target / length)).max())


def numeric_jacobian(
    function: Function, x: Array, *, plus: Plus = add, coordinates: int | None = None
) -> Array:
    r"""Jacobian by complex step where the function keeps complex numbers, else by central differences.

    Parameters
    ----------
    function : callable
        Maps x to (m,).
    x : ndarray, shape (k,)
    plus : callable
        Complex steps are tried only for the plain sum.
    coordinates : int, optional
        Length n of a step; the length of x by default.

    Returns
    -------
    ndarray, shape (m, n)

    Notes
    -----
    Complex step: :math:`\mathrm{Im} f(x + ihe_j)/h` with h = 1e-100, exact to rounding.  Central
    differences with h = eps^(1/3) max(1, \|x_j\|): about 10 digits.

    Examples
    --------
    >>> numeric_jacobian(lambda x: [x[0] * x[1], np.exp(x[0])], np.array([0.0, 3.0])).tolist()
    [[3.0, 0.0], [1.0, 0.0]]
    """
    n = len(x) if coordinates is None else coordinates
    if plus is add:
        columns = [_complex_column(function, x, j) for j in range(n)]
        exact = [c for c in columns if c is not None]
        if len(exact) == n and n > 0:
            return np.stack(exact, axis=1)
    sizes = np.maximum(1.0, np.abs(x)) if plus is add else np.ones(n)
    steps = EPS ** (1 / 3) * np.eye(n) * sizes
    pairs = [(function(plus(x, h)), function(plus(x, -h)), h.sum()) for h in steps]
    # eq-difference-quotient
    slopes = [(np.asarray(a, float) - np.asarray(b, float)) / (2.0 * h) for a, b, h in pairs]
    return np.stack(slopes, axis=1) if slopes else np.empty((len(np.asarray(function(x))), 0))


def _complex_column(function: Function, x: Array, j: int) -> Array | None:
    """Column j by complex step, or None where the function drops imaginary parts."""
    point = x.astype(np.complex128)
    point[j] += 1e-100j
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", np.exceptions.ComplexWarning)
            value = np.asarray(function(point))
    except (TypeError, np.exceptions.ComplexWarning):
        return None
    if not np.iscomplexobj(value) or math.isnan(float(np.abs(value).sum())):
        return None
    column: Array = value.imag / 1e-100
    return column
