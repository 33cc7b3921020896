"""SO(3), SE(3), Sim(3) against their own definitions at 60 digits: relative error below 1e-14 (Frobenius).

The bound holds for all angles up to 2 pi, on both sides of the threshold, and in Sim(3) in all four regimes
of angle and log-scale.  The inverse of a left Jacobian has a pole at 2 pi: there its error is compared with
the condition.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import pytest

from vslam_ref.geometry import se2, se3, sim3, so3
from vslam_ref.geometry.coefficients import SMALL

BOUND = 1e-14
EPS = float(np.finfo(float).eps)
QUICK = (
    0.0,
    1e-200,
    1e-8,
    0.5,
    1 - EPS / 2,
    1 + EPS,
    3.0,
    np.pi - 1e-9,
    np.pi,
    4.0,
    2 * np.pi - 1e-9,
    2 * np.pi,
)
REGIMES = (0.0, -1e-12, 0.3, 1 + EPS, -3.0, 8.0)
GROUPS = {"so3": so3, "se3": se3, "sim3": sim3}


def tangent(exact: Any, name: str, angle: float, axis: np.ndarray, sigma: float = 0.0) -> np.ndarray:
    phi = angle * axis
    return np.concatenate([[], phi]) if name == "so3" else np.concatenate(
        [exact.rho, phi, [sigma] if name == "sim3" else []]
    )  # fmt: skip


def check(exact: Any, group: ModuleType, xi: np.ndarray, angle: float) -> None:
    T = exact.exp(xi)
    assert exact.error(group.exp(xi), T) < BOUND
    J = exact.left_jacobian(xi)
    assert exact.error(group.left_jacobian(xi), J) < BOUND
    if angle < 2 * np.pi:
        condition = np.linalg.cond(J.astype(float))
        off = exact.error(group.left_jacobian_inverse(xi), exact.inverse(J))
        assert off < 4 * EPS * condition
        assert off < BOUND or angle > 6.0
    rounded = T.astype(float)
    again = group.log(rounded)
    assert exact.error(rounded, exact.exp(again)) < BOUND
    assert np.linalg.norm(again if len(xi) == 3 else again[3:6]) <= np.pi * (1 + EPS)


@pytest.mark.parametrize("angle", QUICK)
@pytest.mark.parametrize("name", ["so3", "se3"])
def test_rotation_and_rigid_motion(exact: Any, name: str, angle: float) -> None:
    check(exact, GROUPS[name], tangent(exact, name, angle, exact.axes[1]), angle)


@pytest.mark.parametrize("sigma", REGIMES)
@pytest.mark.parametrize("angle", QUICK[1::2])
def test_similarity(exact: Any, angle: float, sigma: float) -> None:
    check(exact, sim3, tangent(exact, "sim3", angle, exact.axes[1], sigma), angle)


@pytest.mark.parametrize("share", [0.0, 1e-9, 0.6, 0.8, 1.0])
@pytest.mark.parametrize("side", [-3, -1, 0, 1, 4])
def test_similarity_on_both_sides_of_its_circle(exact: Any, share: float, side: int) -> None:
    """The threshold is a circle in the plane of log-scale and angle: its points, a few ulp in and out."""
    radius = SMALL * (1 + side * EPS)
    angle, sigma = share * radius, np.sqrt(1 - share**2) * radius
    check(exact, sim3, tangent(exact, "sim3", angle, exact.axes[0], sigma), angle)


def test_the_samples_lie_on_both_sides_of_the_threshold(exact: Any) -> None:
    """A sample that rounds onto the wrong side would leave a branch untested."""
    squares = np.array([np.sum((angle * exact.axes[0]) ** 2) for angle in exact.angles])
    near = squares[np.abs(squares - SMALL**2) < 1e-12]
    assert (near < SMALL**2).sum() >= 2
    assert (near >= SMALL**2).sum() >= 2


@pytest.mark.slow
@pytest.mark.parametrize("angle_index", range(29))
def test_everything_everywhere(exact: Any, angle_index: int) -> None:
    """All angles, axes and log-scales, 5 s an angle."""
    angle = exact.angles[angle_index]
    for axis in exact.axes:
        for name in ("so3", "se3"):
            check(exact, GROUPS[name], tangent(exact, name, angle, axis), angle)
        for sigma in exact.log_scales:
            check(exact, sim3, tangent(exact, "sim3", angle, axis, sigma), angle)


@pytest.mark.parametrize("seed", range(8))
def test_log_of_uniform_rotations(exact: Any, seed: int) -> None:
    """Uniform rotations lie near pi often: the density of the angle grows as 1 - cos."""
    T = se3.random(np.random.default_rng(seed))
    assert exact.error(T, exact.exp(se3.log(T))) < BOUND
    assert exact.error(T[:3, :3], exact.exp(so3.log(T[:3, :3]))) < BOUND
    S = sim3.random(np.random.default_rng(100 + seed), log_scale=2.0)
    assert exact.error(S, exact.exp(sim3.log(S))) < BOUND


@pytest.mark.parametrize("scale", [1e-200, 1e-9, 1e-3])
def test_log_of_a_tiny_rotation_keeps_all_digits(exact: Any, scale: float) -> None:
    """Relative to the vector itself: the matrix shows it in its antisymmetric part only."""
    phi = scale * np.array([0.3, -0.5, 0.8])
    assert np.abs(so3.log(so3.exp(phi)) / phi - 1).max() < 8 * EPS


@pytest.mark.parametrize("turn", [0.0, 1e-9, 1.0, 1 + EPS, 3.0, np.pi, 5.0])
def test_the_planes_jacobian_too(turn: float, exact: Any) -> None:
    """SE(2) is SE(3) with everything in one plane: rows and columns x, y, and the turn about z."""
    xi = np.array([1.3, -2.1, turn])
    J = exact.left_jacobian(np.array([1.3, -2.1, 0.0, 0.0, 0.0, turn]))[np.ix_([0, 1, 5], [0, 1, 5])]
    assert exact.error(se2.left_jacobian(xi), J) < BOUND
    assert exact.error(se2.left_jacobian_inverse(xi), exact.inverse(J)) < BOUND
    flat = exact.exp(np.array([1.3, -2.1, 0.0, 0.0, 0.0, turn]))[np.ix_([0, 1, 3], [0, 1, 3])]
    assert exact.error(se2.matrix(se2.exp(xi)), flat) < BOUND
