r"""Resampling of whole Monte Carlo runs.

The rows of a data array (M, T) are runs, its columns times.  Only rows are exchangeable, so only rows
are drawn.  A draw is a row of weights w (M,) that sum to one, and the mean curve of the draw is ``w @ data``:
all draws at once are one matrix product.

Two kinds of draw:

* :func:`resample_weights`, *with* replacement, M out of M: the bootstrap.  It answers how far
  the population's mean could be from the truth.
* :func:`subset_weights`, *without* replacement, m out of M: what a study of m runs could have shown.  No run
  counts twice in a study, and with m = M the draw is the population itself.  The price: the spread of
  the draws is that of independent studies times :math:`\sqrt{1 - (m-1)/(M-1)}`, 0.937 for 50 out of 400, so
  shares lie a little nearer to 0 and 1 than fresh studies would put them.

Draws overlap (two draws of 50 out of 400 have 6 runs in common on average).  More draws sharpen the share
of *this* population; only more runs make it that of the filter.  :func:`share_interval` shows how much
that matters, by bootstrapping the population before drawing from it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array

Statistic = Callable[[Array], Array]
"""Maps mean curves (S, T) to one number (or truth value) per curve, (S,)."""

CHUNK = 256
"""Draws worked on at once; bounds the memory at CHUNK * T numbers."""


@dataclass(frozen=True)
class Share:
    """Share of draws in which a predicate holds, of ``draws`` draws of ``size`` runs."""

    value: float
    draws: int
    size: int


def resample_weights(runs: int, samples: int, rng: np.random.Generator) -> Array:
    """Bootstrap weights: each row draws ``runs`` out of ``runs`` with replacement.

    Returns
    -------
    ndarray, shape (samples, runs)
        Counts divided by ``runs``; rows sum to one.
    """
    _positive(runs=runs, samples=samples)
    return rng.multinomial(runs, np.full(runs, 1.0 / runs), size=samples) / runs


def subset_weights(population: int, size: int, samples: int, rng: np.random.Generator) -> Array:
    """Weights of subsets: each row draws ``size`` different runs out of ``population``.

    Returns
    -------
    ndarray, shape (samples, population)
        1/size at the chosen runs, 0 elsewhere.

    Raises
    ------
    ValueError
        If ``size`` is more than ``population``.
    """
    _positive(population=population, size=size, samples=samples)
    if size > population:
        raise ValueError(f"cannot draw {size} different runs out of {population}")
    keys = rng.random((samples, population))
    chosen = np.argpartition(keys, size - 1, axis=-1)[:, :size]
    weights = np.zeros((samples, population))
    np.put_along_axis(weights, chosen, 1.0 / size, axis=-1)
    return weights


def mean_curves(weights: ArrayLike, data: ArrayLike) -> Array:
    """Mean curves of draws, one matrix product.

    Parameters
    ----------
    weights : array_like, shape (S, M)
        A draw a row; rows sum to one.
    data : array_like, shape (M, T)
        A run a row.

    Returns
    -------
    ndarray, shape (S, T)
    """
    w, x = np.asarray(weights, dtype=np.float64), np.asarray(data, dtype=np.float64)
    if w.ndim != 2 or x.ndim != 2 or w.shape[1] != x.shape[0]:
        raise ValueError(f"need weights (S, M) and data (M, T), got {w.shape} and {x.shape}")
    return w @ x


def apply(weights: ArrayLike, data: ArrayLike, statistic: Statistic) -> Array:
    """Statistic of the mean curve of every draw, (S,), from ``weights (S, M)`` and ``data (M, T)``.

    In chunks of :data:`CHUNK` draws.  Weights have no unit; the answer has that of the statistic.
    """
    w = np.asarray(weights, dtype=np.float64)
    parts = [statistic(mean_curves(w[i : i + CHUNK], data)) for i in range(0, len(w), CHUNK)]
    return np.concatenate([np.asarray(p, dtype=np.float64) for p in parts])


def percentile_interval(values: ArrayLike, level: float = 0.95) -> tuple[float, float]:
    """Central interval that holds a share of the values.

    Parameters
    ----------
    values : array_like, shape (S,)
        NaN values make the interval NaN.
    level : float
        The share, in (0, 1).

    Returns
    -------
    (float, float)

    Raises
    ------
    ValueError
        If ``level`` is outside (0, 1).
    """
    if not 0.0 < level < 1.0:
        raise ValueError(f"level must lie in (0, 1), got {level}")
    tail = (1.0 - level) / 2.0
    low, high = np.quantile(np.asarray(values, dtype=np.float64), [tail, 1.0 - tail])
    return float(low), float(high)


def bootstrap_interval(
    data: ArrayLike,
    statistic: Statistic,
    rng: np.random.Generator,
    *,
    samples: int = 2000,
    level: float = 0.95,
) -> tuple[float, float]:
    """Percentile interval of a statistic of the mean curve, over resampled whole runs.

    Parameters
    ----------
    data : array_like, shape (M, T)
        One row per run.
    statistic : callable
        Mean curves (S, T) -> (S,).
    rng : Generator
        Source of the draws.
    samples : int
        Number of bootstrap draws.
    level : float
        Coverage aimed at.

    Returns
    -------
    (float, float)

    Notes
    -----
    For a time average, which is linear in the runs, the interval is that of a mean and covers as stated
    for M of about 50 and more.  A maximum over time is biased upwards: a resampled curve carries
    the noise of the population and its own.
    """
    x = np.asarray(data, dtype=np.float64)
    return percentile_interval(apply(resample_weights(len(x), samples, rng), x, statistic), level)


def share(
    data: ArrayLike, predicate: Statistic, size: int, rng: np.random.Generator, *, samples: int = 2000
) -> Share:
    """Share of ``size``-run subsets whose mean curve fulfils a predicate.

    Parameters
    ----------
    data : array_like, shape (M, T)
        One row per run.
    predicate : callable
        Mean curves (S, T) -> truth values (S,).
    size : int
        Runs of one study.
    rng : Generator
        Source of the draws.
    samples : int
        Number of draws.

    Returns
    -------
    Share
    """
    x = np.asarray(data, dtype=np.float64)
    holds = apply(subset_weights(len(x), size, samples, rng), x, predicate)
    return Share(float(np.mean(holds)), samples, size)


def sample_band(
    data: ArrayLike, size: int, rng: np.random.Generator, *, samples: int = 1000, level: float = 0.9
) -> tuple[Array, Array]:
    """Pointwise band of the mean curves of ``size``-run subsets.

    Parameters
    ----------
    data : array_like, shape (M, T)
        One row per run.
    size : int
        Runs of one study.
    rng : Generator
        Source of the draws.
    samples : int
        Number of draws.
    level : float
        Share of the studies inside the band, at each time by itself.

    Returns
    -------
    (ndarray, ndarray), shapes (T,)
        Lower and upper edge.  A whole curve leaves the band somewhere far more often than ``1 - level``.
    """
    x = np.asarray(data, dtype=np.float64)
    tail = (1.0 - level) / 2.0
    curves = mean_curves(subset_weights(len(x), size, samples, rng), x)
    low, high = np.quantile(curves, [tail, 1.0 - tail], axis=0)
    return low, high


def resampled_subset_weights(
    population: int, size: int, outer: int, inner: int, rng: np.random.Generator
) -> Array:
    """Weights of subsets of resampled populations, (outer * inner, population).

    Each of ``outer`` blocks of ``inner`` rows resamples the population with replacement once, then draws
    ``size`` places out of it without.  A run resampled twice may be drawn twice.
    """
    rows = []
    for _ in range(outer):
        names = rng.integers(population, size=population)
        places = subset_weights(population, size, inner, rng)
        weights = np.zeros((population, inner))
        np.add.at(weights, names, places.T)
        rows.append(weights.T)
    return np.concatenate(rows)


def share_interval(
    data: ArrayLike,
    predicate: Statistic,
    size: int,
    rng: np.random.Generator,
    *,
    outer: int = 100,
    inner: int = 100,
    level: float = 0.95,
) -> tuple[float, float]:
    """Interval of :func:`share` over resampled populations.

    The width that comes from drawing only ``inner`` subsets, at most ``1/(2 sqrt(inner))`` as a standard
    deviation, is included: the interval is a little too wide rather than too narrow.
    """
    x = np.asarray(data, dtype=np.float64)
    weights = resampled_subset_weights(len(x), size, outer, inner, rng)
    holds = apply(weights, x, predicate).reshape(outer, inner)
    return percentile_interval(holds.mean(axis=1), level)


def _positive(**numbers: int) -> None:
    for name, number in numbers.items():
        if number < 1:
            raise ValueError(f"{name} must be at least 1, got {number}")
