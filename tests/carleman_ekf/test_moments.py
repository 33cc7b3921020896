"""Gaussian moments of the lifted start and of the control, against quadrature, sampling and mpmath.

Gauss-Hermite with 24 nodes a dimension integrates polynomials to degree 47 exactly; e^{2i theta} with
standard deviation 0.4 leaves a remainder (2 * 0.4)^48 / 48! < 1e-65.  What is left is rounding: sums of
numbers up to the square of the largest value at a node, ``SCALE``, so the tolerance is 1e-13 SCALE^2.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest

from vslam_ref.filters.carleman_ekf import lift, moments, reduced_moments
from vslam_ref.filters.carleman_ekf.lifted import LiftedCarlemanEkf
from vslam_ref.filters.vehicle import Increment, ackermann_increment
from vslam_ref.worlds import vehicle_field

MEAN = np.array([[1.5, -0.7, 0.9], [-2.0, 1.1, -2.8], [0.0, 0.0, 0.0]])
COV = np.array([[0.5, 0.1, 0.12], [0.1, 0.3, -0.08], [0.12, -0.08, 0.16]]) * np.ones((3, 1, 1))
INCREMENT = Increment(
    np.array([0.4, -1.2, 0.0]),
    np.array([0.3, -0.8, 0.0]),
    np.array([[0.2, 0.06], [0.06, 0.1]]) * np.array([1.0, 0.5, 1e-4])[:, None, None],
)
SCALE = 10.0  # positions up to 2 + 8 sigma


def quadrature(f: Callable[[np.ndarray], np.ndarray], mean: np.ndarray, cov: np.ndarray) -> Any:
    """Mean and covariance of f (N, d) -> (N, m) under a Gaussian, 24 nodes per dimension."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(24)
    grid = np.meshgrid(*[nodes] * len(mean), indexing="ij")
    p = np.ones(())
    for _ in mean:
        p = np.multiply.outer(p, weights / np.sqrt(2 * np.pi))
    values, vectors = np.linalg.eigh(cov)
    x = mean + np.stack([g.ravel() for g in grid], -1) @ (vectors * np.sqrt(np.maximum(values, 0))).T
    y, p = f(x), p.ravel()
    first = p @ y
    return first, (p[:, None] * (y - first)).T @ (y - first)


def monomials(u: np.ndarray) -> np.ndarray:
    u1, u2, u3 = u[:, 0], np.sin(u[:, 1]), np.cos(u[:, 1])
    return np.stack([u1, u2, u3, u2 * u2, u2 * u3, u3 * u3, u1 * u2, u1 * u3], -1)


def reduced_monomials(u: np.ndarray) -> np.ndarray:
    m = np.exp(-1j * u[:, 1])
    t = u[:, 0] * m
    return np.stack([u[:, 0], m.real, m.imag, t.real, t.imag], -1)


# --- exact moments ------------------------------------------------------------------------------------


@pytest.mark.parametrize("b", range(3))
def test_lifted_start_is_the_quadrature(b: int) -> None:
    z, P = moments.lifted_start(MEAN, COV, "gaussian")
    first, second = quadrature(lift.lift_vehicle, MEAN[b], COV[b])
    assert np.abs(z[b] - first).max() < 1e-13 * SCALE**2
    assert np.abs(P[b] - second).max() < 1e-13 * SCALE**2


@pytest.mark.parametrize("b", range(3))
def test_reduced_start_is_the_quadrature(b: int) -> None:
    x, P = reduced_moments.start_moments(MEAN, COV, "gaussian")
    first, second = quadrature(lambda v: lift.lift_vehicle(v)[:, :4], MEAN[b], COV[b])
    assert np.abs(x[b] - first).max() < 1e-13 * SCALE**2
    assert np.abs(P[b] - second).max() < 1e-13 * SCALE**2


@pytest.mark.parametrize("b", range(3))
def test_lifted_control_is_the_quadrature(b: int) -> None:
    w = moments.control_moments(INCREMENT, "gaussian")
    first, second = quadrature(monomials, np.array([INCREMENT.ds[b], INCREMENT.dalpha[b]]), INCREMENT.cov[b])
    assert np.abs(w.mean[b, 1:] - first).max() < 1e-13 * SCALE**2
    assert np.abs(w.factor[b] @ w.factor[b].T - second).max() < 1e-13 * SCALE**2


@pytest.mark.parametrize("b", range(3))
def test_reduced_control_is_the_quadrature(b: int) -> None:
    at = np.array([INCREMENT.ds[b], INCREMENT.dalpha[b]])
    mean, C = reduced_moments.control_gaussian(INCREMENT)
    first, second = quadrature(reduced_monomials, at, INCREMENT.cov[b])
    assert np.abs(mean[b] - first).max() < 1e-13 * SCALE**2
    assert np.abs(C[b] - second).max() < 1e-13 * SCALE**2


