"""A simulated recording as the maps and the filter want it, and intervals over whole runs."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.filters.vehicle import Increment
from vslam_ref.grids import Scan
from vslam_ref.metrics.consistency import percentile_interval, resample_weights
from vslam_ref.worlds.floor_plan import Recording

DRAWS = 2000


def scan_of(recording: Recording, k: int) -> Scan:
    """Scan k as it was measured."""
    return Scan(
        recording.angles, recording.ranges[k], recording.config.laser.max_range, float(recording.times[k])
    )


def increment_of(recording: Recording, k: int) -> Increment | None:
    """What the odometry says of the way to scan k; None for the first one."""
    if k == 0:
        return None
    u, cov = recording.odometry.increment[k - 1], recording.odometry.cov[k - 1]
    return Increment(u[:1].copy(), u[1:].copy(), cov[None].copy())


def interval_of_means(values: ArrayLike, rng: np.random.Generator) -> list[float]:
    """95 % bootstrap interval of the mean of values (runs,), over whole runs."""
    values = np.asarray(values, dtype=np.float64)
    return list(percentile_interval(resample_weights(len(values), DRAWS, rng) @ values))


def null_rate(runs: int) -> float:
    """How often the interval of :func:`interval_of_means` lies above 0 for normal values with mean 0.

    The bootstrap's spread is that of the n values, with n in place of n - 1, and n values follow Student's
    distribution: for 6 runs 6.7 % instead of 2.5 %.
    """
    from scipy.stats import t

    return float(t.sf(1.96 * np.sqrt((runs - 1) / runs), runs - 1))


def interval_of_ratio(top: ArrayLike, bottom: ArrayLike, rng: np.random.Generator) -> list[float]:
    """95 % bootstrap interval of mean(top) / mean(bottom), runs (runs,) drawn in pairs."""
    both = np.stack([np.asarray(top, dtype=np.float64), np.asarray(bottom, dtype=np.float64)], 1)
    means = resample_weights(len(both), DRAWS, rng) @ both
    return list(percentile_interval(means[:, 0] / means[:, 1]))


def generator(seed: np.random.SeedSequence) -> np.random.Generator:
    """Return a generator that depends on the seed's words only, not on what was spawned from it before."""
    return np.random.default_rng(np.random.SeedSequence(seed.entropy, spawn_key=seed.spawn_key))
