"""Draws of runs, from the study and from the worlds in which a claim is false.

Every pass yields mean curves chunk by chunk, so that the memory stays at CHUNK curves per series however many
draws there are.  The chunk is part of the stream of random numbers and therefore fixed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.iekf.measures import DOF, Curves, StudyClock
from vslam_ref.experiments.iekf.rules import Rule
from vslam_ref.metrics import consistency
from vslam_ref.metrics.consistency.bootstrap import resampled_subset_weights

SAMPLES = 2000
"""Draws for shares, bootstraps, thresholds and null rates: a share of 0.8 is known to 0.009."""

CHUNK = 250
OUTER, INNER = 100, 40
"""Resampled populations, and studies drawn from each, for the interval of a share."""

Series = Mapping[str, Array]
Pick = Callable[[Rule, Series], Curves]
"""Chooses, and alters, the curves that a rule is given."""


def centred(control: Series) -> dict[str, Array]:
    """Rescale a control to its known mean at every time.

    A finite control's own mean is off by chance, by a sixth of a study's spread for 1000 runs, and would move
    every threshold.  Its true mean is known, DOF at every time, so that part of the chance is removed.

    Raises
    ------
    ValueError
        If a mean is six standard errors from DOF: then the control is not a consistent one.
    """
    means = {name: x.mean(axis=0) for name, x in control.items()}
    for name, m in means.items():
        allowed = 6.0 * np.sqrt(2.0 * DOF / len(control[name]))
        worst = m[np.argmax(np.abs(m - DOF))]
        if abs(worst - DOF) > allowed:
            raise ValueError(
                f"{name} has a mean of {worst:.3f} somewhere; consistent is {DOF} +- {allowed:.3f}"
            )
    return {name: x * (DOF / means[name]) for name, x in control.items()}


def control_names(rule: Rule) -> tuple[str, ...]:
    """For every series of a rule the control with the same initial uncertainty."""
    return tuple(f"nees:control/{name.rpartition('/')[2]}" for name in rule.series)


def subsets(data: Series, size: int, rng: np.random.Generator) -> Iterator[Series]:
    """Mean curves of studies of ``size`` runs drawn without replacement."""
    for _ in range(SAMPLES // CHUNK):
        w = consistency.subset_weights(_runs(data), size, CHUNK, rng)
        yield {name: w @ x for name, x in data.items()}


def bootstraps(data: Series, rng: np.random.Generator) -> Iterator[Series]:
    """Mean curves of the population, its runs resampled with replacement."""
    for _ in range(SAMPLES // CHUNK):
        w = consistency.resample_weights(_runs(data), CHUNK, rng)
        yield {name: w @ x for name, x in data.items()}


def resampled_subsets(data: Series, size: int, rng: np.random.Generator) -> Iterator[Series]:
    """Mean curves of INNER studies from each of OUTER resampled populations."""
    for _ in range(OUTER):
        w = resampled_subset_weights(_runs(data), size, 1, INNER, rng)
        yield {name: w @ x for name, x in data.items()}


def swaps(data: Series, size: int, rng: np.random.Generator) -> Iterator[Series]:
    """Mean curves of studies, split by a fair coin per run.

    Under ``name`` stands the contribution of the runs that keep their label, under ``"go " + name`` that of
    the others; :func:`swapped` puts them together again.
    """
    for _ in range(SAMPLES // CHUNK):
        w = consistency.subset_weights(_runs(data), size, CHUNK, rng)
        change = rng.random(w.shape) < 0.5
        stay, go = np.where(change, 0.0, w), np.where(change, w, 0.0)
        yield {n: stay @ x for n, x in data.items()} | {f"go {n}": go @ x for n, x in data.items()}


def as_is(rule: Rule, curves: Series) -> Curves:
    """Take the study's own curves."""
    return tuple(curves[name] for name in rule.series)


def swapped(rule: Rule, curves: Series) -> Curves:
    """First half of the series against second half, labels exchanged where the coin said so."""
    n = len(rule.series)
    partner = [rule.series[(i + n // 2) % n] for i in range(n)]
    return tuple(curves[a] + curves[f"go {b}"] for a, b in zip(rule.series, partner, strict=True))


def consistent(rule: Rule, curves: Series) -> Curves:
    """Take the consistent control in place of the filters."""
    return tuple(curves[name] for name in control_names(rule))


def false_control(clock: StudyClock) -> Pick:
    """Alter the control until a claim of consistency, or of no growth, is false."""
    later = clock.time >= clock.lap_seconds * (1 - 1e-9)

    def pick(rule: Rule, curves: Series) -> Curves:
        calm = consistent(rule, curves)
        if rule.null == "inflated":
            return tuple(clock.inflation * c for c in calm)
        if rule.null == "grown" and rule.effect is not None:
            return tuple(np.where(later, rule.effect**2, 1.0) * c for c in calm)
        return calm

    return pick


def scaled(clock: StudyClock, population: Series) -> Pick:
    """Scale the first series until the population's two averages differ by effect^2."""

    def pick(rule: Rule, curves: Series) -> Curves:
        first, second = as_is(rule, curves)
        if rule.measure.window is None or rule.effect is None:
            raise ValueError("the scaled world needs a window and an effect")
        a, b = (clock.average(c, rule.measure.window)[0] for c in as_is(rule, population))
        return rule.effect**2 * (b / a) * first, second

    return pick


def _runs(data: Series) -> int:
    return len(next(iter(data.values())))
