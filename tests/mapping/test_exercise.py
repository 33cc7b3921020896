"""Exercise 11.1: depth from two rays and its sigma, with the mistakes that are usually made."""

from __future__ import annotations

from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.geometry import so3

EXERCISE = "11_depth"


class Rays(NamedTuple):
    a: Array
    b: Array
    R_b_a: Array
    t_b_a: Array


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v))


R, T = so3.exp([0.1, -0.4, 0.2]), np.array([-0.5, 0.1, 0.2])


def to(X_a: list[float], R_b_a: Array = R, t_b_a: Array = T) -> Rays:
    """Rays of two cameras that see a point."""
    X = np.array(X_a)
    return Rays(unit(X), unit(R_b_a @ X + t_b_a), R_b_a, t_b_a)


@pytest.mark.parametrize("X", [[0.3, 0.2, 2.0], [-1.0, 0.5, 9.0], [0.1, -0.2, 0.7]])
def test_rays_that_meet(answer: ModuleType, X: list[float]) -> None:
    """The point's distances from both centres; rounding over the parallax squared stays below 1e-11."""
    expected = [np.linalg.norm(X), np.linalg.norm(R @ X + T)]
    rays = to(X)
    found = answer.depths(*rays)
    if np.allclose(answer.depths(rays.a, rays.b, R.T, -R.T @ T), expected, rtol=1e-6):
        pytest.fail("the pose is taken for its inverse: X_b = R_b_a X_a + t_b_a")
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_rays_that_pass_each_other(answer: ModuleType) -> None:
    """Along z, and along x through (-2, -0.2, 1) of a: nearest at 1 of the one and 2 of the other."""
    rays = Rays(np.array([0.0, 0, 1]), np.array([1.0, 0, 0]), np.eye(3), np.array([2.0, 0.2, -1.0]))
    np.testing.assert_allclose(answer.depths(*rays), [1.0, 2.0], atol=1e-12)
    away = rays._replace(a=-rays.a)
    np.testing.assert_allclose(answer.depths(*away), [-1.0, 2.0], atol=1e-12)


def meeting(r_a: float, centre_b: Array, turn_a: float, turn_b: float) -> float:
    """Distance along a's ray at which two lines of a plane (x, z) cross, each turned by a small angle."""

    def turned(v: Array, angle: float) -> Array:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])

    u = turned(np.array([0.0, 1.0]), turn_a)
    v = turned(np.array([0.0, r_a]) - centre_b, turn_b)
    return float((centre_b[0] * v[1] - centre_b[1] * v[0]) / (u[0] * v[1] - u[1] * v[0]))


@pytest.mark.parametrize("r_a", [0.8, 2.0, 7.0])
@pytest.mark.parametrize("centre", [[0.5, 0.1], [0.3, -0.4], [1.5, 0.9]])
def test_the_sigma_is_that_of_two_turned_rays(answer: ModuleType, r_a: float, centre: list[float]) -> None:
    """Derivatives of where two lines cross, by differences of 1e-5: good to 1e-6 of themselves."""
    centre_b, h = np.array(centre), 1e-5
    slope_a = (meeting(r_a, centre_b, h, 0) - meeting(r_a, centre_b, -h, 0)) / (2 * h)
    slope_b = (meeting(r_a, centre_b, 0, h) - meeting(r_a, centre_b, 0, -h)) / (2 * h)
    turn = so3.exp([0.2, -0.1, 0.3])
    rays = to([0.0, 0.0, r_a], turn, -turn @ [centre[0], 0.0, centre[1]])
    found = answer.depth_sigma(*rays, 0.002)
    if np.isclose(found, 0.002 * abs(slope_b), rtol=1e-4):
        pytest.fail("only the other ray errs: so does this one")
    assert found == pytest.approx(0.002 * np.hypot(slope_a, slope_b), rel=1e-5)


def test_twice_the_depth_is_four_times_the_sigma(answer: ModuleType) -> None:
    """Base line across the view, far away: corrections are of the order (B / Z)^2 = 1e-4."""
    near, far = (
        answer.depth_sigma(*to([0, 0, z], np.eye(3), np.array([-0.1, 0, 0])), 1e-3) for z in (10.0, 20.0)
    )
    assert far / near == pytest.approx(4.0, rel=1e-3)
    assert near == pytest.approx(np.sqrt(2) * 1e-3 * 100 / 0.1, rel=1e-3)


def test_what_becomes_a_point(answer: ModuleType) -> None:
    eps = 0.002
    good = to([0.2, 0.1, 2.0])
    assert answer.worth_a_point(*good, eps)
    assert not answer.worth_a_point(*good._replace(b=-good.b), eps), "behind b"
    assert not answer.worth_a_point(*good._replace(a=-good.a), eps), "behind a"
    assert not answer.worth_a_point(*to([0.2, 0.1, 90.0]), eps), "the depth is noise"
    sideways = unit(np.cross(good.R_b_a @ good.a, good.b))
    for share, expected in ((0.5, True), (2.0, False)):
        r_a, r_b = answer.depths(*good)
        gap = share * 3 * eps * np.hypot(r_a, r_b)
        passing = good._replace(t_b_a=good.t_b_a + gap * sideways)
        assert answer.worth_a_point(*passing, eps) is expected, f"a gap of {share} times the limit"


def test_parallel_rays_are_refused(answer: ModuleType) -> None:
    same = Rays(np.array([0.0, 0, 1]), np.array([0.0, 0, 1]), np.eye(3), np.array([-0.5, 0, 0]))
    assert answer.worth_a_point(*same, 0.001) is False
