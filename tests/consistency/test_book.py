"""The book's loops and the fast statistics give the same numbers.

NEES: two ways to solve a 3 x 3 system of condition below 1e4, each exact to 10 eps cond = 2e-11 of the value.
Quantiles of chi-squared: SciPy's two routes agree to 1e-12.  Means of 20 numbers: 20 eps.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vslam_ref.metrics import consistency
from vslam_ref.metrics.consistency import book


def one_run(rng: np.random.Generator) -> Iterator[tuple[Any, Any, Any]]:
    """A random walk whose claimed covariance is its true one; headings cross +-pi."""
    truth, mean, P = np.array([0.0, 0.0, 3.1]), np.array([0.0, 0.0, 3.1]), np.zeros((3, 3))
    L = np.array([[0.3, 0, 0], [0.1, 0.2, 0], [-0.02, 0.05, 0.04]])
    for _ in range(8):
        truth, P = truth + L @ rng.standard_normal(3), P + L @ L.T
        yield truth * [1, 1, 0] + [0, 0, np.angle(np.exp(1j * truth[2]))], mean, P


def samples(runs: int, seed: int = 17) -> tuple[Any, Any, Any]:
    rows = [list(one_run(np.random.default_rng(c))) for c in np.random.SeedSequence(seed).spawn(runs)]
    return tuple(np.array([[step[part] for step in row] for row in rows]) for part in range(3))


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), d=st.integers(1, 6))
def test_nees(seed: int, d: int) -> None:
    rng = np.random.default_rng(seed)
    A, e = rng.standard_normal((d, d)), rng.standard_normal(d)
    P = A @ A.T + 0.01 * np.eye(d)
    fast = consistency.nees(e, P).value.item()
    assert abs(book.nees(e, P) - fast) < 10 * 2.2e-16 * np.linalg.cond(P) * max(1.0, fast)


def test_moments_of_an_honest_filter() -> None:
    """Mean d and variance 2 d; 4000 runs of the honest walk keep to them within 4 standard deviations."""
    mean, variance = book.expected_nees(3)
    assert (mean, variance) == (3.0, 6.0)
    truth, estimate, P = samples(4000)
    q = consistency.nees_pose(truth, estimate, P).value[:, -1]
    assert abs(q.mean() - mean) < 4 * np.sqrt(variance / 4000)


def test_monte_carlo_and_its_mean() -> None:
    q, (truth, mean, P) = book.monte_carlo(one_run, 17, 20), samples(20)
    fast = consistency.nees_pose(truth, mean, P).value
    assert np.abs(q / fast - 1).max() < 1e-10
    weights = np.full((1, 20), 1 / 20)
    assert np.abs(book.mean_curve(q) - consistency.mean_curves(weights, fast)[0]).max() < 1e-10 * fast.max()


@settings(max_examples=30, deadline=None)
@given(runs=st.integers(1, 1000), dof=st.integers(1, 6), level=st.floats(0.01, 0.99))
def test_lines_and_bands(runs: int, dof: int, level: float) -> None:
    assert abs(book.mean_line(runs, dof, level) / consistency.mean_line(runs, dof, level) - 1) < 1e-10
    assert np.allclose(book.mean_band(runs, dof, level), consistency.mean_band(runs, dof, level), rtol=1e-10)


def test_the_bootstrap_draws_the_same_runs() -> None:
    """The same generator gives the same draws, one by one or all at once."""
    q = book.monte_carlo(one_run, 17, 12)
    slow = book.bootstrap_interval(q, np.mean, np.random.default_rng(3), samples=60)
    rng = np.random.default_rng(3)
    fast = consistency.bootstrap_interval(q, lambda curves: curves.mean(1), rng, samples=60)
    assert np.allclose(slow, fast, rtol=1e-12)


def test_shares_of_studies() -> None:
    """Subsets are drawn in two ways: 4 standard deviations of two shares of 600 draws."""
    q = book.monte_carlo(one_run, 17, 40)
    line = float(np.median(q.mean(1)))
    slow = book.share(q, lambda curve: curve.mean() > line, 5, np.random.default_rng(1), samples=600)
    rng = np.random.default_rng(2)
    fast = consistency.share(q, lambda curves: curves.mean(1) > line, 5, rng, samples=600).value
    assert 0.1 < slow < 0.95
    assert abs(slow - fast) < 4 * np.sqrt(2 * 0.25 / 600)


def test_every_changed_sign_shows(flips: Any) -> None:
    q, intervals = book.monte_carlo(one_run, 17, 12), {}
    band, error = book.mean_band(50), book.pose_error(np.array([1.0, 2.0, 3.0]), np.array([0.5, 1.0, -3.0]))
    assert error[2] < 0  # truth - estimate, wrapped
    intervals["right"] = book.bootstrap_interval(q, np.mean, np.random.default_rng(3), samples=60)
    missed, tried = [], 0
    for line, module in flips(book):
        tried += 1
        found = [
            np.allclose(module.mean_band(50), band),
            np.allclose(module.pose_error(np.array([1.0, 2.0, 3.0]), np.array([0.5, 1.0, -3.0])), error),
        ]
        if all(found):
            try:
                other = module.bootstrap_interval(q, np.mean, np.random.default_rng(3), samples=60)
                missed += [line] if np.allclose(other, intervals["right"]) else []
            except ValueError:
                continue  # a quantile outside [0, 1]: it shows
    assert tried >= 5
    assert not missed
