"""Sampson distances: what they approximate, of lines and of maps, and the five numbers of a motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from vslam_ref.geometry import so3
from vslam_ref.geometry.multiview import correct_pair, essential_from_motion, sampson_distance, two_views


def test_the_distance_is_that_of_the_first_chapter_and_of_the_optimum(pair) -> None:
    s = pair(np.random.default_rng(0), 50, sigma_px=1.0)
    E = essential_from_motion(s.T_b_a)
    ours = two_views.sampson(s.T_b_a, s.a, s.b)[:, 0]
    np.testing.assert_allclose(ours, sampson_distance(E, s.a, s.b), atol=1e-15)
    np.testing.assert_allclose(ours, two_views.essential_sampson(E, s.a, s.b), atol=1e-15)
    # first order: the error of the square is of the third order in noise over the distance to the epipole
    exact = np.sqrt(correct_pair(E, s.a, s.b).cost)
    far_from_it = np.abs(ours) > 1e-6
    assert np.median(np.abs(np.abs(ours) / exact - 1)[far_from_it]) < 1e-3


def test_the_distance_from_a_map_is_the_nearest_pair_that_fits(pair) -> None:
    """Against a numeric minimisation of |dx_a|^2 + |dx_b|^2 under x_b = H x_a."""
    s = pair(np.random.default_rng(1), 6, "plane", sigma_px=1.0)
    exact = pair(np.random.default_rng(1), 6, "plane")
    H = two_views.fit_homography(exact.a, exact.b)
    squared = np.sum(two_views.homography_sampson(H, s.a, s.b) ** 2, axis=1)
    for j in range(6):

        def cost(x: np.ndarray, j: int = j) -> float:
            y = two_views.apply_homography(H, x[None])[0]
            return float(1e6 * (np.sum((x - s.a[j]) ** 2) + np.sum((y - s.b[j]) ** 2)))

        best = minimize(cost, s.a[j], tol=1e-14).fun / 1e6
        assert squared[j] == pytest.approx(
            best, rel=0.02
        )  # first order: noise 2e-3 times the map's curvature


def test_a_point_sent_behind_the_camera_is_infinitely_far() -> None:
    H = so3.exp([0.0, np.pi, 0.0])
    assert np.isinf(two_views.homography_sampson(H, [[0.0, 0.0]], [[0.0, 0.0]])).all()


def test_the_five_numbers_keep_the_sphere_and_the_rotation(pair) -> None:
    s = pair(np.random.default_rng(2), 5)
    delta = np.array([0.3, -0.2, 0.1, 0.4, -0.5])
    T = two_views.perturb(s.T_b_a, delta)
    assert np.linalg.norm(T[:3, 3]) == pytest.approx(1.0, abs=1e-15)
    angle = np.arccos(T[:3, 3] @ s.T_b_a[:3, 3])
    assert angle == pytest.approx(np.hypot(0.3, 0.2), abs=1e-12)
    np.testing.assert_allclose(so3.log(T[:3, :3] @ s.T_b_a[:3, :3].T), delta[2:], atol=1e-12)
    with pytest.raises(ValueError, match="no translation"):
        two_views.sampson(np.eye(4), s.a, s.b)
