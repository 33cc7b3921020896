"""Samples and the truncated cost: wrong pairs do no harm, and the number of draws keeps its promise."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry.multiview import essential_from_motion, two_views
from vslam_ref.geometry.multiview.two_views import Draws

SIGMA = 1 / 500


@pytest.mark.parametrize("wrong", [0.0, 0.3, 0.6])
def test_the_inliers_are_the_right_pairs(pair, wrong: float) -> None:
    rng = np.random.default_rng(int(10 * wrong))
    s = pair(rng, 200, sigma_px=0.5, wrong=wrong)
    found = two_views.essential_consensus(s.a, s.b, rng, sigma=SIGMA)
    right = np.arange(200) >= int(200 * wrong)
    assert found.reason == ""
    assert found.enough
    # noise of half of what sigma says: a right pair stays below 1.96 sigma; the sample's noise takes the rest
    assert found.inliers[right].mean() > 0.9
    # a wrong pair lies within two pixels of a line by chance: 4 of some 300 pixels; 5 % is far above
    assert not wrong or found.inliers[~right].mean() < 0.08


def test_a_plane_among_wrong_pairs_is_found(pair) -> None:
    rng = np.random.default_rng(1)
    s = pair(rng, 150, "plane", sigma_px=0.5, wrong=0.4)
    found = two_views.homography_consensus(s.a, s.b, rng, sigma=SIGMA)
    assert found.inliers[60:].mean() > 0.9
    assert found.inliers[:60].sum() <= 2


def test_same_generator_same_answer_and_other_batches_still_find_it(pair) -> None:
    s = pair(np.random.default_rng(2), 100, wrong=0.3)
    one, two = (
        two_views.essential_consensus(s.a, s.b, np.random.default_rng(7), sigma=SIGMA) for _ in range(2)
    )
    assert one.model.tobytes() == two.model.tobytes()
    assert one.draws == two.draws
    small = two_views.essential_consensus(
        s.a, s.b, np.random.default_rng(7), sigma=SIGMA, draws=Draws(batch=7)
    )
    assert small.inliers[30:].all()


def test_the_confidence_is_kept() -> None:
    """Of many runs with just the draws that 0.9 asks for, a tenth have no clean sample."""
    share, size, runs = 0.6, 5, 4000
    rng = np.random.default_rng(3)
    draws = int(np.ceil(two_views.draws_needed(share, size, 0.9)))
    clean = (rng.random((runs, draws, size)) < share).all(axis=2).any(axis=1)
    # at least 0.9 (rounded up); binomial, four standard deviations of 0.0047
    assert 0.9 - 0.019 < clean.mean() < 0.95
    assert two_views.draws_needed(1.0, 5, 0.99) == 0.0
    assert two_views.draws_needed(0.0, 5, 0.99) == np.inf


def test_the_truncated_cost_tells_models_with_equal_counts_apart(pair) -> None:
    """RANSAC counts; MSAC sees that one of two models with all inliers fits better."""
    s = pair(np.random.default_rng(4), 100, sigma_px=0.5)
    E = essential_from_motion(s.T_b_a)
    other = essential_from_motion(two_views.perturb(s.T_b_a, [0.02, 0, 0, 0, 0]))
    squared = np.array([two_views.essential_sampson(m, s.a, s.b) ** 2 for m in (E, other)]) / SIGMA**2
    most = 9.0
    assert (squared <= most).sum(axis=1).tolist() == [100, 100]
    costs = two_views.truncated_cost(squared, most)
    assert costs[0] < costs[1]


def test_too_few_pairs_and_hopeless_pairs_have_a_reason() -> None:
    rng = np.random.default_rng(5)
    few = two_views.essential_consensus(np.zeros((4, 2)), np.zeros((4, 2)), rng, sigma=SIGMA)
    assert few.reason == "4 pairs: need at least 5"
    same = two_views.essential_consensus(
        np.zeros((9, 2)), np.zeros((9, 2)), rng, sigma=SIGMA, draws=Draws(most=20)
    )
    assert "no model" in same.reason
    with pytest.raises(ValueError, match="sigma"):
        two_views.essential_consensus(np.zeros((9, 2)), np.zeros((9, 2)), rng, sigma=0.0)
    with pytest.raises(ValueError, match="confidence"):
        Draws(confidence=1.0)
