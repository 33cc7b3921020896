"""Levenberg-Marquardt over views, points and intrinsics: the loop, and the reasons to end it.

One iteration, in this order:

1. ``normal``: linearise all observations, add up the blocks B, C, W and gradients;
2. ``schur``: damp, eliminate the points; ``reduced_system``: solve for the views; back to the points;
3. move poses by Exp(xi) T, intrinsics and points by addition; residuals there;
4. gain: decrease over promised decrease.  Good: go there, damp less.  Bad: stay, damp more, and go on at 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.bundle import projection, reduced_system, schur
from vslam_ref.estimation.bundle.problem import BundleProblem, Scene
from vslam_ref.estimation.bundle.projection import State
from vslam_ref.estimation.bundle.result import BundleResult, Iteration, Reason
from vslam_ref.estimation.bundle.step import DAMPED, Point, Step, System, damped_step, moved, system_at
from vslam_ref.estimation.bundle.structure import Structure, structure
from vslam_ref.estimation.bundle.weights import Robust, Weighted, weigh
from vslam_ref.estimation.least_squares.damping import gain_factor
from vslam_ref.geometry import se3

LEAST_GAIN = 1e-3
"""Share of the promised decrease that a step must bring."""

ROUNDING = 1e-14
"""A promise below this share of the cost cannot be seen in it."""

Progress = Callable[[Iteration], None]


@dataclass(frozen=True)
class Options:
    """When to end, and where the damping starts.

    Parameters
    ----------
    cost : float
        End when an accepted step decreases the cost by at most this share.
    gradient : float
        End when every column of the Jacobian is nearly at a right angle to the residuals.
    scale : float
        An adaptive scale must have settled to this share, too.
    max_iterations : int
        Steps tried at most.
    damping : float
        First lambda, > 0.
    method : {"dense", "banded"}, optional
        How the reduced system is solved; by size unless told.
    """

    cost: float = 1e-8
    gradient: float = 1e-10
    scale: float = 1e-4
    max_iterations: int = 100
    damping: float = 1e-4
    method: reduced_system.Method | None = None

    def __post_init__(self) -> None:
        if not (self.damping > 0 and math.isfinite(self.damping)):
            raise ValueError(f"damping={self.damping}: need a number > 0")
        if self.max_iterations < 0:
            raise ValueError(f"max_iterations={self.max_iterations}: must be >= 0")


@dataclass
class _Run:
    """One adjustment as it goes."""

    problem: BundleProblem
    robust: Robust
    options: Options
    table: Structure
    active: BoolArray
    damping: float
    growth: float = 2.0
    history: list[Iteration] = field(default_factory=list)

    @property
    def floor(self) -> float:
        """Cost of residuals that are nothing but the rounding of their pixels."""
        uv = self.table.links.uv
        return len(uv) * (8.0 * schur.EPS * max(1.0, float(np.abs(uv).max(initial=0.0)))) ** 2

    def point(self, state: State, sigma: float | None = None) -> Point:
        """Evaluate a state, at a given scale or at its own."""
        r, valid = projection.residuals(self.problem.model, state, self.table.links)
        return self.weighed(state, r, valid, sigma)

    def weighed(self, state: State, r: Array, valid: BoolArray, sigma: float | None = None) -> Point:
        """Weigh the residuals of a state, at a given scale or at their own."""
        errors = self.table.whitened(r)
        counted = valid & self.active
        used = self.robust.sigma(errors, counted) if sigma is None else sigma
        costs, weights, used = weigh(self.robust, used, errors, valid)
        inactive = ~self.active
        costs[inactive] = weights[inactive] = 0.0
        return Point(state, r, valid, Weighted(costs, weights, used))


def bundle_adjust(
    problem: BundleProblem,
    robust: Robust | None = None,
    options: Options | None = None,
    progress: Progress | None = None,
) -> BundleResult:
    r"""Minimise the reprojection errors of a scene.

    Implements :eq:`eq-a1-4` (A1.4), and with an adaptive Tukey loss :eq:`eq-a2-9` (A2.9).

    Parameters
    ----------
    problem : BundleProblem
        Where to start, and what may move.
    robust : Robust, optional
        Loss and scale; least squares by default.
    options : Options, optional
    progress : callable, optional
        Called with every :class:`~vslam_ref.estimation.bundle.result.Iteration`.

    Returns
    -------
    BundleResult
        Never with a NaN in its scene; ``reason`` says why it ended.

    Notes
    -----
    Cost of an iteration: O(n d^2) for n observations, plus for each point the square of its number of views,
    plus the reduced system, O(D^3) dense or O(D w^2) with the bandwidth w.  Memory: about 600 bytes an
    observation, and 8 D^2.

    Without fixed views the seven coordinates of the gauge are held by the damping alone; steps along them
    are zero to rounding, since the gradient has no part there.

    Examples
    --------
    >>> import numpy as np
    >>> from vslam_ref.estimation.bundle import Observations, Scene, freedom
    >>> from vslam_ref.geometry import se3
        >>> from vslam_ref.geometry.cameras import Pinhole, projection
    >>> X = np.random.default_rng(0).uniform([-1, -1, 4], [1, 1, 6], (20, 3))
    >>> T = se3.exp([[0.0, 0, 0, 0, 0, 0], [-1.0, 0, 0, 0, 0.2, 0]])
    >>> K = np.array([[500.0, 500.0, 320.0, 240.0]])
    >>> view, point = np.divmod(np.arange(40), 20)
    >>> uv = projection.pixel_from_world(K[0], T[view], X[point], lens=Pinhole.lens).uv
    >>> start = Scene(T, X + 0.05, K)
    >>> problem = BundleProblem(
    ...     Pinhole, start, Observations(view, point, uv), free=freedom(Pinhole, start, fixed_views=[0, 1]))
    >>> found = bundle_adjust(problem)
    >>> found.converged, bool(np.abs(found.problem.scene.X_world - X).max() < 1e-6)
    (True, True)
    """
    robust, options = robust or Robust(), options or Options()
    table = structure(problem)
    run = _Run(problem, robust, options, table, np.ones(len(table.order), dtype=np.bool_), options.damping)
    state = table.state(problem)
    first = run.point(state)
    if not math.isfinite(first.weighted.cost) and not first.valid.all():
        run.active &= first.valid
        first = run.point(state)
    ended = _cannot_begin(run, first)
    if ended is None:
        last, ended = _descend(run, first, progress)
    else:
        last = first
    return _result(run, first, last, ended)


_End = tuple[Reason, str]


def _cannot_begin(run: _Run, first: Point) -> _End | None:
    if len(first.r) == 0:
        return "no_observations", "there are no observations"
    if not (first.valid & run.active).any():
        return "no_images", "every observed point is behind its camera"
    if not math.isfinite(first.weighted.cost) or not np.isfinite(first.r).all():
        return "not_finite", "the cost is not finite at the start"
    if run.table.size == 0 and not run.table.free_point.any():
        return "nothing_free", "no view, point or lens may move"
    return None


def _descend(run: _Run, here: Point, progress: Progress | None) -> tuple[Point, _End]:
    """Try steps until there is a reason to end."""
    options = run.options
    system = None
    while True:
        if not here.weighted.weights.any():
            return here, ("all_outliers", f"no error is small against the scale {here.weighted.sigma:.3g}")
        if here.weighted.cost <= run.floor:
            return here, ("cost", f"residuals are zero to rounding, cost {here.weighted.cost:.3g}")
        system = system or system_at(run.problem, run.table, here)
        if system.gradient_norm <= options.gradient:
            return here, ("gradient", f"largest cosine {system.gradient_norm:.3g} <= {options.gradient:g}")
        if len(run.history) >= options.max_iterations:
            return here, ("max_iterations", f"{len(run.history)} steps tried")
        step = damped_step(run.table, system, run.damping, options.method)
        there = None if step is None else moved(run.problem, here.state, step)
        trial = None if there is None else run.point(there, here.weighted.sigma)
        judged = _judge(run, here, trial, step, system)
        run.history.append(judged)
        if progress is not None:
            progress(judged)
        if judged.accepted and trial is not None:
            run.damping, run.growth = max(run.damping * gain_factor(judged.gain), 1e-16), 2.0
            before = here
            # at its own scale, if that is adaptive: the residuals are known
            here = run.weighed(*trial[:3]) if run.robust.scale == "adaptive" else trial
            system = None
            settled = abs(here.weighted.sigma / before.weighted.sigma - 1.0) <= options.scale
            if settled and judged.decrease <= options.cost * before.weighted.cost:
                share = judged.decrease / before.weighted.cost
                return here, ("cost", f"the cost fell by {share:.3g} of itself <= {options.cost:g}")
        else:
            if step is not None and step.promised <= ROUNDING * here.weighted.cost:
                return here, ("cost", "no decrease is left that could be seen")
            run.damping, run.growth = run.damping * run.growth, 2.0 * run.growth
            if run.damping > DAMPED[1]:
                return here, (
                    "stalled",
                    f"no step decreases the cost, with a damping up to {run.damping:.3g}",
                )


def _judge(run: _Run, here: Point, trial: Point | None, step: Step | None, system: System) -> Iteration:
    """Compare what a step brought with what it promised; a step that leads nowhere is refused."""
    cost, sigma = here.weighted.cost, here.weighted.sigma
    if step is None or trial is None:
        return Iteration(cost, math.nan, system.gradient_norm, math.nan, run.damping, math.nan, False, sigma)
    # differences first, then the sum: equal digits of two large sums are not lost
    decrease = float((here.weighted.costs - trial.weighted.costs).sum())
    decent = bool(np.isfinite(decrease))
    gain = decrease / step.promised if step.promised > 0 else math.nan
    accepted = decent and gain > LEAST_GAIN
    after = trial.weighted.cost if accepted else cost
    return Iteration(after, decrease, system.gradient_norm, step.length, run.damping, gain, accepted, sigma)


def _result(run: _Run, first: Point, last: Point, ended: _End) -> BundleResult:
    """Put everything back into the problem's order."""
    table, problem = run.table, run.problem
    back, point_back = np.argsort(table.order), np.argsort(table.point_order)
    T = se3.from_rt(last.state.R_cam_world, last.state.t_cam_world)
    scene = Scene(T, last.state.X_world[point_back], last.state.intrinsics)
    return BundleResult(
        problem=problem.at(scene),
        initial_cost=first.weighted.cost,
        cost=last.weighted.cost,
        residual=last.r[back],
        valid=last.valid[back],
        weights=last.weighted.weights[back],
        aside=~run.active[back],
        sigma=last.weighted.sigma,
        reason=ended[0],
        message=ended[1],
        iterations=len(run.history),
        history=tuple(run.history),
    )
