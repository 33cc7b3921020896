"""The loop of Levenberg-Marquardt, and the reasons to end it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.least_squares.damping import Damping, DampingState, Nielsen
from vslam_ref.estimation.least_squares.linear import column_lengths, damped_step
from vslam_ref.estimation.least_squares.problem import Function, Plus, Point, Problem, add
from vslam_ref.estimation.least_squares.result import Iteration, Reason, Solution
from vslam_ref.estimation.robust import L2, Loss

LEAST_GAIN = 1e-4
"""Share of the promised decrease that a step must bring."""

NOISE = 1e-12
"""A promise below this share of the cost may drown in the residuals' rounding: then the gradient decides."""

FLAT = 1e-8
"""A whole step that promises more than this share of the cost and brings nothing: no minimum, a mistake."""


@dataclass(frozen=True)
class Options:
    """When to end, and how to damp.

    Parameters
    ----------
    gradient : float
        End when every column of J is nearly at a right angle to r: largest cosine at most this.
    step : float
        End when a step is at most this share of x, both in the metric D.
    cost : float
        End when actual and promised decrease are both at most this share of the cost.
    max_iterations : int
        Steps tried at most.
    damping : Damping
        Nielsen's rule unless told otherwise.
    """

    gradient: float = 1e-10
    step: float = 1e-10
    cost: float = 1e-14
    max_iterations: int = 1000
    damping: Damping = field(default_factory=Nielsen)

    def __post_init__(self) -> None:
        """Refuse thresholds that mean nothing."""
        for name in ("gradient", "step", "cost"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ValueError(f"{name}={getattr(self, name)}: a threshold must lie in [0, 1)")
        if self.max_iterations < 0:
            raise ValueError(f"max_iterations={self.max_iterations}: must be >= 0")


class _End(NamedTuple):
    reason: Reason
    message: str


class _Trial(NamedTuple):
    """What became of one step: the point it led to, or None if it was refused."""

    point: Point | None
    step_norm: float
    gain: float
    end: _End | None


def minimise(
    residual: Function,
    start: ArrayLike,
    *,
    with_jacobian: Callable[[Array], Any] | None = None,
    loss: Loss | None = None,
    block: int = 1,
    plus: Plus = add,
    coordinates: int | None = None,
    options: Options | None = None,
) -> Solution:
    r"""Minimise :math:`\sum \rho(r_i(x))` by Levenberg-Marquardt; :math:`\tfrac12\|r\|^2` without a loss.

    Implements :eq:`eq-damped`, :eq:`eq-gain-ratio` and :eq:`eq-reweighted`.

    Parameters
    ----------
    residual : callable
        Maps x to (m,), predicted minus measured.
    start : array_like
        Where to begin, finite.
    with_jacobian, loss, block, plus, coordinates
        As for :class:`~vslam_ref.estimation.least_squares.problem.Problem`.
    options : Options, optional

    Returns
    -------
    Solution
        Never with a NaN in it; ``reason`` says why it ended.

    Raises
    ------
    ValueError
        If ``start`` is not finite, ``block`` below 1, or a callable returns a wrong shape.

    Notes
    -----
    A robust loss is used by plain reweighting: the gradient J^T W r is exact, the Hessian is taken as
    J^T W J.  This leaves out rho'' - w (Triggs' correction), which is never positive; so the model lies
    above the loss, and on a linear residual every step goes downhill.

    Where the promised decrease is too small to be seen in the cost (its twelfth digit), the undamped step
    is taken as long as it makes the gradient smaller.  This wins the last digits of the parameters.

    Examples
    --------
    >>> t = np.array([0.0, 1.0, 2.0, 3.0])
    >>> y = 2.0 * np.exp(-0.7 * t)
    >>> fit = minimise(lambda x: x[0] * np.exp(-x[1] * t) - y, [1.0, 0.1])
    >>> fit.x.round(9).tolist(), fit.converged
    ([2.0, 0.7], True)
    """
    x = np.array(start, dtype=np.float64)
    if not np.isfinite(x).all() or block < 1:
        raise ValueError(f"start {x.tolist()} must be finite and block={block} at least 1")
    options = options or Options()
    problem = Problem(residual, with_jacobian, loss or L2(), block, plus, coordinates)
    if problem.residual_at(x).size == 0:
        return _solution(_nowhere(x, np.zeros(0)), _End("no_residuals", "there are no residuals"), [])
    here = problem.at(x)
    if here is None:
        told = "residual, cost or Jacobian is not finite at the start"
        return _solution(_nowhere(x, problem.residual_at(x)), _End("not_finite", told), [])
    return _descend(problem, here, options)


def _descend(problem: Problem, here: Point, options: Options) -> Solution:
    """Try steps until a reason to end is found."""
    rule, history = options.damping, list[Iteration]()
    scale = rule.scale(here.rows, None)
    state = rule.first(here.rows, scale)
    while True:
        if here.gradient_norm <= options.gradient:
            told = f"largest cosine of the gradient {here.gradient_norm:.3g} <= {options.gradient:g}"
            return _solution(here, _End("gradient", told), history)
        if len(history) == options.max_iterations:
            return _solution(here, _End("max_iterations", f"{len(history)} steps tried"), history)
        trial = _try(problem, here, state, scale, options)
        if trial.point is None and trial.end is not None:
            return _solution(here, trial.end, history)
        before, damping = here, state.value
        if trial.point is not None:
            here = trial.point
            scale = rule.scale(here.rows, scale)
            state = rule.success(state, 1.0 if math.isnan(trial.gain) else trial.gain)
        else:
            grown = rule.failure(state)
            state = state if grown is None else grown
            if grown is None:
                return _solution(here, _refused(problem, damping), history)
        history.append(
            Iteration(
                float(here.costs.sum()),
                damping,
                trial.step_norm,
                before.gradient_norm,
                trial.gain,
                trial.point is not None,
            )
        )
        if trial.end is not None:
            return _solution(here, trial.end, history)


def _try(problem: Problem, here: Point, state: DampingState, scale: Array, options: Options) -> _Trial:
    """Compute one step and judge it."""
    step = damped_step(here.rows, here.target, state.value, scale)
    if step is None:
        if state.value > 0.0:
            return _Trial(None, math.nan, math.nan, None)
        return _Trial(None, math.nan, math.nan, _End("singular", "the undamped system is singular"))
    length = float(np.linalg.norm(scale * step))
    size = float(np.linalg.norm(scale * here.x)) if problem.plus is add else float(np.linalg.norm(scale))
    if length <= options.step * size:
        if state.value <= float(np.max(column_lengths(here.rows) / scale)) ** 2:
            told = f"step {length:.3g} <= {options.step:g} of {size:.3g}"
            return _Trial(None, length, math.nan, _End("step", told))
        return _polish(problem, here, scale, length)  # short only because it is damped
    promised = 0.5 * float(np.sum((here.rows @ step) ** 2)) + state.value * length**2
    x = problem.plus(here.x, step)
    costs = problem.costs(problem.residual_at(x))
    total = float(here.costs.sum())
    if not np.isfinite(costs.sum()):
        return _Trial(None, length, math.nan, None)
    if promised <= NOISE * total and options.damping.downhill_only:
        return _polish(problem, here, scale, length)
    # differences first, then the sum: two equal digits of two large sums are not lost
    actual = float((here.costs - costs).sum())
    gain = actual / promised if promised > 0.0 else math.nan
    if options.damping.downhill_only and not gain > LEAST_GAIN:
        return _Trial(None, length, gain, None)
    there = problem.at(x)
    end = None
    if there is not None and abs(actual) <= options.cost * total and promised <= options.cost * total:
        end = _End("cost", f"the cost changes by {actual / total:.3g} of itself <= {options.cost:g}")
    return _Trial(there, length, gain, end)


def _polish(problem: Problem, here: Point, scale: Array, length: float) -> _Trial:
    """Below rounding: take the undamped step if it makes the gradient smaller; else end."""
    step = damped_step(here.rows, here.target, 0.0, scale)
    there = None if step is None else problem.at(problem.plus(here.x, step))
    if step is not None and there is not None and there.gradient_norm < 0.5 * here.gradient_norm:
        return _Trial(there, float(np.linalg.norm(scale * step)), math.nan, None)
    # does the model promise little, or only its damped step?
    promised = 0.0 if step is None else 0.5 * float(np.sum((here.rows @ step) ** 2))
    share = promised / float(here.costs.sum())
    if share > FLAT:
        told = f"the model promises {share:.3g} of the cost, but no step brings it: is the Jacobian right?"
        return _Trial(None, length, math.nan, _End("stalled", told))
    told = f"a whole step promises {share:.3g} of the cost, which is rounding"
    return _Trial(None, length, math.nan, _End("cost", told))


def _refused(problem: Problem, damping: float) -> _End:
    """The rule has no further damping to offer."""
    if damping == 0.0:
        return _End("not_finite", "an undamped step led to a residual or Jacobian that is not finite")
    return _End("stalled", f"no step decreases the cost, with a damping up to {damping:.3g}")


def _nowhere(x: Array, residual: Array) -> Point:
    """A start from which nothing can be computed; numbers that are not finite are left out."""
    empty = np.zeros((0, 0))
    kept = residual if np.isfinite(residual).all() else np.zeros(0)
    none = np.zeros(len(kept))
    costs = none if len(residual) == 0 else np.array([math.inf])
    return Point(x, kept, costs, none, np.zeros((len(kept), x.size)), empty, none, 0.0)


def _solution(point: Point, end: _End, history: list[Iteration]) -> Solution:
    return Solution(
        x=point.x,
        cost=float(point.costs.sum()),
        residual=point.residual,
        jacobian=point.jacobian,
        weights=point.weights,
        reason=end.reason,
        message=end.message,
        iterations=len(history),
        history=tuple(history),
    )
