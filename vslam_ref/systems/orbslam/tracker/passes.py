"""Looking for points of the map in a picture, and the pose that they give."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.pose_tracking import TrackedPose, track_pose
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.support.stopwatch import stage
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.projection import expected, find
from vslam_ref.systems.orbslam.settings import FeatureSettings, TrackerSettings


class FeaturePass(NamedTuple):
    """Points that were looked for in a picture, and the pose.

    Attributes
    ----------
    tried : ndarray of int64, shape (n,)
        Points that were expected.
    point, feature : ndarray of int64, shape (m,)
        Points that were found, and the features that show them; numbers without a unit.
    pose : TrackedPose
        With the weights (m,).
    """

    tried: IntArray
    point: IntArray
    feature: IntArray
    pose: TrackedPose

    @property
    def held(self) -> IntArray:
        """Rows of those that have weight."""
        return np.flatnonzero(self.pose.weights > 0)

    @property
    def inliers(self) -> int:
        """Points with weight; 0 without a pose."""
        return 0 if self.pose.reason else int(np.count_nonzero(self.pose.weights > 0))


def look_for(
    feature_map: FeatureMap,
    points: IntArray,
    features: OrbFeatures,
    T_guess: Array,
    radius: float,
    s: TrackerSettings,
    f: FeatureSettings,
) -> FeaturePass:
    """Look for points (n,) where a pose (4, 4) puts them, in pixels of their octave; improve the pose."""
    with stage("search"):
        at = expected(feature_map, points, T_guess)
        feature = find(feature_map, at, features, radius=radius, limit=f.far, ratio=s.ratio)
    rows = np.flatnonzero(feature >= 0)
    return posed(feature_map, at.point, at.point[rows], feature[rows], features, T_guess, s)


def posed(
    feature_map: FeatureMap,
    tried: IntArray,
    point: IntArray,
    feature: IntArray,
    features: OrbFeatures,
    T_guess: Array,
    s: TrackerSettings,
) -> FeaturePass:
    """Pose from features that show points, near a guess.

    ``feature (m,)`` shows ``point (m,)``; ``tried (n,)`` is only passed on.  The guess ``T_guess (4, 4)``
    is in the map's own unit.
    """
    with stage("pose"):
        pose = track_pose(
            feature_map.camera,
            feature_map.X_world[point],
            features.uv[feature],
            T_guess,
            sigma_px=feature_map.level_sigma(features.octave[feature]),
            steps=s.steps,
            least_sigma=s.least_sigma,
        )
    return FeaturePass(tried, point, feature, pose)
