"""The system: a picture in, a pose out, and a map that grows.

::

    picture -> prepare -> no map yet: trails -> attempt -> first map
                       -> map: tracker -> pose, quality -> counters -> keyframe? -> mapper

In this order, one after the other, on one thread: the same pictures and seed give the same bytes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import IntArray
from vslam_ref.geometry.camera_pose import DecayingVelocity
from vslam_ref.support.stopwatch import stage
from vslam_ref.systems.ptam import trails as trail_steps
from vslam_ref.systems.ptam.chosen import ChosenSteps
from vslam_ref.systems.ptam.look import prepare
from vslam_ref.systems.ptam.mapper.mapper import MappedKeyframe, adjust_all, map_keyframe, robust
from vslam_ref.systems.ptam.policy import KeyframePolicy
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.start import attempt, first_map
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.systems.ptam.tracker.tracker import Tracked, Tracker
from vslam_ref.systems.ptam.trails import Trails
from vslam_ref.systems.visual_map import PreparedPicture, VisualMap
from vslam_ref.systems.visual_map.refine_camera import refine_camera
from vslam_ref.systems.visual_map.telling import (
    Attempt,
    PictureOutcome,
    Pose,
    Trail,
    nearest_keyframe,
)
from vslam_ref.systems.visual_map.visual_slam import VisualSlam

__all__ = ["STAGES", "PictureOutcome", "Pose", "Ptam"]

STAGES = (
    "prepare",
    "start",
    "guess",
    "coarse",
    "fine",
    "pose",
    "recover",
    "look again",
    "new points",
    "neighbours",
    "local",
    "global",
    "rest",
)
"""Of a step, in their order: pyramid and corners; before there is a map; guesses by the small image; both
passes without their poses, and these; without a guess; then the mapper's, and what is left."""


@dataclass
class Ptam(VisualSlam[PreparedPicture, VisualMap, Trails, Tracker]):
    """Parallel tracking and mapping, with mapping in line.

    Parameters
    ----------
    camera : Camera
    settings : Settings, optional
    chosen : ChosenStart, optional
        Two pictures to start from; by default the system finds them.
    """

    settings: Settings = field(default_factory=Settings)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.policy = KeyframePolicy(self.settings.keyframe)

    def _prepare(self, number: int, grey: ArrayLike) -> PreparedPicture:
        with stage("prepare"):
            return prepare(number, grey, self.settings.features)

    # --- before there is a map ----------------------------------------------------------------

    def _steps(self) -> ChosenSteps:
        return ChosenSteps(self.camera, self.settings, self.rng)

    def _look_for_a_start(self, picture: PreparedPicture) -> PictureOutcome:
        s, f = self.settings.start, self.settings.features
        if self.followed is not None:
            went = trail_steps.go_on(self.followed, picture, s)
            if blank := trail_steps.blank(self.followed, went, picture, s, f):
                return PictureOutcome(picture.number, waiting=blank)
            self.followed = went
        if self.followed is None or trail_steps.worn(self.followed, s):
            why = trail_steps.worn(self.followed, s)
            self.followed = trail_steps.begin(picture, s, f)
            return PictureOutcome(picture.number, waiting=trail_steps.too_few(self.followed, s) or why)
        if waiting := trail_steps.too_early(self.followed, s):
            return PictureOutcome(picture.number, waiting=waiting)
        found = attempt(self.camera, self.followed, s, self.rng)
        if isinstance(found, str):
            return PictureOutcome(picture.number, attempt=found)
        if not found.reason:
            self._start(found)
        elif len(found.row) > s.keep * len(self.followed.now):
            self.followed = self.followed.only(found.row, found.uv_b)
        return PictureOutcome(picture.number, attempt=found)

    def _first_map(self, followed: Trails, found: Attempt) -> VisualMap:
        return first_map(self.camera, followed, found, self.settings)

    def _new_tracker(self, first_map: VisualMap) -> Tracker:
        s, T_last = self.settings.tracker, first_map.T_kf_world[1].copy()
        return Tracker(self.settings, self.rng, DecayingVelocity(np.zeros(6), s.decay, s.newest), T_last)

    def _start(self, found: Attempt) -> None:
        assert self.followed is not None
        last = self.followed.pictures[-1]
        super()._start(found)
        assert self.tracker is not None
        self.tracker.last = last

    # --- with a map ---------------------------------------------------------------------------

    def _track(self, tracker: Tracker, known: VisualMap, picture: PreparedPicture) -> tuple[Tracked, int]:
        tracked = tracker.track(known, picture)
        lost = tracked.quality is Quality.LOST
        return tracked, 0 if lost else nearest_keyframe(known.T_kf_world, tracked.T_cam_world)

    def _count(self, tried: IntArray, found: IntArray, tracked: Tracked) -> None:
        seen = tracked.fine.seen.point
        tried[seen] += 1
        found[seen[tracked.fine.weights > 0]] += 1

    def _keyframe(
        self, known: VisualMap, tracker: Tracker, picture: PreparedPicture, tracked: Tracked
    ) -> MappedKeyframe:
        assert tracker.known is not None  # it has just tracked this picture
        mapped = map_keyframe(known, picture, tracked.T_cam_world, tracker.known, self.settings)
        self._is_keyframe(picture.number, mapped.kf)
        tracker.T_last = known.T_kf_world[mapped.kf].copy()
        self.policy.taken()
        return mapped

    # --- the end ------------------------------------------------------------------------------

    def _finish(self, made: VisualMap) -> None:
        adjust_all(made, self.settings, self.settings.last_steps)
        if self.settings.camera.refine:
            self.refined = refine_camera(made, robust(self.settings), self.settings.camera)

    def _trail(self, followed: Trails) -> Trail:
        return Trail(followed.now, followed.level, followed.first)
