"""NIST's certified regressions: digits from both starts, deviations, and broken solvers that miss them."""

from __future__ import annotations

from typing import NamedTuple

import mpmath
import numpy as np
import pytest

from vslam_ref.datasets import catalogue, nist
from vslam_ref.datasets.nist_models import MODELS
from vslam_ref.estimation.least_squares import Ceres, Damping, Nielsen, Options, Solution, Undamped, minimise

FOLDER = catalogue.find("nist_nls")
needs_data = pytest.mark.skipif(FOLDER is None, reason="nist_nls is not in VSLAM_REF_DATA")

# As far as doubles go: the last digits are those of rounding, not of a threshold.
TIGHT = {"gradient": 1e-15, "step": 1e-15, "cost": 0.0, "max_iterations": 2000}


class Regression(NamedTuple):
    """A problem and its residuals."""

    problem: nist.NistProblem
    y: np.ndarray

    def __call__(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, jacobian = MODELS[self.problem.name](b, self.problem.x)
        return value - self.y, jacobian


def regression(name: str) -> Regression:
    assert FOLDER is not None
    problem = nist.read_problem(FOLDER / f"{name}.dat")
    return Regression(problem, np.log(problem.y) if name == "Nelson" else problem.y)


def fit(r: Regression, start: int, damping: Damping | None = None, *, numeric: bool = False) -> Solution:
    options = Options(damping=damping or Nielsen(), **TIGHT)
    return minimise(
        lambda b: r(b)[0], r.problem.starts[start], with_jacobian=None if numeric else r, options=options
    )


def digits(found: np.ndarray, certified: np.ndarray) -> float:
    """Log relative error of the worst parameter, at most the eleven digits that NIST gives."""
    error = np.max(np.abs(found - certified) / np.abs(certified))
    return float(-np.log10(max(error, 1e-11)))


def test_digits_counts_the_worst_parameter() -> None:
    assert digits(np.array([1.001, 2.0]), np.array([1.0, 2.0])) == pytest.approx(3.0)


@needs_data
@pytest.mark.parametrize("damping", [Nielsen(), Ceres()], ids=["nielsen", "ceres"])
@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("name", list(MODELS))
def test_certified_digits(name: str, start: int, damping: Damping) -> None:
    """Conditions of J, columns scaled, reach 1e4: of sixteen digits twelve, less some dozens of roundings."""
    r = regression(name)
    found = fit(r, start, damping)
    assert found.converged, found.message
    assert digits(found.x, r.problem.certified) >= 8.0, found.message
    # Lanczos1 is an exact fit to the data's own rounding: its sum of squares, 1e-25, is that of roundings
    rss = 2 * found.cost
    tolerance = 0.02 if name == "Lanczos1" else 1e-9
    assert rss == pytest.approx(r.problem.residual_sum_of_squares, rel=tolerance)
    covariance = found.covariance()
    assert covariance.matrix is not None, covariance.reason
    assert covariance.sigma == pytest.approx(r.problem.residual_deviation, rel=tolerance)
    np.testing.assert_allclose(
        np.sqrt(np.diag(covariance.matrix)), r.problem.deviations, rtol=max(tolerance, 1e-6)
    )


@needs_data
@pytest.mark.parametrize("name", list(MODELS))
def test_the_default_options_give_six_digits(name: str) -> None:
    r = regression(name)
    for start in r.problem.starts:
        found = minimise(lambda b: r(b)[0], start, with_jacobian=r)
        assert found.converged, found.message
        assert digits(found.x, r.problem.certified) >= 6.0, found.message


@needs_data
@pytest.mark.parametrize("name", ["Misra1a", "Hahn1", "Nelson", "Lanczos3", "Gauss1"])
def test_a_numeric_jacobian_is_as_good(name: str) -> None:
    """The models keep complex numbers, so the complex step is exact to rounding."""
    r = regression(name)
    assert digits(fit(r, 1, numeric=True).x, r.problem.certified) >= 8.0


@needs_data
@pytest.mark.parametrize("name", list(MODELS))
def test_jacobians_of_the_models(name: str) -> None:
    r = regression(name)
    b = r.problem.certified * (1 + 0.1 * np.cos(np.arange(len(r.problem.certified))))
    x = r.problem.x[::7]
    jacobian = MODELS[name](b, x).jacobian
    for j in range(len(b)):
        step = b.astype(complex)
        step[j] += 1e-100j
        column = MODELS[name](step, x).value.imag / 1e-100  # type: ignore[arg-type]
        # a few dozen roundings
        np.testing.assert_allclose(jacobian[:, j], column, rtol=1e-12, atol=1e-13 * np.abs(column).max())


@needs_data
def test_broken_solvers_miss_the_digits() -> None:
    """A gradient of the wrong sign, a Jacobian with two columns exchanged, no damping, no scaling."""
    r = regression("MGH17")
    certified = r.problem.certified

    def wrong_sign(b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, jacobian = r(b)
        return value, -jacobian

    def exchanged(b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, jacobian = r(b)
        return value, jacobian[:, [0, 2, 1, 3, 4]]

    for broken in (wrong_sign, exchanged):
        found = minimise(
            lambda b: r(b)[0], r.problem.starts[1], with_jacobian=broken, options=Options(**TIGHT)
        )
        assert digits(found.x, certified) < 2.0
    gauss_newton = fit(r, 0, Undamped())
    assert gauss_newton.reason in ("singular", "not_finite", "max_iterations")
    assert not gauss_newton.converged
    # Marquardt's scale of the moment follows the rates' columns down to nothing and ends with exponentials
    # that have died away: a rank of 2, and a covariance that says so
    vanished = fit(r, 0, Nielsen(scaling="columns"))
    assert digits(vanished.x, certified) < 2.0
    assert "rank" in vanished.covariance().reason


@needs_data
def test_normal_equations_lose_digits_that_qr_keeps() -> None:
    """One Gauss-Newton step on Lanczos3: in normal equations the condition of J counts twice."""
    r = regression("Lanczos3")
    b = r.problem.certified * (1 + 1e-3)
    residual, jacobian = r(b)
    with mpmath.workdps(60):
        J = mpmath.matrix(jacobian.tolist())
        rhs = mpmath.matrix(residual.tolist())
        exact = np.array([float(v) for v in mpmath.lu_solve(J.T * J, -(J.T * rhs))])
    q, upper = np.linalg.qr(jacobian)
    by_qr = -np.linalg.solve(upper, q.T @ residual)
    by_normal = -np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ residual)
    assert digits(by_qr, exact) > 9.0
    assert digits(by_normal, exact) < digits(by_qr, exact) - 2.0
