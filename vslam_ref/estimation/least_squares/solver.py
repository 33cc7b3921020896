"""Least squares of residuals that are functions of a vector or a pose, with a dense Jacobian."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.least_squares.descend import descend
from vslam_ref.estimation.least_squares.options import Options
from vslam_ref.estimation.least_squares.problem import Function, Plus, Problem, add
from vslam_ref.estimation.least_squares.result import Reason, Solution
from vslam_ref.estimation.robust import L2, Loss


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

    Implements :eq:`eq-squares`.

    Parameters
    ----------
    residual : callable
        Maps x to (m,), predicted minus measured.
    start : array_like
        Where to begin, finite.
    with_jacobian, loss, block, plus, coordinates : optional
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
    problem = Problem(residual, with_jacobian, loss or L2(), block, plus, coordinates, options.damping)
    r = problem.residual_at(x)
    if r.size == 0:
        return _nothing(x, r, 0.0, "no_residuals", "there are no residuals")
    here = problem.linearise(x)
    if here is None:
        message = "residual, cost or Jacobian is not finite at the start"
        return _nothing(x, r if np.isfinite(r).all() else r[:0], math.inf, "not_finite", message)
    end = descend(problem, here, options)
    return Solution(
        x=end.here.x,
        cost=float(end.here.costs.sum()),
        residual=end.here.residual,
        jacobian=end.here.jacobian,
        weights=end.here.weights,
        reason=end.reason,
        message=end.message,
        iterations=len(end.history),
        history=end.history,
    )


def _nothing(x: Array, residual: Array, cost: float, reason: Reason, message: str) -> Solution:
    """The start, from which nothing can be computed."""
    m = len(residual)
    return Solution(x, cost, residual, np.zeros((m, x.size)), np.zeros(m), reason, message, 0, ())
