"""Which pictures become keyframes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.geometry import camera_pose
from vslam_ref.systems.ptam.settings import KeyframeSettings
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.systems.ptam.tracker.tracker import Tracked
from vslam_ref.systems.visual_map import VisualMap


@dataclass
class KeyframePolicy:
    """Time, distance and quality; and never starve the map.

    Implements A§2.2.2.1, the choice of keyframes.
    """

    settings: KeyframeSettings
    since: int = 0
    best: int = 0

    def wants(self, visual_map: VisualMap, tracked: Tracked) -> bool:
        """Whether this picture, tracked now, shall be a keyframe; call it once for each picture."""
        s = self.settings
        self.since += 1
        inliers = tracked.fine.inliers
        self.best = max(self.best, inliers)
        enough = (Quality.GOOD,) if s.good_only else (Quality.GOOD, Quality.POOR)
        may = tracked.quality in enough and inliers >= s.least_inliers
        wait = s.gap if inliers >= s.starving else s.gap_starving
        if not may or tracked.pose.sigma > s.worst_sigma or self.since < wait:
            return False
        away = distance(visual_map, tracked)
        few = inliers < s.fewer * self.best and away > s.distance
        return bool(few or inliers < s.much_fewer * self.best or away > s.far)

    def taken(self) -> None:
        """Begin anew: this picture became a keyframe."""
        self.since = self.best = 0


def distance(visual_map: VisualMap, tracked: Tracked) -> float:
    """Ratio of the distance to the nearest keyframe and the median depth of what was seen; no unit."""
    seen = tracked.fine.seen
    depth = float(np.median(seen.depth[tracked.fine.weights > 0]))
    centres = camera_pose.centre_from_pose(visual_map.T_kf_world)
    away = np.linalg.norm(centres - camera_pose.centre_from_pose(tracked.T_cam_world), axis=1)
    return float(away.min() / depth)
