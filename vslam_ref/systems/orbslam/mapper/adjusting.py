"""Adjustments of the map: the newest keyframes, or all."""

from __future__ import annotations

import numpy as np

from vslam_ref.estimation.bundle import Options, Robust
from vslam_ref.estimation.robust import tuned
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.settings import Settings
from vslam_ref.systems.visual_map import Adjusted, adjust, local_active


def adjust_local(feature_map: FeatureMap, kf: int, settings: Settings) -> Adjusted:
    """Move a keyframe and those that share most points with it, with the points they see.

    Implements the choice of :eq:`eq-a2-9` by covisibility.
    """
    s = settings.mapper
    active = local_active(feature_map, kf, s.local - 1)
    return adjust(feature_map, robust(settings), active=active, options=options(s.local_steps))


def adjust_all(feature_map: FeatureMap, settings: Settings, steps: int) -> Adjusted:
    """Move everything but the first keyframe."""
    return adjust(feature_map, robust(settings), options=options(steps))


def robust(settings: Settings) -> Robust:
    """Tukey's loss, its scale from the errors."""
    return Robust(tuned("tukey", 2), "adaptive", settings.tracker.least_sigma)


def options(steps: int) -> Options:
    """End where another step would not be seen in a pixel."""
    return Options(cost=1e-4, scale=1e-2, max_iterations=max(steps, 1))


def median_depth(feature_map: FeatureMap, kf: int) -> float:
    """Median depth of the points that a keyframe sees, in the map's own unit; 1 if it sees none."""
    X = feature_map.X_world[feature_map.measured_in(kf)]
    T = feature_map.T_kf_world[kf]
    return float(np.median(X @ T[2, :3] + T[2, 3])) if len(X) else 1.0
