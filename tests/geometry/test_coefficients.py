"""The scalar functions behind the exponentials, one by one: errors that a norm might hide."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from vslam_ref.geometry.coefficients import (
    expm1_over,
    inverse_coefficients,
    rotation_coefficients,
    rotation_polynomial,
    similarity_coefficients,
)

EPS = float(np.finfo(float).eps)


def series(k: int, q: float) -> mpmath.mpf:
    """c_k by its definition."""
    with mpmath.workdps(60):
        return mpmath.nsum(lambda n: (-mpmath.mpf(q)) ** int(n) / mpmath.factorial(2 * int(n) + k), [0, 40])


@pytest.mark.parametrize("q", [0.0, 1e-300, 1e-12, 0.25, 0.9, np.nextafter(1, 0)])
def test_small_angles(q: float) -> None:
    """Every step adds a rounding of terms that get smaller: 2 eps, and cos(1) is half of 1."""
    for k, c in enumerate(rotation_coefficients(np.array(q))):
        assert abs(c / series(k, q) - 1) < (4 if k == 0 else 2) * EPS


@pytest.mark.parametrize("angle", [1.0, 1 + EPS, 1.5, 2.5, 4.0, 6.2])
def test_large_angles(angle: float) -> None:
    """One step upwards loses 1/k! / (q c_{k+2}); two steps both.  Cos, sin: 1 eps of 1, angle / 2 of eps."""
    q = np.float64(angle * angle)
    c = rotation_coefficients(np.array(q))
    true = [series(k, float(q)) for k in range(6)]
    lost = [1.0 + angle, 1.0 + angle, (1.0 + angle), 0.0, 0.0, 0.0]
    for k in (3, 4, 5):
        lost[k] = (2.0 + lost[k - 2]) / float(q)
    for k in range(6):
        # absolute: sin / theta over theta, 1 - cos over theta^2 have been divided before
        scale = 1.0 if k == 0 else 1.0 / angle if k == 1 else 2.0 / float(q) if k == 2 else 1.0
        assert abs(c[k] - float(true[k])) <= 2 * EPS * lost[k] * scale + 2 * EPS * abs(true[k]), k


def test_batches_mix_both_branches() -> None:
    q = np.array([[0.0, 0.5, 1.0], [2.0, 30.0, 1e-9]])
    many = rotation_coefficients(q)
    assert many.shape == (6, 2, 3)
    for i in np.ndindex(q.shape):
        np.testing.assert_allclose(many[(slice(None), *i)], rotation_coefficients(q[i]), rtol=4 * EPS)


@pytest.mark.parametrize("x", [0.0, 5e-324, 1e-300, -1e-9, 1e-4, -1.0, 3.0, -30.0])
def test_expm1_over(x: float) -> None:
    with mpmath.workdps(60):
        true = (mpmath.exp(mpmath.mpf(x)) - 1) / mpmath.mpf(x) if x and abs(x) > 1e-100 else mpmath.mpf(1)
    assert abs(expm1_over(np.array(x)) / true - 1) < 3 * EPS


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, 0.8, 1.0, 3.0, 6.0])
@pytest.mark.parametrize("sigma", [0.0, 1e-12, -0.3, 0.6, 1.0, -2.0, 5.0])
def test_similarity_coefficients_are_integrals(angle: float, sigma: float) -> None:
    r"""A, B, C = \int_0^1 e^{sigma u} (1, sin(theta u) / theta, (1 - cos(theta u)) / theta^2) du.

    By quadrature with 30 digits, which meets no 0 / 0.  Absolute errors of B and C are some eps of the
    numbers that are subtracted, 2 e^sigma (1 + |sigma|) over kappa.
    """
    with mpmath.workdps(30):
        s, t = mpmath.mpf(sigma), mpmath.mpf(angle)
        shapes = (
            lambda u: mpmath.mpf(1),
            lambda u: u * mpmath.sinc(t * u),
            lambda u: u**2 * mpmath.sinc(t * u / 2) ** 2 / 2,
        )
        true = [
            float(mpmath.quad(lambda u, f=f: mpmath.exp(s * u) * f(u), [0, 1], method="gauss-legendre"))
            for f in shapes
        ]
    found = similarity_coefficients(np.array(sigma), np.array(angle**2))
    kappa = max(sigma**2 + angle**2, 1.0)
    size = 1 + 2 * max(np.exp(sigma), 1.0) * (1 + abs(sigma)) / kappa
    assert np.abs(np.array(found) - true).max() < 4 * EPS * size


@pytest.mark.parametrize("sigma", [0.999, -0.999, 0.7, 1e-3, 0.0])
@pytest.mark.parametrize("share", [0.0, 0.04, 0.7])
def test_power_sums_keep_every_digit(sigma: float, share: float) -> None:
    """Inside the circle: 4 eps, relative.  One power too few would cost 16 eps of C."""
    angle = share * float(np.sqrt(1 - sigma**2))
    _, B, C = similarity_coefficients(np.array(sigma), np.array(angle**2))
    with mpmath.workdps(60):
        z = mpmath.mpc(sigma, angle or mpmath.mpf(10) ** -20)
        f = (mpmath.exp(z) - 1) / z
        A = (mpmath.exp(z.real) - 1) / z.real if sigma else mpmath.mpf(1)
        true = f.imag / z.imag, (A - f.real) / z.imag**2
    assert abs(B / true[0] - 1) < 4 * EPS
    assert abs(C / true[1] - 1) < 4 * EPS


def test_inverse_coefficients_invert(exact: Any) -> None:
    rng = np.random.default_rng(2)
    phi = rng.uniform(-3, 3, (50, 3))
    Phi = np.stack([exact.cross(v).astype(float) for v in phi])
    q = np.sum(phi**2, -1)
    a, b, c = similarity_coefficients(rng.uniform(-2, 2, 50), q)
    M = rotation_polynomial(a, b, c, Phi)
    back = rotation_polynomial(*inverse_coefficients(a, b, c, q), Phi)
    off = np.linalg.norm(M @ back - np.eye(3), axis=(1, 2))
    assert (off < 16 * EPS * np.linalg.cond(M)).all()
