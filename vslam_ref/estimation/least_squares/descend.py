r"""The loop of Levenberg-Marquardt, for every problem that answers four questions.

=============================  ==========================================================================
``linearise(place, before)``   costs, gradient, and what the next step needs, at a place
``step(here, damping)``        the damped step, its length, and the decrease that the linear model promises
``move(here, step)``           the place to which it leads
``costs(place)``               what each measurement costs there
=============================  ==========================================================================

A place is what the problem likes it to be: a vector, poses and points, a camera.  Least squares of a dense
Jacobian, calibration, bundle adjustment and a vehicle's log all descend by this loop.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Generic, NamedTuple

from vslam_ref.estimation.least_squares.options import Options
from vslam_ref.estimation.least_squares.questions import Here, Place, Questions
from vslam_ref.estimation.least_squares.result import End, Iteration, Reason

FLAT = 1e-8
"""A whole step that promises more than this share of the cost and brings nothing: no minimum, a mistake."""


class Descent(NamedTuple, Generic[Here]):
    """Where a descent ended, why (in a word and in a sentence), and the steps that were tried."""

    here: Here
    reason: Reason
    message: str
    history: tuple[Iteration, ...]


class _Trial(NamedTuple, Generic[Here]):
    """What became of one step: the problem where it led, or None if it was refused."""

    there: Here | None = None
    length: float = math.nan
    cost: float = math.nan
    decrease: float = math.nan
    gain: float = math.nan
    end: End | None = None


def descend(
    problem: Questions[Place, Here],
    here: Here,
    options: Options,
    *,
    floor: float = 0.0,
    polish: bool = True,
    settled: Callable[[Here, Here], bool] = lambda before, after: True,
    progress: Callable[[Iteration], None] = lambda row: None,
) -> Descent[Here]:
    r"""Minimise the sum of all costs, :math:`\sum_i \rho(\lVert r_i(x) \rVert)`, from a place on.

    Implements :eq:`eq-gain-ratio`.

    Parameters
    ----------
    problem : Questions
    here : Linearised
        The problem at its start.
    options : Options
    floor : float
        End below this cost: residuals are then nothing but rounding, and their gradient points anywhere.
    polish : bool
        Where the cost cannot judge a step any more, take the undamped step as long as it halves the gradient;
        this wins the last digits.  False where undamped steps mean nothing: a free gauge.
    settled : callable
        Asked before the end by ``cost``, with the problem before and after a step; an adaptive scale of the
        costs must stand still, too.
    progress : callable
        Called with each step that was tried.

    Returns
    -------
    Descent
        Its cost is never above that of the start, unless the rule of damping takes every step.
    """
    rule, history = options.damping, list[Iteration]()
    state = rule.first(here.stiffness)
    while True:
        end = _arrived(here, options, len(history), floor)
        trial = _Trial[Here](end=end) if end else _try(problem, here, state.value, options, polish)
        there, end = trial.there, trial.end
        if there is None and end is not None:
            return Descent(here, *end, tuple(history))
        cost, taken = (trial.cost, True) if there is not None else (float(here.costs.sum()), False)
        row = (cost, trial.decrease, here.gradient_norm, trial.length, state.value, trial.gain, taken)
        history.append(Iteration(*row))
        progress(history[-1])
        if there is None:
            grown = rule.failure(state)
            if grown is None:
                return Descent(here, *_refused(state.value), tuple(history))
            state = grown
            continue
        state = rule.success(state, 1.0 if math.isnan(trial.gain) else trial.gain)
        arrived = end is not None and settled(here, there)
        here = there  # the old one's matrices are free now
        if end is not None and arrived:
            return Descent(here, *end, tuple(history))


def _arrived(here: Here, options: Options, tried: int, floor: float) -> End | None:
    """A reason to try no further step."""
    if here.costs.sum() < floor:
        return "cost", f"residuals are zero to rounding, cost {here.costs.sum():.3g}"
    if here.gradient_norm <= options.gradient:
        return "gradient", f"largest cosine of the gradient {here.gradient_norm:.3g} <= {options.gradient:g}"
    return ("max_iterations", f"{tried} steps tried") if tried >= options.max_iterations else None


def _try(
    problem: Questions[Place, Here], here: Here, damping: float, options: Options, polish: bool
) -> _Trial[Here]:
    """Compute one step and judge it by what it brings over what its model promises."""
    step, downhill = problem.step(here, damping), options.damping.downhill_only
    if step is None:
        return _Trial(end=None if damping > 0.0 else ("singular", "the undamped system is singular"))
    short = step.share <= options.step
    if short and damping <= here.stiffness:
        return _Trial(end=("step", f"a step of {step.share:.3g} of x <= {options.step:g}"))
    total = float(here.costs.sum())
    blind = downhill and step.promised <= options.rounding * total
    if polish and (short or blind):  # short only because it is damped
        return _polish(problem, here, total)
    place = problem.move(here, step)
    costs = None if place is None else problem.costs(place)
    # differences first, then the sum: equal digits of two large sums are not lost
    decrease = math.nan if costs is None else float((here.costs - costs).sum())
    gain = decrease / step.promised if step.promised > 0.0 else math.nan  # eq-gain-ratio
    refused = not math.isfinite(decrease) or (downhill and not gain > options.least_gain)
    if place is None or costs is None or refused:
        why: End = ("cost", "no decrease is left that could be seen")
        return _Trial(None, step.length, math.nan, decrease, gain, why if blind else None)
    small = max(abs(decrease), step.promised) <= options.cost * total
    why = "cost", f"the cost changes by {decrease / (total or 1.0):.3g} of itself <= {options.cost:g}"
    there = problem.linearise(place, here)
    return _Trial(there, step.length, float(costs.sum()), decrease, gain, why if small else None)


def _polish(problem: Questions[Place, Here], here: Here, total: float) -> _Trial[Here]:
    """Below rounding: take the undamped step if it makes the gradient smaller; else end."""
    step = problem.step(here, 0.0)
    place = None if step is None else problem.move(here, step)
    there = None if place is None else problem.linearise(place, here)
    if step is not None and there is not None and there.gradient_norm < 0.5 * here.gradient_norm:
        return _Trial(there, step.length, float(there.costs.sum()))
    # does the model promise little, or only its damped step?
    share = 0.0 if step is None else step.promised / total
    if share > FLAT:
        why = "a wrong Jacobian, or the edge of a lens's invertible field?"
        message = f"the model promises {share:.3g} of the cost, but no step brings it: {why}"
        return _Trial(end=("stalled", message))
    return _Trial(end=("cost", f"a whole step promises {share:.3g} of the cost, which is rounding"))


def _refused(damping: float) -> End:
    """The rule has no further damping to offer."""
    if damping == 0.0:
        return "not_finite", "an undamped step led to a residual or Jacobian that is not finite"
    return "stalled", f"no step decreases the cost, with a damping up to {damping:.3g}"
