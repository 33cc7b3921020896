"""Good, poor or lost, on passes that are made up."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.estimation.pose_tracking import TrackedPose
from vslam_ref.systems.ptam.settings import TrackerSettings
from vslam_ref.systems.ptam.tracker import book
from vslam_ref.systems.ptam.tracker.coarse_fine import Pass
from vslam_ref.systems.ptam.tracker.quality import found_per_level, quality
from vslam_ref.systems.visual_map import Visible

RULES = TrackerSettings()


def made(tried: tuple[int, ...], held: tuple[int, ...], sigma: float = 0.5, reason: str = "") -> Pass:
    """So many points tried and held on each level."""
    level = np.repeat(np.arange(len(tried)), tried)
    weights: Array = np.concatenate([np.arange(t) < h for t, h in zip(tried, held, strict=True)]).astype(
        float
    )
    n = len(level)
    seen = Visible(np.arange(n), np.zeros((n, 2)), np.ones(n), np.tile(np.eye(2), (n, 1, 1)), level)
    pose = TrackedPose(np.eye(4), weights[weights > 0], sigma, np.eye(6), reason)
    return Pass(seen, np.zeros((n, 2)), weights > 0, weights, pose)


CASES = [
    ("nearly all", (100, 50, 30, 20), (90, 45, 28, 18), "good"),
    ("a third", (100, 50, 30, 20), (30, 20, 10, 6), "good"),
    ("exactly 30 %", (100, 50, 30, 20), (30, 15, 9, 6), "poor"),
    ("a fifth", (100, 50, 30, 20), (20, 10, 6, 4), "poor"),
    ("few of the large, but many in all", (200, 0, 20, 10), (150, 0, 1, 0), "good"),
    ("few of all, but enough of the large", (400, 0, 20, 10), (20, 0, 10, 5), "poor"),
    ("few of the large and few of all", (200, 100, 30, 20), (15, 10, 3, 2), "lost"),
    ("hardly any large points were tried", (300, 100, 5, 4), (20, 10, 0, 0), "poor"),
    ("nineteen", (10, 5, 5, 2), (8, 5, 4, 2), "lost"),
    ("twenty", (10, 5, 5, 2), (9, 5, 4, 2), "good"),
]


@pytest.mark.parametrize(("name", "tried", "held", "expected"), CASES, ids=[c[0] for c in CASES])
def test_the_rules(name: str, tried: tuple[int, ...], held: tuple[int, ...], expected: str) -> None:
    """The same in the plain form."""
    fine = made(tried, held)
    assert quality(fine, RULES).value == expected
    assert book.quality(fine.weights.tolist(), fine.seen.level.tolist()) == expected


def test_a_pose_without_an_answer_or_with_large_errors_is_lost() -> None:
    tried, held = (100, 50, 30, 20), (90, 45, 28, 18)
    assert quality(made(tried, held, reason="the points do not determine the pose"), RULES).value == "lost"
    assert quality(made(tried, held, sigma=4.0), RULES).value == "good"
    assert quality(made(tried, held, sigma=4.1), RULES).value == "lost"
    assert made(tried, held, reason="none").inliers == 0


def test_counts_per_level() -> None:
    assert found_per_level(made((4, 3, 2), (1, 3, 0)), 4).tolist() == [[4, 1], [3, 3], [2, 0], [0, 0]]
