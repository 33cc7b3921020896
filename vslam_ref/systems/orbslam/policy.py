"""Which pictures become keyframes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.geometry import camera_pose, se3
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.settings import KeyframeSettings
from vslam_ref.systems.orbslam.tracker.tracker import TrackedFeatures


@dataclass
class CovisibilityPolicy:
    """Insert early, where the map begins to end: what proves redundant is culled later.

    Implements A§3.1, the choice of keyframes.
    """

    settings: KeyframeSettings
    since: int = 0
    best: int = 0

    def wants(self, feature_map: FeatureMap, tracked: TrackedFeatures) -> bool:
        """Whether this picture, tracked now, shall be a keyframe; call it once for each picture."""
        s, inliers = self.settings, len(tracked.point)
        self.since += 1
        self.best = max(self.best, inliers)
        if inliers < s.least_inliers or self.since < s.gap:
            return False
        if inliers < s.fewer * self.best:
            return True
        return self.since >= s.most and distance(feature_map, tracked) > s.distance

    def taken(self) -> None:
        """Begin anew: this picture became a keyframe."""
        self.since = self.best = 0


def distance(feature_map: FeatureMap, tracked: TrackedFeatures) -> float:
    """Ratio of the distance to the nearest keyframe and the median depth of what was seen; no unit."""
    T = tracked.T_cam_world
    depth = float(np.median(se3.act(T, feature_map.X_world[tracked.point])[:, 2]))
    centres = camera_pose.centre_from_pose(feature_map.T_kf_world[feature_map.used_keyframes()])
    return float(np.linalg.norm(centres - camera_pose.centre_from_pose(T), axis=1).min() / depth)
