"""Scale from medians: the constants derived, the breakdown at one half, small samples as declared."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from vslam_ref.estimation.robust import MAD_1D, MAD_NORM_2D, Tukey, mad_scale, norm_scale, small_sample_factor


def test_constants_are_one_over_medians_of_unit_errors() -> None:
    with mpmath.workdps(40):
        normal = mpmath.findroot(lambda m: mpmath.erf(m / mpmath.sqrt(2)) - mpmath.mpf(1) / 2, 0.67)
        rayleigh = mpmath.findroot(lambda m: 1 - mpmath.exp(-m * m / 2) - mpmath.mpf(1) / 2, 1.2)
        assert abs(rayleigh - mpmath.sqrt(2 * mpmath.log(2))) < mpmath.mpf(10) ** -30
    assert pytest.approx(float(1 / normal), rel=1e-15) == MAD_1D
    assert pytest.approx(float(1 / rayleigh), rel=1e-15) == MAD_NORM_2D


def test_scales_find_the_standard_deviation_of_one_coordinate() -> None:
    n, sigma, rng = 40001, 3.0, np.random.default_rng(1)
    flat, plane = rng.normal(0.0, sigma, n), rng.normal(0.0, sigma, (n, 2))
    # the median's standard deviation is 1 / (2 f(m) sqrt(n)): 1.17 and 0.72 of m over sqrt(n); 4 of them
    assert mad_scale(flat).sigma == pytest.approx(sigma, rel=4 * 1.17 / math.sqrt(n))
    assert norm_scale(plane).sigma == pytest.approx(sigma, rel=4 * 0.72 / math.sqrt(n))
    # the known mistake: the constant of scalars on norms is 1.75 times too wide
    wrong = mad_scale(np.hypot(*plane.T)).sigma
    assert wrong == pytest.approx(sigma * MAD_1D / MAD_NORM_2D, rel=0.02)
    assert pytest.approx(1.7456, abs=1e-4) == MAD_1D / MAD_NORM_2D


@pytest.mark.parametrize("share", [0.1, 0.3, 0.49])
def test_fewer_than_half_of_the_errors_cannot_carry_the_scale_away(share: float) -> None:
    """With a share e of wrong ones the median is the quantile 1/(2 - 2e) of the honest ones, at worst."""
    n, rng = 20001, np.random.default_rng(2)
    e = rng.standard_normal((n, 2))
    e[: int(share * n)] = 1e12
    quantile = 0.5 / (1 - share)
    worst = math.sqrt(-2 * math.log(1 - quantile))  # of Rayleigh
    # sqrt(q (1 - q) / n) / f, f the density there; 5 of them
    spread = math.sqrt(quantile * (1 - quantile) / n) / (worst * (1 - quantile))
    assert norm_scale(e).sigma == pytest.approx(MAD_NORM_2D * worst, abs=5 * spread)
    root_mean_square = math.sqrt(np.mean(e**2))
    assert root_mean_square > 1e11


def test_more_than_half_do() -> None:
    e = np.zeros((11, 2))
    e[:6] = 1e12
    assert norm_scale(e).sigma > 1e11


@pytest.mark.parametrize(("points", "factor"), [(4, 3.5), (5, 2.25), (10, 1 + 5 / 14), (1000, 1 + 5 / 1994)])
def test_the_small_sample_factor_is_ptams(points: int, factor: float) -> None:
    assert small_sample_factor(2 * points, 6) == pytest.approx(factor, rel=1e-15)


@pytest.mark.parametrize("points", [0, 1, 2, 3])
def test_without_redundancy_there_is_no_scale_and_no_outlier(points: int) -> None:
    """At n = 3 PTAM divides by zero; for n < 3 its unsigned 2n - 6 wraps around and the factor is 1."""
    wrapped = (2 * points - 6) % 2**64
    ptam = 1 + 5 / wrapped if wrapped else math.inf
    assert ptam == (math.inf if points == 3 else 1.0)
    scale = norm_scale(np.zeros((points, 2)), parameters=6)
    assert scale.sigma == math.inf
    assert "unknown" in scale.reason
    weights = Tukey().scaled(scale.sigma).weight([0.0, 1.0, 1e9])
    assert weights.tolist() == [1.0, 1.0, 1.0]


def test_a_scale_is_never_nan() -> None:
    assert norm_scale(np.zeros((20, 2)), parameters=6) == (0.0, "more than half of the errors are zero")
    assert mad_scale([]).sigma == math.inf


def test_residuals_of_a_fit_are_smaller_than_errors_and_the_factor_makes_up_for_it() -> None:
    """Of n points and 6 parameters: residuals have the variance 1 - 6/(2n); the factor is more careful."""
    rng, runs = np.random.default_rng(3), 400
    for n in (6, 10, 25):
        found = []
        for _ in range(runs):
            A, y = rng.standard_normal((2 * n, 6)), rng.standard_normal(2 * n)
            r = (y - A @ np.linalg.lstsq(A, y, rcond=None)[0]).reshape(n, 2)
            found.append((norm_scale(r).sigma, norm_scale(r, parameters=6).sigma))
        plain, corrected = np.mean(found, axis=0)
        assert plain < 0.97
        assert plain == pytest.approx(
            math.sqrt(1 - 3 / n), rel=0.06
        )  # Gaussian residuals of unequal variance
        assert 1.0 < corrected < 1.35


@pytest.mark.parametrize("bad", [np.zeros((3, 3)), np.zeros(3), [[1.0, math.nan]]])
def test_bad_errors_are_refused(bad: object) -> None:
    with pytest.raises(ValueError, match=r"need finite numbers of shape \(N, 2\)"):
        norm_scale(bad)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="need numbers >= 0"):
        small_sample_factor(-1, 6)
    with pytest.raises(ValueError, match=r"of shape \(N,\)"):
        mad_scale([[1.0]])
