"""The public checks: each accepts what is right, refuses what is wrong, and says where."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from vslam_ref.geometry import se2, so2
from vslam_ref.testing import assert_consistent, assert_group_axioms, check_jacobian

A = np.array([[1.0, -2.0, 0.5], [3.0, 0.1, -1.0]])
X = np.array([0.7, -1.3, 2.1])


def curved(x: Any) -> Any:
    return np.stack([np.sin(x[0]) * x[1], np.exp(0.3 * x[2]) - x[0] ** 3])


def slope(x: np.ndarray) -> np.ndarray:
    return np.array(
        [[np.cos(x[0]) * x[1], np.sin(x[0]), 0.0], [-3 * x[0] ** 2, 0.0, 0.3 * np.exp(0.3 * x[2])]]
    )


@pytest.mark.parametrize("method", ["complex", "central", "auto"])
@given(x=st.tuples(*[st.floats(-5, 5)] * 3))
def test_right_jacobian_is_accepted_everywhere(method: str, x: Any) -> None:
    check = check_jacobian(curved, x, slope(np.array(x)), method=method)
    assert check.worst <= 1
    assert check.method == ("central" if method == "central" else "complex")


@pytest.mark.parametrize("method", ["complex", "central"])
@pytest.mark.parametrize(("i", "j"), [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)])
def test_an_error_of_one_in_a_billion_is_found_where_it_is(method: str, i: int, j: int) -> None:
    J = slope(X)
    J[i, j] += 1e-9 * np.abs(J).max()
    with pytest.raises(AssertionError, match=rf"entry \[{i}, {j}\]"):
        check_jacobian(curved, X, J, method=method)


def test_complex_step_is_not_used_where_complex_numbers_are_dropped() -> None:
    """A conversion to float would make the derivative zero; it is noticed, also when only a warning tells."""

    def to_float(x: Any) -> np.ndarray:
        return curved(np.asarray(x, dtype=np.float64))

    assert check_jacobian(to_float, X, slope(X)).method == "central"
    assert check_jacobian(lambda x: curved(np.abs(x)), np.abs(X), slope(np.abs(X))).method == "central"
    with pytest.raises(ValueError, match="complex"):
        check_jacobian(to_float, X, slope(X), method="complex")


def test_angles_need_a_difference_on_the_circle() -> None:
    def heading(x: np.ndarray) -> np.ndarray:
        return so2.wrap(x[:1] * 1.5)

    at = np.array([np.pi / 1.5])
    assert check_jacobian(heading, at, [[1.5]], difference=lambda a, b: so2.wrap(a - b)).worst <= 1
    with pytest.raises(AssertionError):
        check_jacobian(heading, at, [[1.5]])


def test_a_kink_is_not_judged() -> None:
    with pytest.raises(AssertionError, match="no sharp numeric derivative"):
        check_jacobian(lambda x: np.maximum(np.asarray(x, dtype=float), 0.001), np.array([0.0]), [[0.5]])


def test_nan_is_a_failure_not_a_pass() -> None:
    with pytest.raises(AssertionError):
        check_jacobian(curved, X, np.full((2, 3), np.nan))


@pytest.mark.parametrize(
    ("at", "J", "method", "told"),
    [
        (X[None], slope(X), "auto", "need"),
        (X, slope(X).T, "auto", "need"),
        (X, slope(X)[:1], "auto", "returns 2"),
        (X, slope(X), "forward", "method="),
    ],
)
def test_misuse_of_check_jacobian_is_told(at: Any, J: Any, method: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        check_jacobian(curved, at, J, method=method)


# --- consistency --------------------------------------------------------------------------------------


def test_band_is_two_sided_with_the_stated_rate() -> None:
    """Oracle: SciPy's chi2 quantiles; and the share of false alarms in 4000 experiments, 4 sigma."""
    check = assert_consistent(np.full(50, 3.0), dof=3, false_alarm=0.05)
    assert np.allclose([check.lower, check.upper], chi2.ppf([0.025, 0.975], 150) / 50, rtol=1e-12)
    rng, alarms, rate = np.random.default_rng(0), 0, 0.05
    for _ in range(4000):
        try:
            assert_consistent(rng.chisquare(3, 20), dof=3, false_alarm=rate)
        except AssertionError:
            alarms += 1
    assert abs(alarms / 4000 - rate) < 4 * np.sqrt(rate * (1 - rate) / 4000)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_too_sure_and_too_shy_are_both_refused(factor: float) -> None:
    honest = np.random.default_rng(1).chisquare(3, 200)
    assert_consistent(honest, dof=3)
    with pytest.raises(AssertionError, match="outside"):
        assert_consistent(factor * honest, dof=3)


def test_misuse_of_assert_consistent_is_told() -> None:
    with pytest.raises(ValueError, match="one value per independent run"):
        assert_consistent(np.ones((50, 1600)), dof=3)
    with pytest.raises(ValueError, match="false_alarm"):
        assert_consistent(np.ones(50), dof=3, false_alarm=0.0)
    with pytest.raises(AssertionError, match="not finite"):
        assert_consistent([3.0, np.nan], dof=3)


# --- groups -------------------------------------------------------------------------------------------


def test_a_group_without_exp_and_adjoint_is_checked_for_the_rest() -> None:
    """The positive diagonal matrices of size 1, written as their entry."""
    group = SimpleNamespace(
        identity=lambda shape: np.ones((*shape, 1)),
        compose=lambda a, b: a * b,
        inverse=lambda a: 1 / a,
        matrix=lambda a: a[..., None],
    )
    samples = np.array([[0.5], [3.0], [7.0]])
    assert assert_group_axioms(group, samples) <= 1
    group.inverse = lambda a: -a
    with pytest.raises(AssertionError, match="left inverse"):
        assert_group_axioms(group, samples)


def test_group_check_reports_the_axiom() -> None:
    names = ("identity", "matrix", "inverse", "exp", "log", "adjoint")
    group = SimpleNamespace(**{n: getattr(se2, n) for n in names}, compose=lambda a, b: np.add(a, b))
    with pytest.raises(AssertionError, match="homomorphism fails for pair 1"):
        assert_group_axioms(group, [[0.0, 0.0, 0.4], [1.0, 2.0, 0.5]])
