"""A pose without a guess: descriptors matched with those of keyframes, three points, and the map around."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.estimation.three_point_pose import AgreedPose, pose_by_three_points
from vslam_ref.features import hamming
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.settings import FeatureSettings

RATIO = 0.75
"""Of the best to the second distance; ORB-SLAM's."""

Candidates = Callable[[FeatureMap, OrbFeatures, int], IntArray]
"""From a map, the features of a picture and a number: so many keyframes that look like it, the best first."""


class ShownPoints(NamedTuple):
    """Features ``feature (m,)`` of a picture that show ``point (m,)``; numbers without a unit."""

    feature: IntArray
    point: IntArray


def match_keyframe(
    feature_map: FeatureMap, kf: int, features: OrbFeatures, f: FeatureSettings
) -> ShownPoints:
    """Match a picture's features with those of a keyframe that show points, wherever they are."""
    rows = feature_map.rows_in(kf)
    seen = feature_map.sightings
    pairs = hamming.match(features.descriptor, seen["descriptor"][rows], ratio=RATIO, limit=f.near)
    return ShownPoints(pairs.first, seen["point"][rows[pairs.second]])


def most_matches(feature_map: FeatureMap, features: OrbFeatures, count: int) -> IntArray:
    """Keyframes (count,) with most matches, by comparing with all."""
    used = feature_map.used_keyframes()
    f = FeatureSettings()
    matches = np.array([len(match_keyframe(feature_map, int(kf), features, f).point) for kf in used])
    return np.asarray(used[np.argsort(-matches, kind="stable")[:count]])


def by_three_points(
    feature_map: FeatureMap, shown: ShownPoints, features: OrbFeatures, rng: np.random.Generator
) -> AgreedPose | None:
    """Pose with which most matches agree, the map's own unit; None if too few do."""
    sigma = feature_map.level_sigma(features.octave[shown.feature])
    X = feature_map.X_world[shown.point]
    return pose_by_three_points(feature_map.camera, X, features.uv[shown.feature], rng, sigma_px=sigma)
