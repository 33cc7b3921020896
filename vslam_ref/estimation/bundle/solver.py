"""Bundle adjustment: a problem, descended by Levenberg-Marquardt over views, points and intrinsics.

One iteration, in this order:

1. ``normal``: linearise all observations, add up the blocks B, C, W and gradients;
2. ``schur``: damp, eliminate the points; ``reduced_system``: solve for the views; back to the points;
3. ``adjustment``: move poses by Exp(xi) T, intrinsics and points by addition; residuals there;
4. :mod:`~vslam_ref.estimation.least_squares.descend`: the gain decides whether to go there, and the damping.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vslam_ref.estimation import least_squares
from vslam_ref.estimation.bundle import reduced_system
from vslam_ref.estimation.bundle.adjustment import Adjustment, Here, Place
from vslam_ref.estimation.bundle.problem import BundleProblem, Scene
from vslam_ref.estimation.bundle.result import BundleResult, Reason
from vslam_ref.estimation.bundle.structure import structure
from vslam_ref.estimation.bundle.weights import Robust
from vslam_ref.estimation.least_squares import Iteration, descend
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
        End when promised and actual decrease of a step are both at most this share of the cost.
    gradient : float
        End when every column of the Jacobian is nearly at a right angle to the residuals.
    scale : float
        An adaptive scale must have settled to this share, too.
    max_iterations : int
        Steps tried at most.
    damping : float
        First lambda, > 0.
    method : {"dense", "banded"}, optional
        How the reduced system is solved; by size if not given.
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
        self.descent()  # refuses what means nothing

    def descent(self) -> least_squares.Options:
        """Thresholds and rule of the descent; no end by the length of a step, which the gauge would blur."""
        return least_squares.Options(
            gradient=self.gradient,
            step=0.0,
            cost=self.cost,
            max_iterations=self.max_iterations,
            damping=least_squares.Ceres(1.0 / self.damping),
            least_gain=LEAST_GAIN,
            rounding=ROUNDING,
        )


def bundle_adjust(
    problem: BundleProblem,
    robust: Robust | None = None,
    options: Options | None = None,
    progress: Progress | None = None,
) -> BundleResult:
    r"""Minimise the reprojection errors of a scene.

    Implements :eq:`eq-a1-4` (A1.4), and with an adaptive Tukey loss :eq:`eq-a2-9` (A2.9): half the sum of
    squares of the whitened errors, or the sum of rho of their lengths.

    Parameters
    ----------
    problem : BundleProblem
        Where to start, and what may move.
    robust : Robust, optional
        Loss and scale; least squares by default.
    options : Options, optional
    progress : callable, optional
        Called with every :class:`~vslam_ref.estimation.least_squares.result.Iteration`.

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
    run = Adjustment(problem, robust, options.method, table, np.ones(len(table.order), dtype=np.bool_))
    state = table.state(problem)
    first = run.at(state)
    if not math.isfinite(first.weighted.cost) and not first.valid.all():
        run.active &= first.valid
        first = run.at(state)
    ended = _cannot_begin(run, first)
    if ended is not None:
        return _result(run, first, first, ended, ())
    last, ended, history = _descend(run, first, options, progress)
    return _result(run, first, last, ended, history)


_End = tuple[Reason, str]
_History = tuple[Iteration, ...]


def _cannot_begin(run: Adjustment, first: Place) -> _End | None:
    if len(first.r) == 0:
        return "no_observations", "there are no observations"
    if not (first.valid & run.active).any():
        return "no_images", "every observed point is behind its camera"
    if not math.isfinite(first.weighted.cost) or not np.isfinite(first.r).all():
        return "not_finite", "the cost is not finite at the start"
    if run.table.size == 0 and not run.table.free_point.any():
        return "nothing_free", "no view, point or lens may move"
    return None


def _descend(
    run: Adjustment, first: Place, options: Options, progress: Progress | None
) -> tuple[Place, _End, _History]:
    """Descend; a scale may adapt after every step, and must stand still at the end."""
    history: list[Iteration] = []

    def record(row: Iteration) -> None:
        history.append(row._replace(sigma=run.judged_at))
        if progress is not None:
            progress(history[-1])

    def settled(before: Here, after: Here) -> bool:
        return abs(after.place.weighted.sigma / before.place.weighted.sigma - 1.0) <= options.scale

    start, how = run.linearise(first), options.descent()
    # undamped steps mean nothing in a free gauge, so none is taken for the last digits
    end = descend(run, start, how, floor=run.floor, polish=False, settled=settled, progress=record)
    last = end.here.place
    ended: _End = (end.reason, end.message)
    if not last.weighted.weights.any():
        ended = "all_outliers", f"no error is small against the scale {last.weighted.sigma:.3g}"
    return last, ended, tuple(history)


def _result(run: Adjustment, first: Place, last: Place, ended: _End, history: _History) -> BundleResult:
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
        iterations=len(history),
        history=history,
    )
