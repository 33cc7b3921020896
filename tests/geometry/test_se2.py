"""SE(2) against matrix exponentials at 50 digits, on both sides of every series threshold and near pi."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm, logm

from vslam_ref.geometry import se2
from vslam_ref.testing import assert_group_axioms, check_jacobian

EPS = float(np.finfo(float).eps)
mpmath.mp.dps = 50

# around the thresholds 0.05 (sinc), 0.1 (its half-angle uses), 0.5 (Jacobian tail), and the ends
EDGES = [0.0, 5e-324, 1e-200, 1e-12, 1e-8, 1e-4, 0.05, 0.1, 0.5, 1.0, 2.0, 3.0, np.pi - 1e-9, np.pi - 1e-3]
PHIS = sorted({s * v for e in EDGES for v in (e, np.nextafter(e, 9), np.nextafter(e, 0)) for s in (1, -1)})
RHO = np.array([1.3, -2.1])
POSES = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-np.pi, np.pi, exclude_min=True))


def hat(xi: Any) -> Any:
    return mpmath.matrix([[0, -xi[2], xi[0]], [xi[2], 0, xi[1]], [0, 0, 0]])


def exact_exp(xi: Any) -> np.ndarray:
    """Matrix exponential at 50 digits, shape (3, 3)."""
    return np.array(mpmath.expm(hat([mpmath.mpf(float(v)) for v in xi])).tolist(), dtype=float)


def ad(xi: Any) -> Any:
    """d/dt of Ad of Exp(t xi) at 0, tangent order (rho, phi), as a 50-digit matrix."""
    x, y, w = (mpmath.mpf(float(v)) for v in xi)
    return mpmath.matrix([[0, -w, y], [w, 0, -x], [0, 0, 0]])


def exact_left_jacobian(xi: Any) -> np.ndarray:
    """J_l = sum of ad^k / (k + 1)!, the upper right block of an exponential of [[ad, I], [0, 0]]."""
    M = mpmath.zeros(6)
    M[:3, :3], M[:3, 3:] = ad(xi), mpmath.eye(3)
    return np.array(mpmath.expm(M)[:3, 3:].tolist(), dtype=float)


@pytest.mark.parametrize("phi", PHIS)
def test_exp_is_the_matrix_exponential(phi: float) -> None:
    xi = np.array([*RHO, phi])
    # sinc and cosc to 2 eps, two products and a sum of numbers below 2.1
    assert np.abs(se2.matrix(se2.exp(xi)) - exact_exp(xi)).max() < 8 * EPS * 2.1


@pytest.mark.parametrize("phi", PHIS)
def test_left_jacobian_is_its_series(phi: float) -> None:
    """k1 = (phi - sin phi)/phi^2 loses 1/phi^2 = 4 just above 0.5: 6 eps of 4 times 0.08."""
    xi = np.array([*RHO, phi])
    assert np.abs(se2.left_jacobian(xi) - exact_left_jacobian(xi)).max() < 16 * EPS * 2.1


@pytest.mark.parametrize(
    "phi", [1e-9, 0.02, 0.049, 0.051, 0.3, 0.45, np.nextafter(0.5, 0), 0.5, 0.55, 1.0, 2.5]
)
def test_left_jacobian_tail_keeps_its_digits(phi: float) -> None:
    """With rho = (1, 0) the last column is (k1, -k2): a relative error, which a lost series term would show.

    The series cost 4 eps; above 0.5 the difference phi - sin phi has lost 6 / phi^2 of them.
    """
    J = se2.left_jacobian([1.0, 0.0, phi])
    p = mpmath.mpf(phi)
    k1, k2 = (p - mpmath.sin(p)) / p**2, (1 - mpmath.cos(p)) / p**2
    assert abs(J[0, 2] / k1 - 1) < (4 if phi < 0.5 else 4 + 6 / phi**2) * EPS
    assert abs(-J[1, 2] / k2 - 1) < 4 * EPS


@pytest.mark.parametrize("phi", PHIS)
def test_left_jacobian_inverse(phi: float) -> None:
    """The condition of J_l stays below 30 for |rho| < 3 and |phi| < pi."""
    xi = np.array([*RHO, phi])
    exact = np.linalg.inv(exact_left_jacobian(xi))
    assert np.linalg.cond(exact) < 30
    assert np.abs(se2.left_jacobian_inverse(xi) - exact).max() < 30 * 16 * EPS


@pytest.mark.parametrize("phi", PHIS)
def test_log_undoes_exp(phi: float) -> None:
    """t -> rho: V^-1 has norm 1 at 0 and pi/2 at pi."""
    xi = np.array([*RHO, phi])
    assert np.abs(se2.log(se2.exp(xi)) - xi).max() < 16 * EPS * 2.1 * np.pi / 2


def test_log_is_scipys() -> None:
    pose = np.array([1.0, -2.0, 1.1])
    L = logm(se2.matrix(pose)).real
    assert np.abs(se2.log(pose) - [L[0, 2], L[1, 2], L[1, 0]]).max() < 1e-13  # logm's own accuracy


@pytest.mark.parametrize("half_turn", [np.pi, -np.pi])
def test_log_at_half_a_turn(half_turn: float) -> None:
    """At pi, V = (2/pi) [[0, -1], [1, 0]]: rho is t, turned back by 90 degrees and times pi/2."""
    xi = se2.log([1.0, 2.0, half_turn])
    assert np.abs(xi - [np.pi, -np.pi / 2, np.pi]).max() < 8 * EPS * np.pi


@given(POSES, POSES)
def test_compose_and_inverse_are_matrix_products(a: Any, b: Any) -> None:
    A, B = se2.matrix(a), se2.matrix(b)
    tolerance = 16 * EPS * (1 + np.hypot(a[0], a[1]) + np.hypot(b[0], b[1]))
    assert np.abs(se2.matrix(se2.compose(a, b)) - A @ B).max() <= tolerance
    assert np.abs(se2.matrix(se2.inverse(a)) @ A - np.eye(3)).max() <= tolerance
    assert np.abs(se2.matrix(se2.between(a, b)) - np.linalg.solve(A, B)).max() <= 4 * tolerance
    assert -np.pi < se2.compose(a, b)[2] <= np.pi


@given(POSES, st.floats(-9, 9), st.floats(-9, 9))
def test_act_is_the_homogeneous_product(a: Any, x: float, y: float) -> None:
    assert np.abs(se2.act(a, [x, y]) - (se2.matrix(a) @ [x, y, 1])[:2]).max() <= 8 * EPS * (
        150 + abs(x) + abs(y)
    )


@given(POSES, st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3)))
def test_adjoint_moves_a_tangent_vector_to_the_other_side(a: Any, xi: Any) -> None:
    """T hat(xi) T^-1 = hat(Ad xi): exact, no exponential needed."""
    T = se2.matrix(a)
    moved = T @ np.array(hat(xi).tolist(), dtype=float) @ np.linalg.inv(T)
    Ad_xi = se2.adjoint(a) @ np.array(xi)
    size = 1 + np.hypot(a[0], a[1])
    assert np.abs(moved - np.array(hat(Ad_xi).tolist(), dtype=float)).max() <= 64 * EPS * size * 5


def test_group_axioms_of_near_identity_generic_and_half_turn_samples() -> None:
    rng = np.random.default_rng(0)
    samples = np.concatenate(
        [
            rng.normal(0, 1e-9, (6, 3)),
            np.column_stack([rng.normal(0, 20, (6, 2)), rng.uniform(-np.pi, np.pi, 6)]),
            np.column_stack([rng.normal(0, 2, (4, 2)), [np.pi, np.nextafter(np.pi, 0), 0.05, -0.5]]),
        ]
    )
    assert assert_group_axioms(se2, samples) <= 1


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("compose", lambda a, b: se2.compose(b, a)),
        ("inverse", lambda a: -np.asarray(a)),
        ("adjoint", lambda a: np.swapaxes(se2.adjoint(a), -1, -2)),
        ("exp", lambda xi: np.asarray(xi)),
        ("identity", lambda shape=(): se2.identity(shape) + 1e-9),
    ],
)
def test_a_wrong_group_is_found(name: str, wrong: Callable[..., Any]) -> None:
    names = ("identity", "matrix", "compose", "inverse", "exp", "log", "adjoint")
    group = SimpleNamespace(**{n: getattr(se2, n) for n in names})
    setattr(group, name, wrong)
    with pytest.raises(AssertionError, match="fails for pair"):
        assert_group_axioms(group, [[1.0, 2.0, 0.5], [-0.3, 0.1, -2.0]])


@pytest.mark.parametrize("phi", [0.01, 0.3, -1.2, 3.0])
def test_left_jacobian_is_left_and_the_derivative_of_exp(phi: float) -> None:
    """Exp(xi + d) = Exp(J_l d) Exp(xi): by differences; the right Jacobian, J_l(-xi), is refused."""
    xi = np.array([*RHO, phi])

    def moved(v: np.ndarray) -> np.ndarray:
        return se2.log(se2.compose(se2.exp(v), se2.inverse(se2.exp(xi))))

    check_jacobian(moved, xi, se2.left_jacobian(xi))
    with pytest.raises(AssertionError, match="Jacobian entry"):
        check_jacobian(moved, xi, se2.left_jacobian(-xi))


@pytest.mark.parametrize("fraction", [0.0, 0.25, 0.5, 1.0])
def test_interpolation_is_constant_velocity(fraction: float) -> None:
    a, b = np.array([1.0, -2.0, 2.8]), np.array([-3.0, 1.0, -2.5])  # the short way crosses pi
    velocity = logm(np.linalg.solve(se2.matrix(a), se2.matrix(b)))
    expected = se2.matrix(a) @ expm(fraction * velocity)
    assert (
        np.abs(se2.matrix(se2.interpolate(a, b, fraction)) - expected.real).max() < 1e-13
    )  # logm's accuracy


@pytest.mark.parametrize("batch", [(), (1,), (3, 1, 2)])
def test_batches_are_the_single_results(batch: tuple[int, ...]) -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(*batch, 3)), rng.normal(size=(*batch, 3))
    x, f = rng.normal(size=(*batch, 2)), rng.uniform(size=batch)
    cases = {
        "matrix": (a,), "compose": (a, b), "inverse": (a,), "between": (a, b), "act": (a, x), "exp": (a,),
        "log": (a,), "adjoint": (a,), "left_jacobian": (a,), "left_jacobian_inverse": (a,),
        "interpolate": (a, b, f),
    }  # fmt: skip
    for name, arguments in cases.items():
        function = getattr(se2, name)
        many = function(*arguments)
        assert many.shape[: len(batch)] == batch
        for i in np.ndindex(batch):
            # vectorised and scalar sine may differ in the last bit
            assert np.abs(many[i] - function(*(v[i] for v in arguments))).max() <= 32 * EPS
    assert se2.identity(batch).shape == (*batch, 3)
