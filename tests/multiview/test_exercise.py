"""Exercise 1.1: a point from several pictures, the best one, with its covariance, or a reason."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

EXERCISE = "01_triangulation"

K = np.array([[500.0, 0.0, 320.0], [0.0, 520.0, 240.0], [0.0, 0.0, 1.0]])


def turn(a: float, b: float, c: float) -> np.ndarray:
    """A rotation about three axes, written out."""
    ca, sa, cb, sb, cc, sc = np.cos(a), np.sin(a), np.cos(b), np.sin(b), np.cos(c), np.sin(c)
    x = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    z = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]])
    return x @ y @ z


def cameras(count: int, apart: float = 0.8) -> np.ndarray:
    """Cameras in a bent row, each turned a little; the world's origin is somewhere else."""
    out = []
    for k in range(count):
        R = turn(0.05 * k, -0.1 * k, 0.2 * k)
        centre = np.array([apart * k, 0.1 * k * k, -0.05 * k]) + [10.0, -20.0, 5.0]
        out.append(K @ np.c_[R, -R @ centre])
    return np.array(out)


def pixels(P: np.ndarray, X: np.ndarray) -> np.ndarray:
    h = P[:, :, :3] @ X + P[:, :, 3]
    return h[:, :2] / h[:, 2:]


POINT = np.array([10.6, -19.8, 9.0])


def point(
    answer: ModuleType, P: np.ndarray, uv: np.ndarray, sigma: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    X, cov, reason = answer.triangulate(P.copy(), uv.copy(), sigma)
    X, cov = np.asarray(X, dtype=float), np.asarray(cov, dtype=float)
    assert reason == "", f"reason is {reason!r} for a point in front of all cameras, with a good parallax"
    assert X.shape == (3,), f"X has shape {X.shape}, need (3,)"
    assert cov.shape == (3, 3), f"cov has shape {cov.shape}, need (3, 3)"
    assert np.isfinite(X).all()
    return X, cov


def test_pixels_and_their_derivatives(answer: ModuleType) -> None:
    P = cameras(3)
    uv, J = answer.project(P, POINT)
    np.testing.assert_allclose(uv, pixels(P, POINT), rtol=1e-12, err_msg="a pixel is h_1 / h_3, h_2 / h_3")
    assert np.shape(J) == (3, 2, 3), f"J has shape {np.shape(J)}, need (V, 2, 3)"
    h = 1e-5
    numeric = np.stack(
        [(pixels(P, POINT + h * e) - pixels(P, POINT - h * e)) / (2 * h) for e in np.eye(3)], -1
    )
    np.testing.assert_allclose(J, numeric, atol=1e-5, err_msg="J is not the derivative of the pixels in X")


@pytest.mark.parametrize("count", [2, 3, 6])
def test_without_noise_the_point_is_exact(answer: ModuleType, count: int) -> None:
    P = cameras(count)
    X, _ = point(answer, P, pixels(P, POINT))
    np.testing.assert_allclose(X, POINT, atol=1e-8, err_msg="the rays meet in one point: this one")


@pytest.mark.parametrize("count", [2, 3, 6])
@pytest.mark.parametrize("noise", [0.5, 5.0])
def test_no_other_point_is_better(answer: ModuleType, count: int, noise: float) -> None:
    """Not the midpoint, not the linear point: the smallest sum of squared *pixel* errors."""
    P, rng = cameras(count), np.random.default_rng(count)
    for _ in range(10):
        uv = pixels(P, POINT) + rng.normal(0, noise, (count, 2))
        X, _ = point(answer, P, uv)
        best = np.sum((pixels(P, X) - uv) ** 2)
        for step in (1e-4, 1e-2):
            for e in (*np.eye(3), X / np.linalg.norm(X), POINT - [10, -20, 5]):
                for sign in (-1, 1):
                    there = np.sum((pixels(P, X + sign * step * e) - uv) ** 2)
                    assert there >= best * (1 - 1e-9), (
                        f"{count} views: a step of {step} m lowers the squared error from {best:.6f} to "
                        f"{there:.6f} px^2; the linear point is only a start"
                    )


def test_the_world_may_be_small_or_far_away(answer: ModuleType) -> None:
    """The same scene in millimetres, and moved by 100 m: the same point."""
    P, rng = cameras(3), np.random.default_rng(1)
    uv = pixels(P, POINT) + rng.normal(0, 1.0, (3, 2))
    X, _ = point(answer, P, uv)
    for scale, shift in ((1000.0, np.zeros(3)), (1.0, np.array([100.0, -100.0, 50.0]))):
        Q = P.copy()
        Q[:, :, 3] = scale * P[:, :, 3] - np.einsum("vij,j->vi", P[:, :, :3], shift)
        Y, _ = point(answer, Q, uv)
        np.testing.assert_allclose(
            (Y - shift) / scale, X, atol=1e-6, err_msg="the answer depends on the world's frame"
        )


def test_the_covariance_is_that_of_many_draws(answer: ModuleType) -> None:
    """600 noises: NEES summed is chi-squared, 1800 degrees of freedom; 4.5 of its standard deviations."""
    P, sigma, draws = cameras(2), 0.3, 600
    rng, total, errors = np.random.default_rng(2), 0.0, []
    for _ in range(draws):
        X, cov = point(answer, P, pixels(P, POINT) + rng.normal(0, sigma, (2, 2)), sigma)
        errors.append(X - POINT)
        total += (X - POINT) @ np.linalg.solve(cov, X - POINT)
    spread = np.cov(np.array(errors).T)
    scatter, claimed = np.sqrt(np.diag(spread)), np.sqrt(np.diag(cov))
    told = f"the points scatter with standard deviations {scatter}, cov says {claimed}"
    assert abs(total / draws - 3) < 4.5 * np.sqrt(6 / draws), told
    np.testing.assert_allclose(cov, cov.T, rtol=1e-9, err_msg="a covariance is symmetric")
    ratio = np.diag(spread) / np.diag(cov)
    assert (np.abs(ratio - 1) < 0.3).all(), told


@pytest.mark.parametrize("count", [2, 4])
def test_rays_that_meet_behind_a_camera_are_told(answer: ModuleType, count: int) -> None:
    P = cameras(count)
    X, cov, reason = answer.triangulate(P, pixels(P, POINT - [0.0, 0.0, 8.0]), 1.0)
    assert reason == "behind", f"reason is {reason!r}; the pixels are those of a point behind the cameras"
    assert np.isfinite(X).all()
    assert not np.isnan(cov).any()


def test_rays_that_fix_no_point_are_told(answer: ModuleType) -> None:
    R, centre = turn(0.1, 0.2, 0.3), np.array([1.0, 2.0, 3.0])
    one = np.array([K @ np.c_[turn(a, 0, 0) @ R, -turn(a, 0, 0) @ R @ centre] for a in (0.0, 0.05)])
    ahead = centre + R.T @ [0.1, 0.2, 4.0]
    side = np.array([K @ np.c_[R, -R @ c] for c in (centre, centre + R.T @ [1.0, 0.0, 0.0])])
    for P, uv, what in (
        (one, pixels(one, ahead), "both cameras stand at one place"),
        (side, np.array([[330.0, 250.0], [330.0, 250.0]]), "the rays are parallel"),
    ):
        X, cov, reason = answer.triangulate(P, uv, 1.0)
        assert reason == "no depth", f"reason is {reason!r}; {what}"
        assert np.isfinite(X).all(), f"{what}: X is {X}"
        assert not np.isnan(cov).any()
