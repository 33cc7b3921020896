"""Exercise 10.1: scale, weights, step and pose, with the mistakes that are usually made."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from scipy import optimize

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3

EXERCISE = "10_tukey_step"
F = 500.0


def test_the_scale_of_plane_errors_is_that_of_one_coordinate(answer: ModuleType) -> None:
    """Median of 20000 norms: 0.72 / sqrt(20000) of sigma, 0.5 %; five of these."""
    e = 2.0 * np.random.default_rng(0).standard_normal((20000, 2))
    found = answer.scale(e)
    if abs(found / 2 - 1.7456) < 0.05:
        pytest.fail("1.4826 belongs to scalars; of norms in the plane half are below 1.1774 sigma")
    assert abs(found / 2 - 1) < 0.026


def test_wrong_errors_and_tiny_errors_do_not_make_the_scale(answer: ModuleType) -> None:
    e = np.random.default_rng(1).standard_normal((1001, 2))
    e[:400] = 1e6
    assert answer.scale(e) < 2.0  # the median is the 0.83 quantile of the right ones: 1.6
    assert answer.scale(np.full((10, 2), 1e-3)) == 0.4


def test_weights_end_at_five_and_a_bit(answer: ModuleType) -> None:
    """(1 - x^2/c^2)^2 with c = 5.1230, which five digits give to 1e-4."""
    x = np.array([0.0, 1.0, 3.0, 5.0, 5.2, 50.0])
    expected = np.where(x < 5.1230, (1 - (x / 5.1230) ** 2) ** 2, 0)
    turned = 0.7 * x[:, None] * np.array([[0.6, 0.8]])
    found = answer.weights(turned, 0.7)
    assert found.shape == (6,), "one weight for a point, not one for a coordinate"
    if found[4] == 0 and found[3] < 0.0005 and found[2] < 0.36:
        pytest.fail("4.6851 is the constant of scalars")
    if abs(found[1] - np.sqrt(expected[1])) < 1e-3:
        pytest.fail("that is the root of the weight")
    np.testing.assert_allclose(found, expected, atol=1e-4)


def linear(seed: int) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(20, 2)), rng.normal(size=(20, 2, 6)), rng.uniform(0, 1, 20)


@pytest.mark.parametrize("seed", range(3))
def test_the_step_is_the_least_weighted_square(answer: ModuleType, seed: int) -> None:
    """SciPy's linear least squares with rows times the root of the weight."""
    e, J, w = linear(seed)
    root = np.sqrt(w)[:, None]
    expected = optimize.lsq_linear(((root[..., None] * J).reshape(-1, 6)), -(root * e).ravel()).x
    found = answer.step(e, J, w)
    if np.allclose(found, -expected, atol=1e-8):
        pytest.fail("the step goes uphill: e is predicted minus measured, J its derivative")
    np.testing.assert_allclose(found, expected, atol=1e-10)


def test_what_has_no_weight_has_no_say(answer: ModuleType) -> None:
    e, J, w = linear(5)
    w[:5] = 0
    far = e.copy()
    far[:5] += 1000
    np.testing.assert_allclose(answer.step(e, J, w), answer.step(far, J, w), atol=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.25])
def test_ten_steps_find_the_pose(answer: ModuleType, share: float) -> None:
    """Half a pixel of noise at 80 points at 2 to 5 m, f = 500: 2e-4 radians and a millimetre; times ten."""
    rng = np.random.default_rng(7)
    T = se3.exp([0.2, -0.3, 0.1, 0.2, 0.1, -0.3])
    z = rng.uniform(2, 5, 80)
    X = np.column_stack([rng.uniform(-0.6, 0.6, 80) * z, rng.uniform(-0.4, 0.4, 80) * z, z])
    xn = X[:, :2] / X[:, 2:] + rng.normal(0, 0.5 / F, (80, 2))
    wrong = int(share * 80)
    xn[:wrong] += rng.uniform([10, -5], [60, 5], (wrong, 2)) / F
    X_world = se3.act(se3.inverse(T), X)
    start = se3.perturb(T, np.array([0.02, -0.02, 0.02, 0.01, -0.01, 0.01]))
    found = answer.pose(X_world, xn, F, start, 10)
    error = np.abs(se3.log(se3.compose(found, se3.inverse(T))))
    if share and error.max() > 1e-2:
        pytest.fail(f"with a quarter of the matches wrong, off by {error}: do they lose their weight?")
    assert error.max() < 4e-3
