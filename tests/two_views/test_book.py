"""The book's plain form and the fast one give the same."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry.multiview import two_views
from vslam_ref.geometry.multiview.two_views import book


def lifted(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x, np.ones((len(x), 1))], axis=1)


def same(E: np.ndarray, F: np.ndarray) -> float:
    return float(min(np.abs(E - F).max(), np.abs(E + F).max()))


def test_five_points_give_the_same_matrices(pair) -> None:
    for seed in range(10):
        s = pair(np.random.default_rng(seed), 5)
        plain = book.five_point(lifted(s.a), lifted(s.b))
        fast = two_views.five_point_essentials([s.a], [s.b])
        E = fast.E[fast.valid]
        assert len(plain) == len(E)
        # the fast form polishes its answers, the plain one keeps what elimination and eigenvalues lose: 1e-7
        assert max(min(same(p, q) for q in E) for p in plain) < 1e-6


def test_eight_points_and_homographies_are_the_same(pair) -> None:
    s = pair(np.random.default_rng(1), 20, sigma_px=0.5)
    fast = two_views.linear_essential(s.a, s.b).E
    assert same(book.eight_point(lifted(s.a), lifted(s.b)), fast) < 1e-12
    plane = pair(np.random.default_rng(1), 20, "plane", sigma_px=0.5)
    plain = book.homography(lifted(plane.a), lifted(plane.b))
    np.testing.assert_allclose(plain, two_views.fit_homography(plane.a, plane.b), atol=1e-12)


@pytest.mark.parametrize("kind", ["space", "far"])
def test_motions_and_costs_are_the_same(pair, kind: str) -> None:
    s = pair(np.random.default_rng(2), 30, kind, sigma_px=1.0)
    E = two_views.linear_essential(s.a, s.b).E
    plain, fast = book.motions(E), two_views.essential_motions(E)
    for (R, t), T in zip(plain, fast, strict=True):
        np.testing.assert_allclose(R, T[:3, :3], atol=1e-14)
        np.testing.assert_allclose(t, T[:3, 3], atol=1e-14)
        squared = two_views.cheirality(T, s.a, s.b).squared
        costs = [book.cost(R, t, a, b) for a, b in zip(lifted(s.a), lifted(s.b), strict=True)]
        finite = np.isfinite(squared)  # the fast form gives up what is turned behind the camera
        np.testing.assert_allclose(np.array(costs)[finite], squared[finite], rtol=1e-9, atol=1e-20)


def test_consensus_finds_the_same_pairs(pair) -> None:
    s = pair(np.random.default_rng(3), 60, sigma_px=0.5, wrong=0.2)
    E = book.consensus(lifted(s.a), lifted(s.b), 1 / 500, 60, np.random.default_rng(0))
    fast = two_views.essential_consensus(s.a, s.b, np.random.default_rng(0), sigma=1 / 500)
    plain = two_views.essential_sampson(E, s.a, s.b) ** 2 <= 3.84 / 500**2
    assert np.mean(plain == fast.inliers) > 0.85  # different samples, each with its own noise
