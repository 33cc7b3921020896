"""Exercise 5.1: a Levenberg-Marquardt that goes downhill, in any units, past overflows."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

EXERCISE = "05_levenberg_marquardt"
Pair = tuple[np.ndarray, np.ndarray]


class Counted:
    """A problem that counts its evaluations and hands out copies."""

    def __init__(self, function: Callable[[np.ndarray], Pair]) -> None:
        self.function, self.calls = function, 0

    def __call__(self, x: np.ndarray) -> Pair:
        self.calls += 1
        if self.calls > 5000:
            pytest.fail("more than 5000 evaluations: there is no rule that ends this")
        with np.errstate(all="ignore"):
            r, J = self.function(np.array(x, dtype=float))
        return r.copy(), J.copy()

    def cost(self, x: np.ndarray) -> float:
        with np.errstate(all="ignore"):
            return 0.5 * float(np.sum(self.function(np.asarray(x, dtype=float))[0] ** 2))


def rosenbrock(x: np.ndarray) -> Pair:
    return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]]), np.array([[-20 * x[0], 10.0], [-1.0, 0.0]])


T = np.linspace(0.0, 10.0, 30)


def growth(x: np.ndarray) -> Pair:
    """3 exp(0.3 t): overflows for bold steps."""
    e = np.exp(x[1] * T)
    return x[0] * e - 3 * np.exp(0.3 * T), np.stack([e, x[0] * T * e], axis=1)


def in_units(function: Callable[[np.ndarray], Pair], unit: np.ndarray) -> Callable[[np.ndarray], Pair]:
    """The same problem with x measured in other units."""

    def changed(x: np.ndarray) -> Pair:
        r, J = function(x * unit)
        return r, J * unit

    return changed


def run(
    answer: ModuleType, function: Callable[[np.ndarray], Pair], start: list[float]
) -> tuple[np.ndarray, Counted]:
    problem = Counted(function)
    x = np.asarray(answer.solve(problem, np.array(start, dtype=float)), dtype=float)
    assert x.shape == (len(start),), f"the solution has the shape {x.shape}, the start has {(len(start),)}"
    assert np.isfinite(x).all(), f"the solution is {x}: a step to a point without a finite cost was taken"
    before, after = problem.cost(np.array(start)), problem.cost(x)
    assert after <= before * (1 + 1e-12), (
        f"the cost went from {before:.4g} up to {after:.4g}: J^T r is the way *up*"
    )
    return x, problem


def test_a_linear_problem_takes_a_few_steps(answer: ModuleType) -> None:
    rng = np.random.default_rng(1)
    A, y = rng.standard_normal((20, 3)), rng.standard_normal(20)
    x, problem = run(answer, lambda x: (A @ x - y, A), [5.0, -5.0, 5.0])
    exact = np.linalg.lstsq(A, y, rcond=None)[0]
    np.testing.assert_allclose(
        x, exact, rtol=1e-6, err_msg="a linear problem does not end at its closed form"
    )
    assert problem.calls <= 60, f"{problem.calls} evaluations: does the damping fall after a good step?"


def test_a_curved_valley(answer: ModuleType) -> None:
    x, problem = run(answer, rosenbrock, [-1.2, 1.0])
    np.testing.assert_allclose(x, [1.0, 1.0], atol=1e-5, err_msg="Rosenbrock's valley ends at (1, 1)")
    assert problem.calls <= 500, (
        f"{problem.calls} evaluations: this is gradient descent, not Levenberg-Marquardt"
    )


@pytest.mark.parametrize("unit", [[1e5, 1.0], [1.0, 1e-5], [1e-4, 1e4]])
def test_units_do_not_matter(answer: ModuleType, unit: list[float]) -> None:
    u = np.array(unit)
    x, problem = run(answer, in_units(rosenbrock, u), list(np.array([-1.2, 1.0]) / u))
    told = (
        f"in units of {unit} it ends at {x * u} after {problem.calls} evaluations: scale by the columns of J"
    )
    np.testing.assert_allclose(x * u, [1.0, 1.0], atol=1e-4, err_msg=told)


def test_an_overflow_is_a_step_to_refuse(answer: ModuleType) -> None:
    x, _ = run(answer, growth, [1e-6, 2.0])
    np.testing.assert_allclose(
        x, [3.0, 0.3], rtol=1e-4, err_msg="after a bold step into an overflow: turn back"
    )


def test_a_residual_that_cannot_vanish(answer: ModuleType) -> None:
    """Half of (x + 1)² + (x² + x - 1)² has the slope 2x³ + 3x²: a saddle at 0, the minimum at -1.5."""

    def function(x: np.ndarray) -> Pair:
        return np.array([x[0] + 1, x[0] ** 2 + x[0] - 1]), np.array([[1.0], [2 * x[0] + 1]])

    x, _ = run(answer, function, [-3.0])
    np.testing.assert_allclose(
        x, [-1.5], atol=1e-5, err_msg="the minimum lies at -1.5, with a cost that is not 0"
    )


def test_a_column_of_zeros(answer: ModuleType) -> None:
    def function(x: np.ndarray) -> Pair:
        return np.array([x[0] - 2.0, 2 * x[0] - 4.0]), np.array([[1.0, 0.0], [2.0, 0.0]])

    x, _ = run(answer, function, [0.0, 7.0])
    assert x[0] == pytest.approx(2.0, abs=1e-6), "the second unknown plays no part; the first is 2"
    assert x[1] == pytest.approx(7.0), "nothing is known of the second unknown: leave it where it was"


def test_it_starts_at_the_minimum(answer: ModuleType) -> None:
    x, _ = run(answer, rosenbrock, [1.0, 1.0])
    np.testing.assert_allclose(x, [1.0, 1.0])


def test_a_wrong_jacobian_does_no_harm(answer: ModuleType) -> None:
    """With the sign of J turned every step leads uphill: all must be refused (run checks the cost)."""
    run(answer, lambda x: (rosenbrock(x)[0], -rosenbrock(x)[1]), [-1.2, 1.0])
