"""Consistency in plain loops: NEES, its lines and bands, and the Monte Carlo: chapter 17 on a blackboard.

::

    for each run:                           its own generator, its own noises
        for each time:                      q = e^T P^-1 e,  e = truth - estimate
    mean over runs, at each time            near 3; under the chi-squared line, if the time was fixed before
    bootstrap:  draw whole runs again, with replacement, and see how far the answer moves

It is slow, and it shares no code with :mod:`.nees`, :mod:`.bands` and :mod:`.bootstrap`.  A test asserts that
they agree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from scipy.stats import chi2

from vslam_ref.arrays import Array

Run = Callable[[np.random.Generator], Iterable[tuple[Array, Array, Array]]]
"""Simulates one run: (true pose (3,), estimate (3,), covariance (3, 3)) at every time."""


def pose_error(truth: Array, mean: Array) -> Array:
    """E = truth (3,) - mean (3,) of poses (x, y, theta), metres and radians, the angle in (-pi, pi]."""
    e = truth - mean
    e[2] = np.arctan2(np.sin(e[2]), np.cos(e[2]))
    return e


def nees(e: Array, P: Array) -> float:
    """Square of an error e (d,) in units of its claimed covariance P (d, d)."""
    return float(e @ np.linalg.inv(P) @ e)  # eq-nees


def expected_nees(dof: int = 3) -> tuple[float, float]:
    """Mean and variance of an honest filter's NEES: chi-squared with ``dof`` degrees of freedom."""
    return float(chi2(dof).mean()), float(chi2(dof).var())  # eq-nees-moments


def monte_carlo(one_run: Run, seed: int, runs: int) -> Array:
    """NEES (M, T) of M independent runs at every time."""
    q = []
    for child in np.random.SeedSequence(seed).spawn(runs):
        times = one_run(np.random.default_rng(child))
        q.append([nees(pose_error(truth, mean), P) for truth, mean, P in times])
    return np.array(q)


def mean_line(runs: int, dof: int = 3, level: float = 0.95) -> float:
    """The mean NEES of honest runs lies under this line with probability ``level``, at one time."""
    return float(chi2(runs * dof).ppf(level) / runs)  # eq-band


def mean_band(runs: int, dof: int = 3, level: float = 0.95) -> tuple[float, float]:
    """The mean NEES of honest runs lies in this band with probability ``level``, at one time."""
    low, high = chi2(runs * dof).ppf([(1 - level) / 2, (1 + level) / 2]) / runs  # eq-band
    return float(low), float(high)


def mean_curve(q: Array) -> Array:
    """Mean (T,) over the runs of q (M, T), time by time."""
    M, T = q.shape
    return np.array([sum(q[run, k] for run in range(M)) / M for k in range(T)])


def bootstrap_interval(
    q: Array,
    statistic: Callable[[Array], float],
    rng: np.random.Generator,
    samples: int = 2000,
    level: float = 0.95,
) -> tuple[float, float]:
    """Interval of a statistic of the mean of q (M, T): M whole runs are drawn again, with replacement."""
    M, values = len(q), []
    for _ in range(samples):
        times_drawn = rng.multinomial(M, np.full(M, 1 / M))
        drawn = [q[run] for run in range(M) for _ in range(times_drawn[run])]
        values.append(statistic(mean_curve(np.array(drawn))))
    low, high = np.quantile(values, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def share(
    q: Array, holds: Callable[[Array], bool], size: int, rng: np.random.Generator, samples: int = 2000
) -> float:
    """Share of studies of ``size`` different runs out of q (M, T) whose mean curve fulfils ``holds``."""
    found = 0
    for _ in range(samples):
        chosen = np.argsort(rng.random(len(q)))[:size]
        found += bool(holds(mean_curve(q[chosen])))
    return found / samples