def test_moments_by_sampling() -> None:
    """5 sigma of the sample mean and of the sample covariance, from the samples' own spread."""
    rng, N = np.random.default_rng(4), 400_000
    y = lift.lift_vehicle(rng.multivariate_normal(MEAN[0], COV[0], N))
    z, P = moments.lifted_start(MEAN[:1], COV[:1], "gaussian")
    assert (np.abs(y.mean(0) - z[0]) < 5 * y.std(0) / np.sqrt(N)).all()
    d = y - z[0]
    for i in range(11):
        products = d[:, [i]] * d
        assert (np.abs(products.mean(0) - P[0, i]) < 5 * products.std(0) / np.sqrt(N)).all()


def test_small_variances_keep_their_digits() -> None:
    """var cos at heading 0 is (1 - e^{-v})^2 / 2, 5e-17 at v = 1e-8: below the rounding of 1."""
    mpmath.mp.dps = 50
    v = 1e-8
    exact = float((1 - mpmath.exp(-mpmath.mpf(v))) ** 2 / 2)
    cov = np.zeros((1, 3, 3))
    cov[0, 2, 2] = v
    _, P = moments.lifted_start(np.zeros((1, 3)), cov, "gaussian")
    _, P_r = reduced_moments.start_moments(np.zeros((1, 3)), cov, "gaussian")
    assert abs(P[0, 3, 3] / exact - 1) < 1e-8  # the terms themselves, of size v / 4, cancel: eps / v
    assert abs(P_r[0, 3, 3] / exact - 1) < 1e-8
    sin = float((1 - mpmath.exp(-2 * mpmath.mpf(v))) / 2)
    assert abs(P[0, 2, 2] / sin - 1) < 16 * np.finfo(float).eps
    assert abs(P_r[0, 2, 2] / sin - 1) < 16 * np.finfo(float).eps


# --- first order is the limit -------------------------------------------------------------------------


@pytest.mark.parametrize("what", ["lifted start", "reduced start", "lifted control", "reduced control"])
def test_first_order_is_the_limit_of_small_covariances(what: str) -> None:
    """Scaling the covariance by t: means differ by O(t), covariances by O(t^2): a tenth gives 10 and 100."""

    def pair(t: float) -> list[tuple[np.ndarray, np.ndarray]]:
        out = []
        for kind in ("first_order", "gaussian"):
            small = INCREMENT._replace(cov=t * INCREMENT.cov)
            if what == "lifted start":
                out.append(moments.lifted_start(MEAN, t * COV, kind))
            elif what == "reduced start":
                out.append(reduced_moments.start_moments(MEAN, t * COV, kind))
            elif what == "reduced control":
                out.append(
                    {
                        "first_order": reduced_moments.control_first_order,
                        "gaussian": reduced_moments.control_gaussian,
                    }[kind](small)
                )
            else:
                w = moments.control_moments(small, kind)
                out.append((w.mean, w.factor @ w.factor.swapaxes(1, 2)))
        return out

    def gap(t: float) -> tuple[float, float]:
        (m1, P1), (m2, P2) = pair(t)
        return float(np.linalg.norm(m1 - m2)), float(np.linalg.norm(P1 - P2))

    (m_a, P_a), (m_b, P_b) = gap(1e-3), gap(1e-4)
    assert 9.5 < m_a / m_b < 10.5
    assert 95 < P_a / P_b < 105


# --- the circle ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["first_order", "gaussian"])
def test_control_monomials_stay_on_the_circle(kind: str) -> None:
    """E[u2 u2] + E[u3 u3] = 1, and no noise at all on that sum."""
    w = moments.control_moments(INCREMENT, kind)
    assert np.abs(w.mean[:, 4] + w.mean[:, 6] - 1).max() < 4 * np.finfo(float).eps
    # the factor is a square root: an eps in the covariance is sqrt(eps) in it
    sum_row = w.factor[:, 3] + w.factor[:, 5]
    assert np.einsum("br,br->b", sum_row, sum_row).max() < 16 * np.finfo(float).eps


def test_products_of_means_lose_z5_plus_z6() -> None:
    """E[u2]^2 + E[u3]^2 = e^{-v}: over the standard course about 6 % are gone.

    w = z5 + z6 has no variance, so no measurement can bring it back.  Every quarter lap has the same
    controls: one quarter, to the eighth power, is the course of two laps.
    """
    config = vehicle_field.VehicleFieldConfig()
    _, controls = vehicle_field.course(config)
    wrong = LiftedCarlemanEkf(
        [0, 0, 0], np.eye(3), control="gaussian", variant=lift.Variant(product_of_means=True)
    )
    right = LiftedCarlemanEkf([0, 0, 0], np.eye(3), control="gaussian")
    v = 0.0
    for u in controls[: config.quarter_steps, None]:
        step = ackermann_increment(u, config.cov_u, config.wheelbase, config.dt)
        v += step.cov[0, 1, 1]
        wrong.predict(step)
        right.predict(step)
    w, w_right = (slam.state()[0][0, 4:6].sum() for slam in (wrong, right))
    rounding = config.quarter_steps * 4 * np.finfo(float).eps  # products of numbers near 1
    assert abs(w - np.exp(-v)) < rounding
    assert abs(w_right - 1) < rounding
    assert 0.05 < 1 - w**8 < 0.08
    assert np.abs(wrong.state()[1][0, 4:6].sum(0)).max() < rounding
