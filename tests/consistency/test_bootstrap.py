"""Resampling of whole runs: weights, moments and coverage against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from vslam_ref.metrics import consistency as cs
from vslam_ref.metrics.consistency.bootstrap import resampled_subset_weights


@given(runs=st.integers(1, 40), samples=st.integers(1, 20), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_weights_sum_to_one_and_subsets_hold_different_runs(runs, samples, seed):
    rng = np.random.default_rng(seed)
    boot = cs.resample_weights(runs, samples, rng)
    assert boot.shape == (samples, runs)
    assert np.allclose(boot.sum(axis=1), 1, rtol=0, atol=runs * 2.3e-16)
    size = int(rng.integers(1, runs + 1))
    sub = cs.subset_weights(runs, size, samples, rng)
    assert np.all(np.count_nonzero(sub, axis=1) == size)
    assert set(np.unique(sub)) <= {0.0, 1 / size}


def test_every_run_is_drawn_equally_often():
    rng = np.random.default_rng(0)
    counts = np.count_nonzero(cs.subset_weights(40, 5, 8000, rng), axis=0)
    # hypergeometric margins: variance p(1-p) each and covariance -p(1-p)/39, so this sum is chi2 with 39 dof
    p = 5 / 40
    statistic = np.sum((counts - 8000 * p) ** 2) / (8000 * p * (1 - p)) * 39 / 40
    assert 1e-4 < stats.chi2(39).cdf(statistic) < 1 - 1e-4


def test_spread_of_subsets_is_that_of_a_finite_population():
    """Var of the mean of m out of M: s^2/m (1 - m/M) with the M-1 variance; the bootstrap's is s0^2/M."""
    rng = np.random.default_rng(1)
    x = rng.chisquare(3, (400, 1))
    n = 20_000
    # relative standard error of a variance from n draws is sqrt(2/n); four of them, false alarm 1e-4
    tolerance = 4 * np.sqrt(2 / n)
    sub = (cs.subset_weights(400, 50, n, rng) @ x).ravel()
    assert sub.var() == pytest.approx(x.var(ddof=1) / 50 * (1 - 50 / 400), rel=tolerance)
    boot = (cs.resample_weights(400, n, rng) @ x).ravel()
    assert boot.var() == pytest.approx(x.var() / 400, rel=tolerance)
    nested = (resampled_subset_weights(400, 50, 2000, 10, rng) @ x).ravel()
    # Var = Var(resampled mean) + E[within], s0^2/400 + (399/400) s0^2/50 (1 - 50/400) 400/399
    assert nested.var() == pytest.approx(x.var() * (1 / 400 + (1 - 50 / 400) / 50), rel=3 * tolerance)


def test_rows_are_kept_whole():
    """Data whose rows are constant: every mean curve must be constant too."""
    rng = np.random.default_rng(2)
    data = np.repeat(rng.standard_normal((30, 1)), 7, axis=1)
    curves = cs.mean_curves(cs.resample_weights(30, 100, rng), data)
    assert np.all(np.ptp(curves, axis=1) == 0)


def test_bootstrap_interval_covers_the_mean_as_stated():
    rng = np.random.default_rng(3)
    trials, covered = 400, 0
    for _ in range(trials):
        data = np.repeat(rng.chisquare(3, (100, 1)), 2, axis=1)
        low, high = cs.bootstrap_interval(data, cs.window_mean, rng, samples=400)
        covered += low <= 3.0 <= high
    # a percentile interval of a skewed mean undercovers by a percent or so at M = 100: 0.92 to 0.95
    low, high = stats.binom(trials, 0.92).ppf(1e-4), stats.binom(trials, 0.95).ppf(1 - 1e-4)
    assert low <= covered <= high


def test_counting_time_points_as_samples_would_undercover():
    """The mistake the module exists to avoid: resampling columns of correlated runs."""
    rng = np.random.default_rng(4)
    data = np.repeat(rng.chisquare(3, (50, 1)), 200, axis=1) + 0.1 * rng.standard_normal((50, 200))
    rows = np.diff(cs.bootstrap_interval(data, cs.window_mean, rng))
    columns = np.diff(cs.bootstrap_interval(data.T, cs.window_mean, rng))
    assert rows > 10 * columns


def test_share_counts_studies():
    rng = np.random.default_rng(5)
    data = np.zeros((40, 3))
    data[:10] = 1.0
    # at least 3 of the 10 marked runs among 8 drawn out of 40
    exact = stats.hypergeom(40, 10, 8).sf(2)
    found = cs.share(data, lambda c: c[:, 0] >= 3 / 8 - 1e-9, 8, rng, samples=20_000)
    low, high = stats.binom(20_000, exact).ppf([5e-5, 1 - 5e-5]) / 20_000
    assert low <= found.value <= high
    assert (found.draws, found.size) == (20_000, 8)


def test_share_interval_covers_the_share_of_fresh_studies():
    """A claim at one standard deviation: true share 0.84; small populations must not claim to know it."""
    rng = np.random.default_rng(6)

    def holds(curves):
        return curves[:, 0] > -1 / np.sqrt(50)

    intervals = np.array(
        [
            cs.share_interval(rng.standard_normal((200, 1)), holds, 50, rng, outer=60, inner=40)
            for _ in range(60)
        ]
    )
    truth = stats.norm.cdf(1)
    covered = np.count_nonzero((intervals[:, 0] <= truth) & (truth <= intervals[:, 1]))
    assert covered >= stats.binom(60, 0.9).ppf(1e-4)
    assert np.median(np.ptp(intervals, axis=1)) > 0.2


def test_same_generator_same_draws_and_chunks_do_not_matter(monkeypatch):
    data = np.random.default_rng(7).standard_normal((30, 4))
    first = cs.bootstrap_interval(data, cs.time_maximum, np.random.default_rng(1))
    monkeypatch.setattr("vslam_ref.metrics.consistency.bootstrap.CHUNK", 7)
    again = cs.bootstrap_interval(data, cs.time_maximum, np.random.default_rng(1))
    assert first == pytest.approx(again, rel=1e-14)


def test_bad_input_is_named():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="cannot draw 5 different runs out of 4"):
        cs.subset_weights(4, 5, 1, rng)
    with pytest.raises(ValueError, match="samples must be at least 1"):
        cs.resample_weights(4, 0, rng)
    with pytest.raises(ValueError, match="level"):
        cs.percentile_interval([1.0], 1.0)
    with pytest.raises(ValueError, match="need weights"):
        cs.mean_curves(np.ones((2, 3)), np.ones((4, 5)))
