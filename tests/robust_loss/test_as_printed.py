"""A2.8: what is printed as Tukey's loss is the reweighted residual, and no cost."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy

from vslam_ref.estimation.robust import Tukey, TukeyAsPrinted

C = 4.0
INSIDE = np.linspace(0.01, 3.99, 200)


def test_printed_psi_is_the_root_of_the_weight_times_the_residual() -> None:
    """Three forms stand for one another in the literature; symbols tell which one the print is."""
    x, c = sympy.symbols("x c", positive=True)
    s = 1 - x**2 / c**2
    cost = c**2 / 6 * (1 - s**3)
    influence = sympy.diff(cost, x)
    weight = sympy.simplify(influence / x)
    printed = x * s
    assert sympy.simplify(printed**2 - weight * x**2) == 0
    assert sympy.simplify(printed - influence) != 0
    assert sympy.simplify(printed - cost) != 0
    tukey, odd = Tukey(C), TukeyAsPrinted(C)
    np.testing.assert_array_equal(odd.cost(INSIDE), tukey.sqrt_weight(INSIDE) * INSIDE)


def test_printed_psi_used_as_a_cost_falls_beyond_c_over_root_three() -> None:
    printed, right = TukeyAsPrinted(C), Tukey(C)
    top = C / math.sqrt(3)
    assert INSIDE[np.argmax(printed.cost(INSIDE))] == pytest.approx(top, abs=0.02)  # the grid's step
    assert printed.cost(top) == pytest.approx(2 * C / (3 * math.sqrt(3)))
    beyond = np.linspace(top, C, 50)
    assert (np.diff(printed.cost(beyond)) < 0.0).all()
    assert (np.diff(right.cost(beyond)) > 0.0).all()
    # an error of c and more costs what no error at all costs
    assert printed.cost([0.0, C, 2 * C]).tolist() == [0.0, 0.0, 0.0]


def test_printed_psi_as_a_cost_is_least_at_a_negative_error() -> None:
    x = np.linspace(-C, C, 8001)
    assert x[np.argmin(TukeyAsPrinted(C).cost(x))] == pytest.approx(-C / math.sqrt(3), abs=1e-3)
    assert x[np.argmin(Tukey(C).cost(x))] == pytest.approx(0.0, abs=1e-12)


def test_its_derivatives_are_derivatives() -> None:
    loss, h = TukeyAsPrinted(C), 1e-6
    x = np.array([-3.0, -1.0, 0.5, 2.0, 3.9, 5.0])
    for value, slope in ((loss.cost, loss.influence), (loss.influence, loss.curvature)):
        # central differences of a cubic: truncation h^2, rounding 1e-16 / h
        np.testing.assert_allclose((value(x + h) - value(x - h)) / (2 * h), slope(x), atol=1e-9)
    s = np.array([0.25, 4.0, 15.0, 20.0])
    slope = (loss.weight(np.sqrt(s + h)) - loss.weight(np.sqrt(s - h))) / (2 * h)
    np.testing.assert_allclose(slope, loss.weight_slope(np.sqrt(s)), atol=1e-7)


def test_reweighted_least_squares_cannot_run_on_it() -> None:
    loss = TukeyAsPrinted(C)
    assert loss.weight(0.0) == math.inf
    assert loss.weight(3.0) < 0.0
    with pytest.raises(ValueError, match="negative weights"):
        loss.sqrt_weight(1.0)
