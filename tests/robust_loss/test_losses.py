"""Losses: each derived quantity is the derivative of the cost, exactly at 0, at c, and for any constant."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import quad

from vslam_ref.estimation.robust import L2, LOSSES, Cauchy, GemanMcClure, Huber, Loss, Tukey, tuned

ALL = [cls(c) for cls in LOSSES.values() for c in (0.3, 1.0, 4.6851, 120.0)]
ROBUST = [loss for loss in ALL if not isinstance(loss, L2)]
NAMES = [f"{type(loss).__name__}-{loss.c}" for loss in ALL]
EPS = float(np.finfo(float).eps)


def grid(loss: Loss) -> np.ndarray:
    """Residuals inside, near and outside c, away from the one point where Huber bends."""
    inner = np.array([1e-9, 1e-3, 0.2, 0.5, 1 / math.sqrt(3), 0.9, 0.999])
    return loss.c * np.concatenate([-inner, [0.0], inner, [1.001, 1.5, 7.0, 1e4]])


@pytest.mark.parametrize("loss", ALL, ids=NAMES)
def test_the_cost_is_the_integral_of_the_influence(loss: Loss) -> None:
    # quad is asked for 1e-12; the cost is a sum of a few products, each with one rounding
    for x in (0.4 * loss.c, 0.99 * loss.c, 3.0 * loss.c):
        area = quad(lambda t: loss.influence(t).item(), 0.0, x, points=[min(x, loss.c)], epsrel=1e-12)[0]
        np.testing.assert_allclose(loss.cost(x), area, rtol=1e-11)


@pytest.mark.parametrize("loss", ALL, ids=NAMES)
def test_influence_and_curvature_are_derivatives(loss: Loss) -> None:
    t, h = grid(loss) / loss.c, 1e-3
    t = t[(np.abs(np.abs(t) - 1) > 2 * h) & (np.abs(t) < 10)]

    def slope(f: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Two central differences, extrapolated: truncation 100 h^4 at most, rounding 1e-16 / h."""
        once = [(f(loss.c * (t + k)) - f(loss.c * (t - k))) / (2 * k * loss.c) for k in (h, h / 2)]
        return (4 * once[1] - once[0]) / 3

    np.testing.assert_allclose(loss.influence(loss.c * t) / loss.c, slope(loss.cost) / loss.c, atol=1e-9)
    np.testing.assert_allclose(loss.curvature(loss.c * t), slope(loss.influence), atol=1e-9)


@pytest.mark.parametrize("loss", ALL, ids=NAMES)
def test_the_weight_slope_is_the_derivative_in_the_square(loss: Loss) -> None:
    s = np.array([0.0, 0.25, 4.0]) * loss.c**2
    h = 1e-4 * loss.c**2
    forward = [(loss.weight(np.sqrt(s + k * h)) - loss.weight(np.sqrt(s))) / (k * h) for k in (1, 2)]
    # 2 D(h) - D(2h) is off by w''' h^2 < 20 (h/c^2)^2 / c^2, in units of 1 / c^2
    np.testing.assert_allclose(
        loss.weight_slope(np.sqrt(s)), 2 * forward[0] - forward[1], atol=1e-6 / loss.c**2
    )


@pytest.mark.parametrize("loss", ALL, ids=NAMES)
def test_at_zero_every_loss_is_half_a_square(loss: Loss) -> None:
    assert loss.cost(0.0) == 0.0
    assert loss.influence(0.0) == 0.0
    assert loss.weight(0.0) == loss.sqrt_weight(0.0) == loss.curvature(0.0) == 1.0
    tiny = 1e-9 * loss.c
    # the next term is 1e-18 of this; a form like 1 - (1 - u)^3 would be all noise
    np.testing.assert_allclose(loss.cost(tiny), tiny**2 / 2, rtol=4 * EPS)


EXACT = {
    "huber": lambda x, c: x * x / 2 if x <= c else c * (x - c / 2),
    "cauchy": lambda x, c: c**2 / 2 * mpmath.log(1 + (x / c) ** 2),
    "geman-mcclure": lambda x, c: c**2 / 2 * x**2 / (c**2 + x**2),
    "tukey": lambda x, c: c**2 / 6 * (1 - (1 - (x / c) ** 2) ** 3) if x <= c else c**2 / 6,
}


@pytest.mark.parametrize("name", list(EXACT))
def test_costs_agree_with_fifty_digits_of_the_textbook_form(name: str) -> None:
    # a dozen roundings at most, no cancellation
    with mpmath.workdps(50):
        for c in (0.3, 1.0, 4.6851):
            for x in (1e-8, 1e-3, 0.4, 0.99 * c, c, 1.01 * c, 50.0):
                exact = EXACT[name](mpmath.mpf(x), mpmath.mpf(c))
                np.testing.assert_allclose(LOSSES[name](c).cost(x), float(exact), rtol=12 * EPS)


