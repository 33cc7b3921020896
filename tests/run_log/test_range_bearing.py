"""Converted measurements: unbiased, and a covariance that says so, from the measurement alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vslam_ref.filters import range_bearing

NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(40)
WEIGHTS = WEIGHTS / WEIGHTS.sum()


def over_measurements(
    rho: float, beta: float, sigma_r: float, sigma_b: float
) -> tuple[np.ndarray, np.ndarray]:
    """All quadrature measurements (N, 2) of one landmark and their weights (N,)."""
    r, b = np.meshgrid(rho + sigma_r * NODES, beta + sigma_b * NODES, indexing="ij")
    return np.stack([r.ravel(), b.ravel()], -1), np.outer(WEIGHTS, WEIGHTS).ravel()


CASES = [(4.0, 0.3, 0.1, 0.05), (4.0, -2.5, 0.3, 0.2), (50.0, 1.0, 2.0, 0.1), (2.0, 0.0, 0.02, 0.005)]


@pytest.mark.parametrize(("rho", "beta", "sigma_r", "sigma_b"), CASES)
def test_mean_and_stated_covariance_are_the_true_ones(
    rho: float, beta: float, sigma_r: float, sigma_b: float
) -> None:
    """Gauss-Hermite quadrature with 40 nodes is exact to rounding for these entire functions."""
    polar, w = over_measurements(rho, beta, sigma_r, sigma_b)
    near = np.all(np.abs((polar - [rho, beta]) / [sigma_r, sigma_b]) < 6, axis=1)
    polar, w = (
        polar[near],
        w[near],
    )  # beyond 6 sigma weights are under 1e-9: no matter, and ranges may be negative
    z, cov = range_bearing.cartesian_from_polar(polar, sigma_r, sigma_b)
    mean = w @ z
    np.testing.assert_allclose(mean, [rho * np.cos(beta), rho * np.sin(beta)], atol=1e-7 * rho)
    true = np.einsum("n,ni,nj->ij", w, z - mean, z - mean)
    np.testing.assert_allclose(np.einsum("n,nij->ij", w, cov), true, atol=1e-6 * np.trace(true))


@pytest.mark.parametrize(("rho", "beta", "sigma_r", "sigma_b"), CASES)
def test_the_naive_conversion_is_biased_by_what_the_module_says(
    rho: float, beta: float, sigma_r: float, sigma_b: float
) -> None:
    polar, w = over_measurements(rho, beta, sigma_r, sigma_b)
    naive = w @ (polar[:, :1] * np.stack([np.cos(polar[:, 1]), np.sin(polar[:, 1])], -1))
    shrunk = np.exp(-(sigma_b**2) / 2) * rho * np.array([np.cos(beta), np.sin(beta)])
    np.testing.assert_allclose(naive, shrunk, atol=1e-12 * rho)


@given(
    r=st.floats(0.5, 100), b=st.floats(-3.1, 3.1), s=st.floats(1e-3, 0.2), v=st.floats(1e-4, 0.02),
    turn=st.floats(-3, 3),
)  # fmt: skip
def test_turning_the_sensor_turns_measurement_and_covariance(
    r: float, b: float, s: float, v: float, turn: float
) -> None:
    """Equivariance catches a wrong axis or sign; 1e-12 is 1e4 rounding errors of r^2."""
    if r * np.expm1(v * v) >= s:
        return
    z, cov = range_bearing.cartesian_from_polar([r, b], s, v)
    z2, cov2 = range_bearing.cartesian_from_polar([r, b + turn], s, v)
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    np.testing.assert_allclose(z2, R @ z, atol=1e-12 * r)
    np.testing.assert_allclose(cov2, R @ cov @ R.T, atol=1e-12 * r * r)
    assert np.linalg.eigvalsh(cov).min() > 0


def test_first_order_agrees_where_noise_is_small() -> None:
    z, cov = range_bearing.cartesian_from_polar([3.0, np.pi / 2], 1e-3, 1e-4)
    np.testing.assert_allclose(z, [0, 3], atol=1e-7)
    # the line of sight is y: 3 m x 1e-4 rad across, 1e-3 m along
    np.testing.assert_allclose(cov, np.diag([9e-8, 1e-6]), rtol=1e-5, atol=1e-20)


@pytest.mark.parametrize(("r", "s", "v"), [(0.1, 0.1, 0.01), (-1.0, 0.1, 0.01), (1000.0, 0.1, 0.05)])
def test_a_measurement_without_a_positive_covariance_is_refused(r: float, s: float, v: float) -> None:
    with pytest.raises(ValueError, match="no positive covariance"):
        range_bearing.cartesian_from_polar([r, 0.0], s, v)
