"""Epipolar geometry and the global optimum for two views."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.geometry import se3
from vslam_ref.geometry.multiview import (
    Views,
    correct_pair,
    epipolar_distance,
    essential_from_motion,
    fundamental_from_essential,
    midpoint,
    relative_motion,
    sampson_distance,
)

EPS = float(np.finfo(float).eps)
K_A = np.array([[500.0, 0.0, 320.0], [0.0, 520.0, 240.0], [0.0, 0.0, 1.0]])
K_B = np.array([[610.0, 0.0, 300.0], [0.0, 600.0, 250.0], [0.0, 0.0, 1.0]])


def motion(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return se3.exp([*rng.normal(size=3), *rng.normal(scale=0.3, size=3)])


def fundamental(T_b_a: np.ndarray) -> np.ndarray:
    return fundamental_from_essential(essential_from_motion(T_b_a), K_A, K_B)


def pixels(K: np.ndarray, X: np.ndarray) -> np.ndarray:
    h = X @ K.T
    return h[:, :2] / h[:, 2:]


@pytest.mark.parametrize("seed", range(4))
def test_pixels_of_one_point_fit(seed: int) -> None:
    T_b_a = motion(seed)
    X = np.random.default_rng(seed).uniform(-1, 1, (50, 3)) + [0, 0, 5]
    F = fundamental(T_b_a)
    a, b = pixels(K_A, X), pixels(K_B, se3.act(T_b_a, X))
    # F is made of products of E with 1/f, the pixels are up to 1000: some 1000 eps in pixels
    assert np.abs(epipolar_distance(F, a, b)).max() < 1e-10
    assert np.abs(sampson_distance(F, a, b)).max() < 1e-10
    assert np.abs(epipolar_distance(F.T, a, b)).max() > 1.0  # a transpose is seen


def test_the_essential_matrix_is_of_two_equal_singular_values() -> None:
    T_world = [se3.exp([0.3, 1.0, -2.0, 0.4, 0.2, -0.6]), se3.exp([1.3, -0.4, 0.5, -0.1, 0.7, 0.2])]
    T_b_a = relative_motion(*T_world)
    s = np.linalg.svd(essential_from_motion(T_b_a), compute_uv=False)
    length = np.linalg.norm(T_b_a[:3, 3])
    np.testing.assert_allclose(s, [length, length, 0.0], atol=8 * EPS * length)
    X = np.array([0.2, 0.3, 7.0])
    np.testing.assert_allclose(se3.act(T_b_a, se3.act(T_world[0], X)), se3.act(T_world[1], X), atol=1e-14)


def test_distance_to_the_epipolar_line_is_the_distance_to_two_of_its_points() -> None:
    """The line is drawn through the images of two points on the ray of uv_a."""
    T_b_a, uv_a, uv_b = motion(1), np.array([200.0, 300.0]), np.array([350.0, 100.0])
    ray = np.linalg.solve(K_A, np.array([*uv_a, 1.0]))
    p, q = pixels(K_B, se3.act(T_b_a, np.array([2.0 * ray, 5.0 * ray])))
    along = (q - p) / np.linalg.norm(q - p)
    across = abs((uv_b - p) @ np.array([-along[1], along[0]]))
    assert abs(epipolar_distance(fundamental(T_b_a), uv_a, uv_b)) == pytest.approx(across, rel=1e-10)


def test_sampsons_distance_is_the_optimum_to_first_order() -> None:
    """Its error shrinks with the square of the distance: halving the noise quarters the relative error."""
    T_b_a = motion(2)
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (60, 3)) + [0, 0, 5]
    a, b = pixels(K_A, X), pixels(K_B, se3.act(T_b_a, X))
    shift = rng.normal(size=(2, 60, 2))
    off = []
    for size in (2.0, 1.0):
        best = correct_pair(fundamental(T_b_a), a + size * shift[0], b + size * shift[1]).cost
        first = sampson_distance(fundamental(T_b_a), a + size * shift[0], b + size * shift[1]) ** 2
        off.append(np.median(np.abs(first / best - 1)))
    assert off[1] < 0.01
    assert 1.5 < off[0] / off[1] < 4.5


def scan(F: np.ndarray, a: np.ndarray, b: np.ndarray, lines: int = 20001) -> float:
    """Smallest cost over a dense fan of epipolar lines, refined once around the best: no polynomial."""
    epipole = np.linalg.svd(F)[2][2]

    def cost(angle: np.ndarray) -> np.ndarray:
        far = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)  # where the line meets infinity
        through = epipole + 0 * far
        line_a = np.cross(through, far)
        line_b = far @ F.T
        ha, hb = np.array([*a, 1.0]), np.array([*b, 1.0])
        distance = [
            (line @ h) ** 2 / (line[:, 0] ** 2 + line[:, 1] ** 2) for line, h in ((line_a, ha), (line_b, hb))
        ]
        return distance[0] + distance[1]

    angle = np.linspace(0, np.pi, lines)
    best = angle[np.nanargmin(cost(angle))]
    return float(np.nanmin(cost(best + np.linspace(-2, 2, lines) * np.pi / lines)))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("wild", [False, True], ids=["near", "anywhere"])
def test_the_optimum_is_global(seed: int, wild: bool) -> None:
    """No epipolar line of a dense fan is better, also for pixels that have nothing to do with each other."""
    T_b_a = [motion(3), motion(4), se3.exp([0, 0, -1.0, 0.02, 0.01, 0]), motion(5), motion(6)][seed]
    rng, F = np.random.default_rng(seed), fundamental(T_b_a)
    a = rng.uniform(0, 640, (12, 2))
    ray = np.c_[a, np.ones(12)] @ np.linalg.inv(K_A).T
    b = (
        rng.uniform(0, 640, (12, 2))
        if wild
        else pixels(K_B, se3.act(T_b_a, 5 * ray)) + rng.normal(0, 2, (12, 2))
    )
    found = correct_pair(F, a, b)
    for n in range(12):
        # a fan of 4e8 lines resolves the minimum to a relative (1e-8)^2 x curvature; near an epipole 1e-6
        assert found.cost[n] <= scan(F, a[n], b[n]) * (1 + 1e-9) + 1e-9
    moved = ((found.uv_a - a) ** 2).sum(1) + ((found.uv_b - b) ** 2).sum(1)
    np.testing.assert_allclose(moved, found.cost, rtol=1e-6, atol=1e-12)
    assert np.abs(sampson_distance(F, found.uv_a, found.uv_b)).max() < 1e-8


def test_rectified_pairs_and_perfect_pairs_are_no_trouble() -> None:
    rows = fundamental_from_essential(essential_from_motion(se3.exp([-1.0, 0, 0, 0, 0, 0])), K_A, K_A)
    a = np.array([[100.0, 50.0], [300.0, 200.0], [10.0, 400.0]])
    b = a + [[-20.0, 0.0], [-5.0, 1.0], [-60.0, -3.0]]
    found = correct_pair(rows, a, b)
    np.testing.assert_allclose(found.cost, [0.0, 0.5, 4.5], atol=1e-10)
    np.testing.assert_allclose(found.uv_a[:, 1], (a[:, 1] + b[:, 1]) / 2, atol=1e-9)


def test_the_search_for_a_point_finds_the_global_optimum(make: Callable[..., Any]) -> None:
    """Levenberg-Marquardt from the linear point, and a polynomial of degree six: one minimum, two ways."""
    scene = make("pinhole", views=2, points=200)
    uv = scene.uv + np.random.default_rng(3).normal(0, 1.0, scene.uv.shape)
    K = scene.views.each[0].matrix
    F = fundamental_from_essential(essential_from_motion(relative_motion(*scene.views.T_cam_world)), K, K)
    best = correct_pair(F, uv[:, 0], uv[:, 1])
    found = triangulate(scene.views, uv)
    # the search stops 1e-8 standard deviations from the minimum, where the cost is flat
    np.testing.assert_allclose(2 * found.rmse_px**2, best.cost, rtol=1e-9, atol=1e-18)
    met = scene.views.project(found.X_world).uv
    np.testing.assert_allclose(met[:, 0], best.uv_a, atol=1e-6)


def test_the_midpoint_is_on_the_common_perpendicular() -> None:
    rng = np.random.default_rng(4)
    p_a, b_a, p_b, b_b = rng.normal(size=(4, 20, 3))
    X = midpoint(p_a, b_a, p_b, b_b)
    across = np.cross(b_a, b_b)
    for p, b in ((p_a, b_a), (p_b, b_b)):
        foot = p + b * (np.sum((X - p) * b, 1) / np.sum(b * b, 1))[:, None]
        # X - foot is along the common perpendicular
        turned = np.cross(X - foot, across)
        assert np.abs(turned).max() < 1e-11 * np.abs(across).max() * (1 + np.abs(X).max())
    with pytest.raises(ValueError, match="parallel"):
        midpoint([0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 0, 2])
    with pytest.raises(ValueError, match="b_b: a direction must be finite"):
        midpoint([0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 0, 0])


def test_the_midpoint_is_not_the_optimum(make: Callable[..., Any]) -> None:
    """It measures metres where the noise is in pixels: beside a near camera a far one should count little.

    Height y is seen by both, from 1.5 and 9.5 away.  The mean of both heights has the variance
    (1.5^2 + 9.5^2)/4 = 23 (pixel angles)^2, the weighted mean 1/(1/1.5^2 + 1/9.5^2) = 2.2.
    """
    X = np.array([[0.0, 0.0, 1.5]])
    side = se3.from_rt(se3.rotation(se3.exp([0, 0, 0, 0, np.pi / 2, 0])), np.zeros(3))
    T = np.array([se3.identity(), se3.compose(side, se3.exp([0, 0, -1.5, 0, 0, 0]))])
    T[1, 2, 3] += 9.5
    views = Views(make("pinhole").views.cameras, T)
    uv = views.project(X).uv + np.random.default_rng(5).normal(0, 1.0, (4000, 2, 2))
    world = np.einsum("vji,nvj->nvi", T[:, :3, :3], views.rays(uv).bearing)
    middle = midpoint(views.centres[0], world[:, 0], views.centres[1], world[:, 1])
    best = triangulate(views, uv).X_world
    errors = [np.mean(found[:, 1] ** 2) for found in (middle, best)]
    # a ratio of variances of 4000 draws is known to 4.5 %: 20 % are more than four standard deviations
    assert errors[0] / errors[1] == pytest.approx(23.125 / 2.195, rel=0.2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((np.eye(3), np.zeros((2, 2)), np.zeros((3, 2))), "need"),
        ((np.full((3, 3), np.nan), np.zeros((2, 2)), np.zeros((2, 2))), "must be finite"),
        ((np.zeros((3, 3)), np.zeros((2, 2)), np.zeros((2, 2))), "F is zero"),
    ],
)
def test_bad_pairs_are_refused(arguments: tuple[Any, ...], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        correct_pair(*arguments)


def test_at_the_epipole_there_is_no_line() -> None:
    F = essential_from_motion(se3.exp([0, 0, -1.0, 0, 0, 0]))  # epipoles in the middle
    assert epipolar_distance(F, [0.0, 0.0], [0.3, 0.1]) == 0.0
    assert np.isfinite(correct_pair(F, [[0.0, 0.0]], [[0.3, 0.1]]).cost).all()