@pytest.mark.parametrize("c", [0.3, 1.0, 4.6851])
def test_tukey_at_c(c: float) -> None:
    loss = Tukey(c)
    for x in (c, -c, np.nextafter(c, 9), 2 * c):
        np.testing.assert_allclose(loss.cost(x), c * c / 6, rtol=2 * EPS)
        assert loss.weight(x) == loss.influence(x) == loss.curvature(x) == loss.sqrt_weight(x) == 0.0
    # continuous: s, and with it the curvature s (1 - 5u), goes to zero linearly
    below = c * (1 - 1e-9)
    assert 0.0 < loss.sqrt_weight(below) < 3e-9
    assert abs(loss.curvature(below)) < 1e-8
    # the two factors that are often exchanged
    assert abs(loss.cost(c) - c * c / 3) > 0.1 * c * c


def test_huber_at_c() -> None:
    loss = Huber(2.0)
    assert loss.curvature(2.0) == 1.0  # declared
    assert loss.curvature(np.nextafter(2.0, 3)) == pytest.approx(0.0, abs=4 * EPS)
    assert loss.cost([2.0, -2.0]).tolist() == [2.0, 2.0]
    assert loss.influence([2.0, 1e9, -1e9]).tolist() == [2.0, 2.0, -2.0]


def quantum(loss: Loss, scale: float = 1.0) -> float:
    """Rounding of costs below 2e-308, where it is no share of them: some steps of 5e-324, times c^2."""
    return 8 * float(np.finfo(float).smallest_subnormal) * max(1.0, loss.c**2) * max(1.0, scale**2)


@example(Cauchy(120.0), 2.4e-160, 0.0, 1e-3)  # its square is subnormal
@example(Huber(1.0), 2.4e-160, 0.0, 30.0)
@given(
    st.sampled_from(ALL),
    st.floats(-1e6, 1e6),
    st.floats(0.0, 1e6),
    st.floats(1e-6, 1e6),
)
def test_laws_of_all_losses(loss: Loss, x: float, farther: float, sigma: float) -> None:
    y = math.copysign(abs(x) + farther, x)
    assert loss.cost(-x) == loss.cost(x)
    assert loss.influence(-x) == -loss.influence(x)
    assert 0.0 <= loss.weight(x) <= 1.0
    np.testing.assert_allclose(loss.sqrt_weight(x) ** 2, loss.weight(x), rtol=4 * EPS)
    # a larger error never costs less and never weighs more, up to rounding
    assert loss.cost(y) >= loss.cost(x) * (1 - 8 * EPS) - quantum(loss)
    assert loss.weight(y) <= loss.weight(x) * (1 + 8 * EPS)
    # rho_(sigma c)(sigma x) = sigma^2 rho_c(x); log1p turns roundings of u into at most as many of its own
    scaled = loss.scaled(sigma)
    np.testing.assert_allclose(
        scaled.cost(sigma * x), sigma**2 * loss.cost(x), rtol=40 * EPS, atol=quantum(loss, sigma)
    )


@given(st.sampled_from(ALL), st.floats(-50, 50), st.floats(-50, 50))
def test_the_square_of_the_weight_lies_above_the_loss(loss: Loss, x: float, y: float) -> None:
    """Why reweighting goes downhill: rho(y) <= rho(x) + w(x) (y² - x²)/2."""
    above = loss.cost(x) + loss.weight(x) * (y * y - x * x) / 2
    assert loss.cost(y) <= above + 64 * EPS * (loss.cost(x) + x * x + y * y) + quantum(loss)


@pytest.mark.parametrize("cls", list(LOSSES.values()))
def test_an_infinite_constant_is_least_squares(cls: type[Loss]) -> None:
    loss, x = cls(math.inf), np.array([-3.0, 0.0, 1e-8, 2.0, 1e9])
    np.testing.assert_array_equal(loss.cost(x), x * x / 2)
    np.testing.assert_array_equal(loss.weight(x), np.ones(5))
    np.testing.assert_array_equal(loss.curvature(x), np.ones(5))


@pytest.mark.parametrize("shape", [(), (1,), (3, 1, 2), (0,)])
@pytest.mark.parametrize("loss", ALL[::4])
def test_any_shape(loss: Loss, shape: tuple[int, ...]) -> None:
    x = np.full(shape, 0.7)
    for f in (loss.cost, loss.influence, loss.weight, loss.sqrt_weight, loss.curvature, loss.weight_slope):
        assert f(x).shape == shape
        assert np.isnan(f(np.full(shape, np.nan))).all()


@pytest.mark.parametrize("loss", [Cauchy(2.0), GemanMcClure(2.0), Tukey(2.0), Huber(2.0)])
def test_enormous_errors_do_no_harm(loss: Loss) -> None:
    with np.errstate(over="ignore"):
        assert np.isfinite(loss.influence(1e300))
        assert loss.weight(1e300) < 1e-100
    assert math.isfinite(loss.cost(1e150))


@pytest.mark.parametrize("c", [0.0, -1.0, math.nan])
def test_a_constant_must_be_positive(c: float) -> None:
    with pytest.raises(ValueError, match="constant > 0"):
        Tukey(c)


def test_unknown_names_are_refused() -> None:
    with pytest.raises(ValueError, match="unknown loss 'tuckey'"):
        tuned("tuckey")
    with pytest.raises(ValueError, match="dimension=3"):
        tuned("tukey", 3)
