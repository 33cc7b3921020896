"""One picture to one pose: the motion so far, else the reference keyframe, else all keyframes; then the map.

::

    constant velocity -- points of the last picture, 12 px --.
    reference keyframe -- descriptors matched ---------------+-- pose -- points of the map, 5 px -- pose
    keyframes that look alike -- three points ---------------'
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.pose_tracking import TrackedPose
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.geometry import se3
from vslam_ref.geometry.camera_pose import DecayingVelocity
from vslam_ref.support.stopwatch import stage
from vslam_ref.systems.orbslam.feature_map import DescribedPicture, FeatureMap
from vslam_ref.systems.orbslam.settings import Settings
from vslam_ref.systems.orbslam.tracker.local_map import local_points
from vslam_ref.systems.orbslam.tracker.passes import FeaturePass, look_for, posed
from vslam_ref.systems.orbslam.tracker.relocalise import (
    Candidates,
    by_three_points,
    match_keyframe,
    most_matches,
)
from vslam_ref.systems.visual_map.telling import Quality, Told

NOTHING = np.zeros(0, np.int64)


class TrackedFeatures(NamedTuple):
    """What became of a picture.

    Attributes
    ----------
    T_cam_world : ndarray, shape (4, 4)
        The map's own unit.
    quality : Quality
    found : FeaturePass
        The last pass.
    way : str
        How the pose was found: ``velocity``, ``wide``, ``reference``, ``relocalised``.
    features : OrbFeatures
        Of the picture.
    """

    T_cam_world: Array
    quality: Quality
    found: FeaturePass
    way: str
    features: OrbFeatures

    @property
    def feature(self) -> IntArray:
        """Features that show a point and agree with the pose, (m,)."""
        return self.found.feature[self.found.held]

    @property
    def point(self) -> IntArray:
        """Points that these show, (m,)."""
        return self.found.point[self.found.held]

    def told(self) -> Told:
        """The same in a few words."""
        at = self.features
        uv, level = at.uv[self.feature], at.octave[self.feature]
        return Told(self.quality, self.way, len(self.found.tried), uv, level, float(self.found.pose.sigma))


@dataclass
class FeatureTracker:
    """What the tracker remembers: ``T_last (4, 4)``, the map's own unit, and ``points (n,)`` seen last."""

    settings: Settings
    rng: np.random.Generator
    T_last: Array
    points: IntArray = field(default_factory=lambda: NOTHING)
    reference: int = 0
    motion: DecayingVelocity = field(default_factory=lambda: DecayingVelocity(np.zeros(6), 1.0, 1.0))
    lost: int = 0
    candidates: Candidates = most_matches

    def track(self, feature_map: FeatureMap, picture: DescribedPicture) -> TrackedFeatures:
        """Find the pose of the next picture; the map is only read.

        Implements A§3.1, tracking.
        """
        found = None
        if self.lost == 0:
            found = self._predicted(feature_map, picture.features)
            if found is None:
                found = self._from_reference(feature_map, picture.features)
        if found is None and self.settings.tracker.relocalise:
            with stage("recover"):
                found = self._relocalised(feature_map, picture.features)
        found = found or self._nothing(picture.features)
        self._remember(feature_map, found)
        return found

    # --- ways to a pose -----------------------------------------------------------------------

    def _predicted(self, feature_map: FeatureMap, features: OrbFeatures) -> TrackedFeatures | None:
        """From the motion so far, and from twice as wide a search."""
        s, f = self.settings.tracker, self.settings.features
        T_guess = self.motion.predict(self.T_last)
        points = np.unique(feature_map.current(self.points))
        points = points[points >= 0]
        for way, wide in (("velocity", 1.0), ("wide", 2.0)):
            first = look_for(feature_map, points, features, T_guess, wide * s.radius, s, f)
            if first.inliers >= s.first_least:
                found = self._with_the_map(feature_map, features, first, way)
                if found.quality is not Quality.LOST:
                    return found
        return None

    def _from_reference(self, feature_map: FeatureMap, features: OrbFeatures) -> TrackedFeatures | None:
        """From matches with the reference keyframe, wherever they lie, and the last pose."""
        s, f = self.settings.tracker, self.settings.features
        shown = match_keyframe(feature_map, self.reference, features, f)
        first = posed(feature_map, shown.point, shown.point, shown.feature, features, self.T_last, s)
        if first.inliers < s.first_least:
            return None
        found = self._with_the_map(feature_map, features, first, "reference")
        return None if found.quality is Quality.LOST else found

    def _relocalised(self, feature_map: FeatureMap, features: OrbFeatures) -> TrackedFeatures | None:
        """From matches with keyframes that look like the picture, three at a time."""
        s, f = self.settings.tracker, self.settings.features
        for kf in self.candidates(feature_map, features, s.similar).tolist():
            shown = match_keyframe(feature_map, kf, features, f)
            agreed = by_three_points(feature_map, shown, features, self.rng)
            if agreed is None:
                continue
            feature, point = shown.feature[agreed.ok], shown.point[agreed.ok]
            first = posed(feature_map, point, point, feature, features, agreed.T_cam_world, s)
            if first.pose.reason:
                continue
            near = feature_map.measured_in(kf)
            more = look_for(feature_map, near, features, first.pose.T_cam_world, s.radius, s, f)
            found = self._with_the_map(feature_map, features, more, "relocalised")
            if found.found.inliers >= s.found_again and found.quality is not Quality.LOST:
                return found
        return None

    def _with_the_map(
        self, feature_map: FeatureMap, features: OrbFeatures, first: FeaturePass, way: str
    ) -> TrackedFeatures:
        """Look for all points around that the first pose shows, and judge."""
        s, f = self.settings.tracker, self.settings.features
        with stage("local map"):
            points = local_points(feature_map, first.point[first.held], s)
        found = look_for(feature_map, points, features, first.pose.T_cam_world, s.fine_radius, s, f)
        return TrackedFeatures(found.pose.T_cam_world, self._quality(found), found, way, features)

    def _quality(self, found: FeaturePass) -> Quality:
        """Judge by how many points agree, and how well."""
        s = self.settings.tracker
        if found.inliers < s.least_inliers or found.pose.sigma > s.worst_sigma:
            return Quality.LOST
        return Quality.GOOD if found.inliers >= s.good_inliers else Quality.POOR

    def _nothing(self, features: OrbFeatures) -> TrackedFeatures:
        pose = TrackedPose(self.T_last, np.zeros(0), np.inf, np.diag(np.full(6, np.inf)), "no pose was found")
        none = FeaturePass(NOTHING, NOTHING, NOTHING, pose)
        return TrackedFeatures(self.T_last, Quality.LOST, none, "none", features)

    # --- what is kept -------------------------------------------------------------------------

    def _remember(self, feature_map: FeatureMap, found: TrackedFeatures) -> None:
        """Go on from here; after a lost picture, from the last that was not."""
        if found.quality is Quality.LOST:
            self.lost += 1
            return
        if self.lost or found.way == "relocalised":
            self.motion = self.motion._replace(velocity=np.zeros(6))
        else:
            self.motion = self.motion.update(self.T_last, found.T_cam_world)
        self.T_last, self.points, self.lost = found.T_cam_world, found.point, 0
        self.reference = reference_keyframe(feature_map, found.point)

    def moved_map(self, T_before: Array, T_after: Array) -> None:
        """Go with a keyframe near by, whose pose (4, 4), the map's own unit, was changed."""
        self.T_last = se3.compose(se3.compose(self.T_last, se3.inverse(T_before)), T_after)


def reference_keyframe(feature_map: FeatureMap, points: IntArray) -> int:
    """Keyframe that sees most of these points (n,)."""
    table = feature_map.sightings
    wanted = np.zeros(len(feature_map.points), np.bool_)
    wanted[points] = True
    rows = np.flatnonzero(table["on"])
    rows = rows[wanted[table["point"][rows]]]
    return int(np.argmax(np.bincount(table["kf"][rows], minlength=len(feature_map.keyframes))))
