"""The loop: closed forms, SciPy, one step by hand, reasons, and broken variants that miss the bound."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from vslam_ref.estimation.least_squares import (
    Ceres,
    Damping,
    Nielsen,
    Options,
    Undamped,
    covariance,
    damped_step,
    minimise,
    numeric_jacobian,
)
from vslam_ref.estimation.least_squares.damping import gain_factor
from vslam_ref.estimation.robust import Cauchy, Huber, Loss, Tukey

RULES: list[Damping] = [Nielsen(), Nielsen(scaling="columns"), Nielsen(scaling="none"), Ceres(), Undamped()]
IDS = ["more", "marquardt", "levenberg", "ceres", "gauss-newton"]


def rosenbrock(x: np.ndarray) -> np.ndarray:
    return np.stack([10 * (x[1] - x[0] ** 2), 1 - x[0]])


# --- one step -------------------------------------------------------------------------------


def test_one_gauss_newton_step_by_hand() -> None:
    """Rosenbrock at (-1, 0): r = (-10, 2), J = [[20, 10], [-1, 0]]; J step = -r gives step = (2, -3)."""
    first = minimise(rosenbrock, [-1.0, 0.0], options=Options(damping=Undamped(), max_iterations=1))
    np.testing.assert_allclose(first.x, [1.0, -3.0], rtol=1e-14)
    assert first.history[0].damping == 0.0


def test_one_damped_step_against_fifty_digits() -> None:
    x, lam = np.array([-1.2, 1.0]), 0.37
    jacobian, residual = numeric_jacobian(rosenbrock, x), rosenbrock(x)
    scale = np.array([3.0, 0.5])
    with mpmath.workdps(50):
        J, r = mpmath.matrix(jacobian.tolist()), mpmath.matrix(residual.tolist())
        D = mpmath.diag(scale.tolist())
        exact = mpmath.lu_solve(J.T * J + mpmath.mpf(lam) * D * D, -(J.T * r))
    # a 4 x 2 system with a condition below 1e2
    np.testing.assert_allclose(
        damped_step(jacobian, residual, lam, scale), [float(v) for v in exact], rtol=1e-13
    )


@given(st.integers(0, 10**6), st.floats(1e-8, 1e3))
def test_the_damped_step_solves_the_normal_equations(seed: int, lam: float) -> None:
    rng = np.random.default_rng(seed)
    jacobian, residual, scale = rng.standard_normal((7, 3)), rng.standard_normal(7), rng.uniform(0.5, 2.0, 3)
    step = damped_step(jacobian, residual, lam, scale)
    assert step is not None
    left = (jacobian.T @ jacobian + lam * np.diag(scale**2)) @ step
    np.testing.assert_allclose(left, -jacobian.T @ residual, atol=1e-12 * (1 + lam))


def test_damping_turns_the_step_towards_the_gradient_and_shortens_it() -> None:
    rng = np.random.default_rng(1)
    jacobian, residual, one = rng.standard_normal((6, 3)), rng.standard_normal(6), np.ones(3)
    steps = [damped_step(jacobian, residual, lam, one) for lam in (0.0, 1e-2, 1.0, 1e2, 1e8)]
    lengths = [float(np.linalg.norm(s)) for s in steps if s is not None]
    assert lengths == sorted(lengths, reverse=True)
    downhill = -jacobian.T @ residual
    last = steps[-1]
    assert last is not None
    assert last @ downhill / np.linalg.norm(last) / np.linalg.norm(downhill) == pytest.approx(1.0, abs=1e-6)


def test_the_gain_factor_is_nielsens() -> None:
    for gain in (-3.0, 0.0, 0.3, 0.5, 0.9, 1.0, 7.0):
        wanted = max(1 / 3, 1 - (2 * gain - 1) ** 3) if gain <= 1 else 1 / 3
        assert gain_factor(gain) == pytest.approx(wanted)


# --- whole runs -----------------------------------------------------------------------------


@pytest.mark.parametrize("rule", RULES, ids=IDS)
def test_linear_problems_end_at_the_closed_form(rule: Damping) -> None:
    rng = np.random.default_rng(2)
    A, y = rng.standard_normal((30, 4)) * [1.0, 1e3, 1e-3, 1.0], rng.standard_normal(30)
    found = minimise(lambda x: A @ x - y, np.zeros(4), options=Options(damping=rule, step=1e-15))
    exact = np.linalg.lstsq(A / np.linalg.norm(A, axis=0), y, rcond=None)[0] / np.linalg.norm(A, axis=0)
    np.testing.assert_allclose(found.x, exact, rtol=1e-9)
    assert found.converged
    if rule == Undamped():
        assert found.iterations <= 2  # the second finds nothing left to do
    matrix = found.covariance().matrix
    sigma2 = np.sum((A @ exact - y) ** 2) / 26
    np.testing.assert_allclose(matrix, sigma2 * np.linalg.inv(A.T @ A), rtol=1e-8)


@pytest.mark.parametrize("rule", RULES, ids=IDS)
def test_rosenbrock(rule: Damping) -> None:
    found = minimise(rosenbrock, [-1.2, 1.0], options=Options(damping=rule))
    np.testing.assert_allclose(found.x, [1.0, 1.0], rtol=1e-8)
    assert found.converged
    costs = [0.5 * float(np.sum(rosenbrock(np.array([-1.2, 1.0])) ** 2))] + [h.cost for h in found.history]
    if rule != Undamped():
        assert (np.diff(costs) <= 0.0).all()


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_random_problems_agree_with_scipy(seed: int) -> None:
    """A sum of two exponentials with noise, started near enough that the minimum is the same one."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 4.0, 40)
    truth = rng.uniform([1.0, 0.3, 1.0, 1.5], [3.0, 0.7, 3.0, 3.0])

    def model(b: np.ndarray) -> np.ndarray:
        return b[0] * np.exp(-b[1] * t) + b[2] * np.exp(-b[3] * t)

    y = model(truth) + rng.normal(0.0, 1e-3, 40)
    start = truth * rng.uniform(0.9, 1.1, 4)
    ours = minimise(lambda b: model(b) - y, start)
    theirs = least_squares(lambda b: model(b) - y, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
    assert ours.converged
    assert ours.cost <= theirs.cost * (1 + 1e-9)
    # two minimisers of one flat bowl: a cost equal to 1e-15 leaves 1e-7 of a standard deviation times 1e3
    np.testing.assert_allclose(ours.x, theirs.x, rtol=1e-4)


@pytest.mark.parametrize("loss", [Huber(0.3), Cauchy(0.3), Tukey(1.0)])
def test_robust_lines_are_stationary_and_scipys(loss: Loss) -> None:
    from vslam_ref.estimation.robust.conventions import scipy_loss

    rng = np.random.default_rng(4)
    A = np.stack([np.ones(60), np.linspace(-1, 1, 60)], axis=1)
    y = A @ [1.0, -2.0] + rng.normal(0.0, 0.1, 60)
    y[::6] += 4.0
    found = minimise(lambda b: A @ b - y, [1.2, -1.8], loss=loss)
    assert found.converged
    r = A @ found.x - y
    np.testing.assert_allclose(A.T @ loss.influence(r), 0.0, atol=1e-8 * 60)
    assert found.cost == pytest.approx(loss.cost(r).sum(), rel=1e-14)
    theirs = least_squares(
        lambda b: A @ b - y, found.x, loss=scipy_loss(loss), xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    np.testing.assert_allclose(found.x, theirs.x, atol=1e-7)
    plain = minimise(lambda b: A @ b - y, [1.2, -1.8])
    assert abs(plain.x[0] - 1.0) > 5 * abs(found.x[0] - 1.0)  # without a loss the outliers have their way


def test_on_a_linear_residual_the_reweighted_model_promises_less_than_it_wins() -> None:
    """The weighted square lies above the loss, so every gain is at least 1."""
    rng = np.random.default_rng(5)
    A, y = rng.standard_normal((50, 3)), rng.standard_cauchy(50)
    found = minimise(lambda b: A @ b - y, np.zeros(3), loss=Tukey(4.0))
    gains = [h.gain for h in found.history if h.accepted and not math.isnan(h.gain)]
    assert len(gains) > 3
    assert min(gains) > 1 - 1e-6


def test_a_loss_on_blocks_sees_norms() -> None:
    """A plane point, ten sightings, two of them wrong: the loss of the norm turns with the axes."""
    rng = np.random.default_rng(6)
    z = rng.normal(0.0, 1.0, (10, 2))
    z[:2] += 30.0
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    found = [
        minimise(lambda x, q=q: (x - z @ q.T).ravel(), q @ [1.0, 1.0], loss=Tukey(5.0), block=2).x
        for q in (np.eye(2), turn)
    ]
    np.testing.assert_allclose(turn @ found[0], found[1], atol=1e-9)
    each = [
        minimise(lambda x, q=q: (x - z @ q.T).ravel(), q @ [1.0, 1.0], loss=Tukey(2.0)).x
        for q in (np.eye(2), turn)
    ]
    assert np.abs(turn @ each[0] - each[1]).max() > 1e-3  # a loss of single coordinates does not


def test_steps_on_a_circle_by_plus() -> None:
    """An angle as a unit vector: steps are angles, added by a rotation."""
    target = np.array([math.cos(2.5), math.sin(2.5)])

    def plus(x: np.ndarray, step: np.ndarray) -> np.ndarray:
        c, s = math.cos(step[0]), math.sin(step[0])
        return np.array([c * x[0] - s * x[1], s * x[0] + c * x[1]])

    found = minimise(lambda x: x - target, [1.0, 0.0], plus=plus, coordinates=1)
    np.testing.assert_allclose(found.x, target, atol=1e-9)
    assert found.jacobian.shape == (2, 1)


# --- reasons --------------------------------------------------------------------------------


def test_every_reason_can_be_had() -> None:
    def exponential(x: np.ndarray) -> np.ndarray:
        return np.stack([np.exp(-x[0])])

    def nan(x: np.ndarray) -> np.ndarray:
        return np.full(2, np.nan)

    def wrong(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return x - 1.0, -np.eye(2)

    both = np.array([[1.0, 1.0], [2.0, 2.0]])
    # steps win 1e-2, 2e-4, 5e-6 and 1e-7 of the cost, the gradient falls by 6 each time: no rounding decides
    coarse = Options(gradient=0.0, step=0.0, cost=1e-6)
    cases = {
        "gradient": minimise(
            lambda x: np.stack([x[0] - 1.0, 2 * x[0], x[0] ** 2]), [1.0], options=Options(gradient=1e-4)
        ),
        "step": minimise(exponential, [30.0], options=Options(step=0.5)),
        "cost": minimise(lambda x: np.stack([x[0] ** 2 - 1.0, x[0] + 3.0]), [1.0], options=coarse),
        "max_iterations": minimise(rosenbrock, [-1.2, 1.0], options=Options(max_iterations=3)),
        "stalled": minimise(lambda x: x - 1.0, np.zeros(2), with_jacobian=wrong),
        "singular": minimise(
            lambda x: both @ x - [1.0, 0.0], np.zeros(2), options=Options(damping=Undamped())
        ),
        "not_finite": minimise(nan, np.zeros(2)),
        "no_residuals": minimise(lambda x: np.zeros(0), np.zeros(2)),
    }
    assert {name: found.reason for name, found in cases.items()} == {name: name for name in cases}
    for found in cases.values():
        assert found.message
        assert np.isfinite(found.x).all()
        assert not math.isnan(found.cost)
    assert [n for n, found in cases.items() if found.converged] == ["gradient", "step", "cost"]
    assert cases["max_iterations"].iterations == 3


def test_without_thresholds_it_ends_where_rounding_does() -> None:
    """Which of the two reasons is had there is chosen by the last bit of the processor's sums."""
    found = minimise(
        lambda x: np.stack([x[0] ** 2 - 1.0, x[0] + 3.0]), [1.0], options=Options(gradient=0.0, step=0.0)
    )
    assert found.reason in ("cost", "gradient")
    assert found.history[-1].gradient_norm < 1e-14  # eps times the ten operations of two rows, and margin


def test_a_rank_deficient_problem_is_solved_damped_and_has_no_covariance() -> None:
    both = np.array([[1.0, 1.0], [2.0, 2.0], [1.0, 1.0]])
    found = minimise(lambda x: both @ x - [1.0, 2.0, 1.5], np.zeros(2))
    assert found.converged
    assert found.x[0] == pytest.approx(found.x[1])  # the damped step stays in the row space
    told = found.covariance()
    assert told.matrix is None
    assert told.rank == 1
    assert "rank 1 of 2" in told.reason
    assert covariance(np.eye(2), np.zeros(2)).reason == "2 residuals for 2 parameters: the noise is unknown"


def test_an_overflow_on_the_way_is_a_refused_step() -> None:
    t = np.linspace(0.0, 10.0, 20)
    y = 3.0 * np.exp(0.3 * t)
    found = minimise(lambda b: b[0] * np.exp(b[1] * t) - y, [1e-6, 2.0])
    np.testing.assert_allclose(found.x, [3.0, 0.3], rtol=1e-6)
    bold = minimise(lambda b: np.stack([np.exp(b[0] ** 3), b[0]]), [6.0], options=Options(damping=Undamped()))
    assert np.isfinite(bold.x).all()


def test_broken_solvers_miss_the_minimum() -> None:
    """Exact Jacobian against its negative, its transpose and no damping, on a square problem."""
    M = np.array([[2.0, 1.0], [-3.0, 0.5]])

    def residual(x: np.ndarray) -> np.ndarray:
        return np.arctan(M @ x) * 3 - [0.5, -1.0]

    def jacobian(x: np.ndarray) -> np.ndarray:
        return (3 / (1 + (M @ x) ** 2))[:, None] * M

    exact = np.linalg.solve(M, np.tan([0.5 / 3, -1.0 / 3]))
    start = [1.0, 2.0]
    right = minimise(residual, start, with_jacobian=lambda x: (residual(x), jacobian(x)))
    np.testing.assert_allclose(right.x, exact, atol=1e-9)
    for broken in (lambda x: -jacobian(x), lambda x: jacobian(x).T):
        found = minimise(residual, start, with_jacobian=lambda x, b=broken: (residual(x), b(x)))
        assert np.abs(found.x - exact).max() > 1e-3
    undamped = minimise(
        residual,
        start,
        with_jacobian=lambda x: (residual(x), jacobian(x)),
        options=Options(damping=Undamped()),
    )
    assert np.abs(undamped.x - exact).max() > 1e-3


def test_covariances_are_those_of_repeated_experiments() -> None:
    """2000 repetitions: a variance is known to 1/sqrt(1000); 4 of these."""
    rng = np.random.default_rng(8)
    t, truth, sigma = np.linspace(0, 3, 15), np.array([2.0, 0.8]), 0.02

    def model(b: np.ndarray) -> np.ndarray:
        return b[0] * np.exp(-b[1] * t)

    clean = model(truth)
    found = np.array(
        [minimise(lambda b, y=clean + e: model(b) - y, truth).x for e in rng.normal(0, sigma, (2000, 15))]
    )
    matrix = minimise(lambda b: model(b) - clean, truth).covariance(sigma).matrix
    assert matrix is not None
    np.testing.assert_allclose(np.diag(np.cov(found.T)), np.diag(matrix), rtol=4 / math.sqrt(1000))


def test_a_numeric_jacobian_by_differences() -> None:
    """A function that drops imaginary parts: central differences, ten digits."""

    def real(x: np.ndarray) -> np.ndarray:
        return np.array([math.sin(float(x[0])) * float(x[1]), float(x[1]) ** 2])

    found = numeric_jacobian(real, np.array([0.7, 3.0]))
    np.testing.assert_allclose(found, [[3 * math.cos(0.7), math.sin(0.7)], [0.0, 6.0]], atol=1e-9)


# --- bad input ------------------------------------------------------------------------------


def test_bad_input_is_refused() -> None:
    with pytest.raises(ValueError, match="must be finite"):
        minimise(rosenbrock, [math.nan, 1.0])
    with pytest.raises(ValueError, match=r"residual \(3,\): need \(m,\) with m a multiple of 2"):
        minimise(lambda x: np.zeros(3), [1.0], block=2)
    with pytest.raises(ValueError, match=r"Jacobian \(1, 2\): need"):
        minimise(rosenbrock, [1.0, 1.0], with_jacobian=lambda x: (rosenbrock(x), np.ones((1, 2))))
    with pytest.raises(ValueError, match="a threshold must lie in"):
        Options(gradient=-1.0)
    with pytest.raises(ValueError, match="max_iterations=-1"):
        Options(max_iterations=-1)
    with pytest.raises(ValueError, match=r"need \(m, n\) and \(m,\)"):
        covariance(np.eye(2), np.zeros(3))
