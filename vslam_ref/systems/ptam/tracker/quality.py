"""Is the pose to be believed?  Good, poor (no keyframe may be made of it), or lost."""

from __future__ import annotations

import numpy as np

from vslam_ref.systems.ptam.settings import TrackerSettings
from vslam_ref.systems.ptam.tracker.coarse_fine import Pass
from vslam_ref.systems.visual_map.telling import Quality

__all__ = ["Quality", "found_per_level", "quality"]


def quality(fine: Pass, settings: TrackerSettings) -> Quality:
    """Judge the fine pass: how many were found of those tried, how many agree, and how well.

    Implements :eq:`eq-quality`, the frame that is rejected in A§2.2.1.
    """
    if fine.pose.reason or fine.inliers < settings.least_inliers or fine.pose.sigma > settings.worst_sigma:
        return Quality.LOST
    held = fine.weights > 0
    large = fine.seen.level >= 2
    share = held.mean()
    if large.sum() >= 10 and max(held[large].mean(), share) < settings.lost:
        return Quality.LOST
    return Quality.GOOD if share > settings.good else Quality.POOR


def found_per_level(fine: Pass, levels: int) -> np.ndarray:
    """Points tried and found on each level, (levels, 2): counts, no unit."""
    tried = np.bincount(fine.seen.level, minlength=levels)
    return np.stack([tried, np.bincount(fine.seen.level[fine.weights > 0], minlength=levels)], 1)
