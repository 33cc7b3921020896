"""The dominant plane: right frame, right points, and a reason where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry import se3
from vslam_ref.systems.visual_map import plane
from vslam_ref.systems.visual_map.plane import dominant_plane

NORMAL = np.array([0.36, 0.48, 0.8])


def floor(count: int, noise: float = 0.0, seed: int = 0, away: float = 3.0) -> np.ndarray:
    """Points (count, 3) of the plane n X = away, within 2 of its foot."""
    rng = np.random.default_rng(seed)
    across = np.linalg.svd(NORMAL[None])[2][1:]
    return (
        away * NORMAL + rng.uniform(-2, 2, (count, 2)) @ across + noise * rng.normal(size=(count, 1)) * NORMAL
    )


def cloud(count: int, seed: int = 1) -> np.ndarray:
    return 3 * NORMAL + np.random.default_rng(seed).uniform(-2, 2, (count, 3))


def found(X: np.ndarray, seed: int = 0, **more: float) -> plane.Plane:
    return dominant_plane(X, np.random.default_rng(seed), **more)


def test_a_plane_among_as_many_other_points_is_found_with_its_frame() -> None:
    """Exact points: the plane is off by the others within c = 0.1 of it, some 10 with a mean of up to 0.1
    each beside 200 points: 0.1 * 10 / 210 = 0.005, doubled by their larger votes.
    """
    X = np.concatenate([floor(200), cloud(200)])
    got = found(X, tolerance=0.1)
    assert got.reason == ""
    assert got.inliers[:200].all()
    assert got.inliers[200:].mean() < 0.15
    R = got.T_plane_world[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(R[2], -NORMAL, atol=0.01)  # to the side of the origin
    np.testing.assert_allclose(se3.act(got.T_plane_world, X[:200])[:, 2], 0.0, atol=0.02)
    assert se3.act(got.T_plane_world, np.zeros(3))[2] == pytest.approx(3.0, abs=0.02)
    assert R[0, 0] > 0.8  # x stays along the world's x, as far as the plane allows: sqrt(1 - 0.36^2) = 0.93


def test_without_other_points_it_is_the_plane_of_least_squares() -> None:
    """Oracle: the smallest eigenvector of their covariance.  Each point has a cell and a vote."""
    X = floor(60, noise=0.001)
    got = found(X, tolerance=0.01)
    assert len(np.unique(np.floor(X / 0.02), axis=0)) == 60
    assert got.inliers.all()
    values, vectors = np.linalg.eigh(np.cov(X.T))
    assert abs(got.T_plane_world[2, :3] @ vectors[:, 0]) == pytest.approx(1.0, abs=1e-12)
    height = se3.act(got.T_plane_world, X)[:, 2]
    assert np.mean(height**2) == pytest.approx(values[0] * 59 / 60, rel=1e-9)
    assert height.mean() == pytest.approx(0.0, abs=1e-13)


def test_no_plane_of_a_thousand_others_has_a_smaller_sum() -> None:
    """Planes near the found one, turned by up to 3 degrees and shifted: MSAC's sum must not be smaller.

    The end of the refits is a minimum of the sum among planes with the same points in, so one of another set
    could be better by a little: a hundredth is allowed.
    """
    X, c = np.concatenate([floor(150, noise=0.03), cloud(150)]), 0.1
    T = found(X, tolerance=c).T_plane_world
    rng = np.random.default_rng(5)

    vote = plane._votes(X, plane.CELL * c)

    def total(M: np.ndarray) -> float:
        return float(vote @ np.minimum(se3.act(M, X)[:, 2] ** 2, c**2))

    shake = rng.normal(size=(1000, 6)) * [0, 0, 0.03, 0.02, 0.02, 0]
    assert min(total(se3.exp(xi) @ T) for xi in shake) > 0.99 * total(T)


def test_the_larger_of_two_planes_wins() -> None:
    wall = floor(120) @ np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]) + [0.5, 0.2, 0.1]
    got = found(np.concatenate([wall, floor(240)]), tolerance=0.02)
    assert got.inliers[120:].all()
    assert got.inliers[:120].mean() < 0.1


def test_a_wide_plane_wins_over_one_through_three_clumps_with_more_points() -> None:
    """Textured things and a floor: 3 x 150 points in clumps of 0.02, and 150 in a plane 4 wide."""
    rng = np.random.default_rng(2)
    clumps = np.repeat([[2.0, 0, 1], [-1, 1, 2], [0, -2, 5]], 150, axis=0) + 0.02 * rng.normal(size=(450, 3))
    got = found(np.concatenate([floor(150, noise=0.01), clumps]), tolerance=0.05)
    assert got.inliers[:150].mean() > 0.95
    assert abs(got.T_plane_world[2, :3] @ NORMAL) > 0.999


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_the_unit_of_the_points_does_not_matter(scale: float) -> None:
    X = np.concatenate([floor(100, noise=0.01), cloud(60)])
    got, unit = found(scale * X), found(X)
    np.testing.assert_array_equal(got.inliers, unit.inliers)
    np.testing.assert_allclose(got.T_plane_world[:3, :3], unit.T_plane_world[:3, :3], atol=1e-9)
    np.testing.assert_allclose(got.T_plane_world[:3, 3], scale * unit.T_plane_world[:3, 3], rtol=1e-9)


def test_the_same_generator_gives_the_same_plane() -> None:
    X = np.concatenate([floor(100, noise=0.02), cloud(100)])
    np.testing.assert_array_equal(found(X, 3).T_plane_world, found(X, 3).T_plane_world)


def test_a_plane_across_the_x_axis_has_a_frame() -> None:
    X = floor(50)
    X[:, 0], X[:, 1:] = 2.0, np.random.default_rng(0).normal(size=(50, 2))
    R = found(X).T_plane_world[:3, :3]
    np.testing.assert_allclose(R, [[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]], atol=1e-9)


@pytest.mark.parametrize(
    ("X", "reason"),
    [
        (cloud(1000) * 3, "the best plane holds"),
        (floor(11), "the map has 11 points: need 12"),
        (np.zeros((0, 3)), "0 points"),
        (np.ones((40, 3)), "at one place"),
        (np.linspace(0, 1, 40)[:, None] * NORMAL, "on a line"),
    ],
)
def test_where_there_is_no_plane_a_reason_says_so(X: np.ndarray, reason: str) -> None:
    got = found(X)
    assert reason in got.reason
    assert not got.inliers.any()
    assert got.inliers.shape == (len(X),)
    np.testing.assert_array_equal(got.T_plane_world, np.eye(4))


@pytest.mark.parametrize(
    ("X", "more", "what"),
    [
        (np.zeros((4, 2)), {}, "X_world"),
        (np.full((20, 3), np.nan), {}, "finite"),
        (np.zeros(3), {}, r"\(N, 3\)"),
        (floor(20), {"tolerance": 0.0}, "tolerance"),
        (floor(20), {"tolerance": np.nan}, "tolerance"),
        (floor(20), {"draws": 0}, "draws"),
    ],
)
def test_bad_input_is_refused(X: np.ndarray, more: dict[str, float], what: str) -> None:
    with pytest.raises(ValueError, match=what):
        found(X, **more)
