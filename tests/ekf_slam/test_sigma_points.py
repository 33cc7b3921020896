"""Sigma points: exact where the model is linear, nearer to the truth than slopes where it is not."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.filters.polar_update import update_polar
from vslam_ref.filters.sigma_points import predict_pose, sigma_points, update_pose
from vslam_ref.filters.vehicle import ackermann, propagate

P = np.array([[0.04, 0.006, -0.003], [0.006, 0.0225, 0.002], [-0.003, 0.002, 0.0036]])


@pytest.mark.parametrize(("alpha", "beta", "kappa"), [(1.0, 2.0, 0.0), (0.5, 2.0, 1.0), (0.1, 0.0, 3.0)])
def test_points_have_the_mean_and_the_covariance(alpha: float, beta: float, kappa: float) -> None:
    """Rounding: weights up to n/alpha^2 = 300, times eps, on numbers of 1."""
    points, w, c = sigma_points([1.0, -2.0, 0.5], P, alpha, beta, kappa)
    off = points - points[0]
    assert np.abs(w @ points - points[0]).max() < 300 * 2**-52 * 7
    assert np.abs((w * off.T) @ off - P).max() < 1e-15
    assert c[0] - w[0] == pytest.approx(1 - alpha**2 + beta, abs=1e-12)
    assert (c[1:] == w[1:]).all()


def test_a_prediction_has_the_moments_of_many_draws() -> None:
    """Third order is what points and draws differ in; the bands are four standard errors of the draws."""
    x, u, cov_u, n = np.array([1.0, 2.0, 3.1]), np.array([3.0, 0.4]), np.diag([0.09, 0.0025]), 400_000
    found = predict_pose(x, P, u, cov_u, 1.7, 0.25)
    rng = np.random.default_rng(5)
    poses, controls = rng.multivariate_normal(x, P, n), rng.multivariate_normal(u, cov_u, n)
    off = propagate(poses, ackermann(controls, 1.7, 0.25)) - found.x
    off[:, 2] = (off[:, 2] + np.pi) % (2 * np.pi) - np.pi
    sigma = np.sqrt(np.diag(found.P))
    assert (np.abs(off.mean(axis=0)) < 4 * sigma / n**0.5).all()
    assert (np.abs(off.T @ off / n - found.P) < 4 * 2**0.5 * np.outer(sigma, sigma) / n**0.5).all()


def test_an_update_of_little_doubt_is_that_by_slopes() -> None:
    """Points and slopes differ by the second order: P 1e-8 of its size makes differences of 1e-8."""
    x, small, cov = np.array([1.0, 2.0, -2.9]), 1e-8 * P, 1e-8 * np.diag([0.01, 0.001])
    landmark, polar = np.array([-4.0, 1.0]), np.array([5.1, -0.05])
    found = update_pose(x, small, landmark, polar, cov)
    whole = np.zeros((5, 5))
    whole[:3, :3] = small
    slopes = update_polar([*x, *landmark], whole, [0], [polar], cov)
    moved = np.abs(slopes.x[:3] - x).max()
    assert np.abs(found.x - slopes.x[:3]).max() < 1e-6 * moved
    assert np.abs(found.P - slopes.P[:3, :3]).max() < 1e-6 * small.max()


def test_bearings_behind_are_near_each_other() -> None:
    """Half a degree over the seam is half a degree, for the mean of the points as for the innovation."""
    x, landmark = np.array([0.0, 0.0, 0.0]), np.array([-5.0, 0.0])
    cov = np.diag([0.01, 0.001])
    one = update_pose(x, P, landmark, [5.0, np.pi - 0.01], cov)
    other = update_pose(x, P, landmark, [5.0, -np.pi + 0.01], cov)
    assert np.abs(one.x - other.x).max() < 0.02
    assert np.abs(one.x).max() < 0.02


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kappa": -3.0}, "must be positive"),
        ({"alpha": 0.0}, "must be positive"),
        ({"cov": -P}, "not positive definite"),
    ],
)
def test_what_has_no_points_is_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sigma_points(**{"mean": np.zeros(3), "cov": P, **change})  # type: ignore[arg-type]
