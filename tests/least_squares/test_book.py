"""The book's loop and the fast one take the same steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vslam_ref.estimation.least_squares import Options, minimise
from vslam_ref.estimation.least_squares.book import levenberg_marquardt
from vslam_ref.estimation.robust import L2, Cauchy, Huber, Loss, Tukey

T = np.linspace(0.0, 3.0, 25)


def decays(b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two exponentials and their Jacobian."""
    e, f = np.exp(-b[1] * T), np.exp(-b[3] * T)
    return b[0] * e + b[2] * f, np.stack([e, -b[0] * T * e, f, -b[2] * T * f], 1)


@given(st.integers(0, 10**6), st.sampled_from([L2(), Huber(0.1), Cauchy(0.1), Tukey(0.5)]))
def test_same_steps(seed: int, loss: Loss) -> None:
    """Seven steps from a start 20 % off.

    The rows are conditioned like 1e3 with damping, their normal equations like 1e6: 1e-16 times this, over
    seven steps that each pass on what the last one lost, leaves 1e-8.
    """
    rng = np.random.default_rng(seed)
    truth = np.array([2.0, 0.5, 1.0, 2.5])
    y = decays(truth)[0] + rng.normal(0.0, 0.05, len(T))
    start = truth * rng.uniform(0.8, 1.2, 4)

    def f(b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, J = decays(b)
        return value - y, J

    options = Options(max_iterations=7, gradient=1e-8)
    fast = minimise(lambda b: f(b)[0], start, with_jacobian=f, loss=loss, options=options)
    slow = levenberg_marquardt(f, start, loss, iterations=7)
    n = min(len(fast.history), len(slow.costs) - 1)
    assert n >= 2
    assert [h.cost for h in fast.history][:n] == pytest.approx(slow.costs[1 : n + 1], rel=1e-8)
    if fast.reason == "max_iterations":
        np.testing.assert_allclose(slow.x, fast.x, rtol=1e-6)
    broken = levenberg_marquardt(lambda b: (f(b)[0], -f(b)[1]), start, loss, iterations=7)
    assert broken.costs[-1] == broken.costs[0]  # uphill: every step is refused


def test_a_scale_remembers_the_longest_column() -> None:
    """A rate whose exponential dies on the way: both forms keep its price, and take the same steps."""

    def f(b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, J = decays(b)
        return value - decays(np.array([2.0, 0.5, 1.0, 2.5]))[0], J

    start = np.array([1.0, 0.2, 3.0, 9.0])
    fast = minimise(lambda b: f(b)[0], start, with_jacobian=f, options=Options(max_iterations=8))
    slow = levenberg_marquardt(f, start, iterations=8)
    assert [h.cost for h in fast.history] == pytest.approx(slow.costs[1:], rel=1e-7)
