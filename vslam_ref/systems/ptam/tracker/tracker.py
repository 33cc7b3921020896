"""One picture to one pose: guesses, a coarse pass, a fine pass, and what to do when all that fails."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.pose_tracking import TrackedPose
from vslam_ref.features import plane_motion, rotation
from vslam_ref.geometry import se3
from vslam_ref.geometry.camera_pose import DecayingVelocity
from vslam_ref.support.stopwatch import stage
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker import recover
from vslam_ref.systems.ptam.tracker.coarse_fine import Pass, coarse, fine
from vslam_ref.systems.ptam.tracker.quality import Quality, quality
from vslam_ref.systems.visual_map import PreparedPicture, Visible, VisualMap
from vslam_ref.systems.visual_map.telling import Told


class Tracked(NamedTuple):
    """What became of a picture.

    Attributes
    ----------
    T_cam_world : ndarray, shape (4, 4)
        World to camera, in the map's unit of length, which is metres only if the map is.
    quality : Quality
    fine : Pass
        With the points that were looked for.
    way : str
        How the pose was found: ``velocity``, ``small image``, ``wide``, ``followed``, ``relocalised``.
    """

    T_cam_world: Array
    quality: Quality
    fine: Pass
    way: str

    @property
    def pose(self) -> TrackedPose:
        """Of the fine pass."""
        return self.fine.pose

    def told(self) -> Told:
        """The same in a few words."""
        fine = self.fine
        held = fine.weights > 0
        tried, at = len(fine.seen.point), fine.seen.level[held]
        return Told(self.quality, self.way, tried, fine.uv[held], at, float(self.pose.sigma))


@dataclass
class Tracker:
    """What the tracker remembers; T_last (4, 4) is the last pose, in the map's own metres."""

    settings: Settings
    rng: np.random.Generator
    motion: DecayingVelocity
    T_last: Array
    last: PreparedPicture | None = None
    known: recover.Known | None = None
    lost: int = 0

    def track(self, visual_map: VisualMap, picture: PreparedPicture) -> Tracked:
        """Find the pose of the next picture; the map is only read.

        Implements A§2.2.1, tracking in two passes.
        """
        found = self._predicted(visual_map, picture) if self.lost == 0 else None
        if found is None or found.quality is Quality.LOST:
            with stage("recover"):
                found = self._recovered(visual_map, picture) or found
        if found is None:
            found = self._nothing()
        self._remember(picture, found)
        return found

    def _nothing(self) -> Tracked:
        none = Visible(np.zeros(0, int), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 2, 2)), np.zeros(0, int))
        pose = TrackedPose(self.T_last, np.zeros(0), np.inf, np.diag(np.full(6, np.inf)), "no pose was found")
        nowhere = Pass(none, np.zeros((0, 2)), np.zeros(0, bool), np.zeros(0), pose)
        return Tracked(self.T_last, Quality.LOST, nowhere, "none")

    def _predicted(self, visual_map: VisualMap, picture: PreparedPicture) -> Tracked | None:
        """From a guess: the coarse pass tells whether it was good."""
        s = self.settings.tracker
        best: tuple[int, Array, str] | None = None
        for way, T_guess, radius in self._guesses(visual_map, picture):
            with stage("coarse"):
                first = coarse(
                    visual_map, picture, T_guess, radius, s, self.settings.features.looks, self.rng
                )
            if best is None or first.inliers > best[0]:
                best = first.inliers, first.pose.T_cam_world, way
            agree = first.inliers / max(len(first.seen.point), 1)
            if first.inliers >= s.coarse_least and agree >= s.coarse_agree:
                break
        if best is None:
            return None
        return self._finely(visual_map, picture, best[1], s.fine_radius, best[2])

    def _finely(
        self, visual_map: VisualMap, picture: PreparedPicture, T: Array, radius: float, way: str
    ) -> Tracked:
        s = self.settings.tracker
        with stage("fine"):
            second = fine(visual_map, picture, T, radius, s, self.settings.features.looks, self.rng)
        return Tracked(second.pose.T_cam_world, quality(second, s), second, way)

    def _guesses(self, visual_map: VisualMap, picture: PreparedPicture) -> Iterator[tuple[str, Array, float]]:
        """Guesses of the pose, each with the radius in which to look."""
        radius = self.settings.tracker.radius
        yield "velocity", self.motion.predict(self.T_last), radius[0]
        if self.last is None or not self.settings.tracker.small_image:
            return
        with stage("guess"):
            turned = self._turned(visual_map, picture, self.last)
        yield "small image", turned, radius[1]
        yield "wide", turned, radius[2]

    def _turned(self, visual_map: VisualMap, picture: PreparedPicture, last: PreparedPicture) -> Array:
        """Return the last pose, turned as the small images say."""
        moved = plane_motion(last.small, picture.small)
        if moved.reason:
            return self.T_last
        shape = last.small.value.shape
        R = rotation(visual_map.camera, (shape[0], shape[1]), picture.small.level, moved.T_b_a)
        return se3.compose(se3.from_rt(R, np.zeros(3)), self.T_last)

    def _recovered(self, visual_map: VisualMap, picture: PreparedPicture) -> Tracked | None:
        """Follow patches from the last picture that was tracked, else from the keyframes most alike."""
        s = self.settings.tracker
        if s.follow and self.lost == 0 and self.last is not None and self.known is not None:
            found = self._from(visual_map, picture, self.last, self.known, "followed")
            if found is not None:
                return found
        for kf in recover.most_alike(visual_map, picture, s.similar if s.relocalise else 0):
            there = recover.picture_of(visual_map, int(kf))
            known = recover.known_in(visual_map, int(kf))
            found = self._from(visual_map, picture, there, known, "relocalised")
            if found is not None:
                return found
        return None

    def _from(
        self,
        visual_map: VisualMap,
        picture: PreparedPicture,
        there: PreparedPicture,
        known: recover.Known,
        way: str,
    ) -> Tracked | None:
        s = self.settings.tracker
        alive = visual_map.alive[known.point]
        known = recover.Known(known.point[alive], known.uv[alive], known.level[alive])
        went = recover.follow_known(there, picture, known, s.radius[-1])
        X = visual_map.X_world[went.point]
        agreed = recover.by_three_points(visual_map.camera, X, went, self.rng)
        if agreed is None:
            return None
        first = self._finely(visual_map, picture, agreed.T_cam_world, 2 * s.fine_radius, way)
        if first.pose.reason:
            return None
        found = self._finely(visual_map, picture, first.T_cam_world, s.fine_radius, way)
        enough = found.fine.inliers >= s.recover_inliers and found.quality is not Quality.LOST
        return found if enough else None

    def _remember(self, picture: PreparedPicture, found: Tracked) -> None:
        """Go on from here; after a lost picture, from the last that was not."""
        if found.quality is Quality.LOST:
            self.lost += 1
            return
        if self.lost or found.way == "relocalised":
            self.motion = self.motion._replace(velocity=np.zeros(6))
        else:
            self.motion = self.motion.update(self.T_last, found.T_cam_world)
        held = found.fine.weights > 0
        seen = found.fine.seen
        self.known = recover.Known(seen.point[held], found.fine.uv[held], seen.level[held])
        self.T_last, self.last, self.lost = found.T_cam_world, picture, 0
