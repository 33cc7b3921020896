"""Intervals over whole runs, which the claims of all experiments share."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.metrics.consistency import percentile_interval, resample_weights

DRAWS = 2000


def interval_of_means(values: ArrayLike, rng: np.random.Generator) -> list[float]:
    """95 % bootstrap interval of the mean of values (runs,), over whole runs."""
    values = np.asarray(values, dtype=np.float64)
    return list(percentile_interval(resample_weights(len(values), DRAWS, rng) @ values))


def interval_of_ratio(top: ArrayLike, bottom: ArrayLike, rng: np.random.Generator) -> list[float]:
    """95 % bootstrap interval of mean(top) / mean(bottom), runs (runs,) drawn in pairs."""
    both = np.stack([np.asarray(top, dtype=np.float64), np.asarray(bottom, dtype=np.float64)], 1)
    means = resample_weights(len(both), DRAWS, rng) @ both
    return list(percentile_interval(means[:, 0] / means[:, 1]))


def null_rate(runs: int) -> float:
    """How often the interval of :func:`interval_of_means` lies above 0 for normal values with mean 0.

    The bootstrap's spread is that of the n values, with n in place of n - 1, and n values follow Student's
    distribution: for 6 runs 6.7 % instead of 2.5 %.
    """
    from scipy.stats import t

    return float(t.sf(1.96 * np.sqrt((runs - 1) / runs), runs - 1))


def interval_of_share(hits: int, tries: int) -> list[float]:
    """Wilson's 95 % interval of a share: all shares whose z-test the count does not refuse.

    It does not shrink to a point where nothing or all was hit.  Tries are taken as independent.

    Examples
    --------
    >>> [round(end, 4) for end in interval_of_share(5, 10)]
    [0.2366, 0.7634]
    >>> [round(end, 4) for end in interval_of_share(0, 10)]
    [0.0, 0.2775]
    """
    if not 0 <= hits <= tries or tries < 1:
        raise ValueError(f"{hits} hits of {tries} tries: need a try, and hits from 0 to all")
    z2 = 1.959963984540054**2
    middle = (hits + z2 / 2) / (tries + z2)
    half = np.sqrt(z2 * (hits * (tries - hits) / tries + z2 / 4)) / (tries + z2)
    return [max(float(middle - half), 0.0), min(float(middle + half), 1.0)]
