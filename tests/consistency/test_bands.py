"""Lines and bands against SciPy's chi-squared, the seed's printed numbers, and simulated studies."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from vslam_ref.metrics import consistency as cs


def test_the_numbers_of_fifty_runs_and_three_freedoms():
    assert round(cs.mean_line(50), 3) == 3.592
    assert [round(v, 3) for v in cs.mean_band(50)] == [2.360, 3.716]
    assert round(cs.detectable_inflation(50), 3) == 1.328


@given(runs=st.integers(1, 2000), dof=st.integers(1, 12), level=st.floats(0.001, 0.999))
def test_lines_equal_scipys_quantiles(runs, dof, level):
    # both invert the same function to a few units in the last place; 1e-10 leaves room for either
    assert cs.mean_line(runs, dof, level) == pytest.approx(
        stats.chi2(runs * dof).ppf(level) / runs, rel=1e-10
    )
    band = cs.mean_band(runs, dof, level)
    assert band.lower < band.upper
    assert stats.chi2(runs * dof).cdf(runs * np.array(band)) == pytest.approx(
        [(1 - level) / 2, (1 + level) / 2]
    )


def test_the_line_is_crossed_as_often_as_stated():
    rng = np.random.default_rng(0)
    studies = 20_000
    means = rng.chisquare(3, (studies, 50)).mean(axis=1)
    low, high = stats.binom(studies, 0.05).ppf([5e-5, 1 - 5e-5])  # false alarm 1e-4
    assert low <= np.count_nonzero(means > cs.mean_line(50)) <= high
    band = cs.mean_band(50)
    assert low <= np.count_nonzero((means < band.lower) | (means > band.upper)) <= high


def test_the_detectable_inflation_is_found_in_four_of_five_studies():
    rng = np.random.default_rng(1)
    studies = 20_000
    means = cs.detectable_inflation(50) * rng.chisquare(3, (studies, 50)).mean(axis=1)
    low, high = stats.binom(studies, 0.8).ppf([5e-5, 1 - 5e-5])
    assert low <= np.count_nonzero(means > cs.mean_line(50)) <= high


def test_a_curve_crosses_the_line_far_more_often_than_a_point():
    """Why pointwise lines are no test: 100 times, correlated 0.75 from end to end, exactly chi-squared."""
    rng = np.random.default_rng(2)
    shared, own = np.sqrt(0.75**0.5), np.sqrt(1 - 0.75**0.5)
    x = shared * rng.standard_normal((400, 50, 3, 1)) + own * rng.standard_normal((400, 50, 3, 100))
    curves = (x**2).sum(axis=2).mean(axis=1)
    crossed = np.mean(cs.time_maximum(curves) > cs.mean_line(50))
    assert np.mean(curves > cs.mean_line(50)) == pytest.approx(0.05, abs=0.03)
    assert crossed > 0.25


def test_summaries_of_a_curve():
    curve = np.array([[1.0, 5.0, 2.0, 4.0], [0.0, 0.0, 0.0, np.nan]])
    window = np.array([True, False, True, True])
    assert cs.fraction_above(curve, 3.0)[0] == 0.5
    assert cs.fraction_above(curve, 3.0, window)[0] == pytest.approx(1 / 3)
    assert cs.fraction_above(curve, 5.0)[0] == 0.0, "on the line is not above it"
    assert cs.time_maximum(curve, window)[0] == 4.0
    assert cs.window_mean(curve, window)[0] == pytest.approx(7 / 3)
    for summary in (cs.fraction_above(curve, 3.0), cs.time_maximum(curve), cs.window_mean(curve)):
        assert np.isnan(summary[1]), "a missing value is never a number"


@pytest.mark.parametrize("shape", [(), (1,), (3, 1, 2)])
def test_summaries_keep_the_batch_shape(shape):
    curves = np.zeros((*shape, 6))
    for summary in (cs.fraction_above(curves, 1.0), cs.time_maximum(curves), cs.window_mean(curves)):
        assert summary.shape == shape


def test_bad_input_is_named():
    with pytest.raises(ValueError, match="runs >= 1"):
        cs.mean_line(0)
    with pytest.raises(ValueError, match="0 < level < 1"):
        cs.mean_band(50, 3, 1.0)
    with pytest.raises(ValueError, match="no time point"):
        cs.time_maximum(np.zeros((2, 3)), np.zeros(3, dtype=bool))
    with pytest.raises(ValueError, match="window has shape"):
        cs.time_maximum(np.zeros((2, 3)), np.ones(4, dtype=bool))
