"""The system: a picture in, a pose out, and a map of features that grows and is thinned out.

::

    picture -> features -> no map yet: matched with the first -> attempt -> first map
                        -> map: tracker -> pose, quality -> counters -> keyframe? -> local mapping -> loops?

In this order, one after the other, on one thread: the same pictures and seed give the same bytes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.vocabulary import Vocabulary
from vslam_ref.support.stopwatch import stage
from vslam_ref.systems.orbslam import start as start_steps
from vslam_ref.systems.orbslam.feature_map import DescribedPicture, FeatureMap
from vslam_ref.systems.orbslam.look import describe_picture
from vslam_ref.systems.orbslam.loops.closer import LoopCloser
from vslam_ref.systems.orbslam.loops.join import rescaled
from vslam_ref.systems.orbslam.loops.words import CandidatesByWords
from vslam_ref.systems.orbslam.mapper.adjusting import adjust_all, robust
from vslam_ref.systems.orbslam.mapper.mapper import LocalMapping, map_keyframe
from vslam_ref.systems.orbslam.policy import CovisibilityPolicy
from vslam_ref.systems.orbslam.settings import Settings
from vslam_ref.systems.orbslam.spanning_tree import settled_poses
from vslam_ref.systems.orbslam.start import StartMatches
from vslam_ref.systems.orbslam.start_steps import MatchingSteps
from vslam_ref.systems.orbslam.tracker.tracker import FeatureTracker, TrackedFeatures
from vslam_ref.systems.visual_map.refine_camera import refine_camera
from vslam_ref.systems.visual_map.telling import FIRST, Attempt, PictureOutcome, Trail
from vslam_ref.systems.visual_map.visual_slam import VisualSlam

LOOP_SEED = 1
"""Beside the seed of the system: samples for loops do not change those of the tracker."""
NO_LOOPS = {"loops": 0, "loops_rejected": 0, "essential_edges": 0}
STAGES = (
    "features", "start", "search", "pose", "local map", "recover",
    "keyframe in", "new points", "fuse", "local", "cull", "loops", "rest",
)  # fmt: skip
"""Of a step, in their order: before there is a map; the tracker's; the mapper's; and what is left."""


@dataclass
class OrbSlam(VisualSlam[DescribedPicture, FeatureMap, StartMatches, FeatureTracker]):
    """Tracking, local mapping and loop closing, one after the other.

    Parameters
    ----------
    camera : Camera
    settings : Settings, optional
    chosen : ChosenStart, optional
        Two pictures to start from; by default the system finds them.
    vocabulary : Vocabulary, optional
        With it, keyframes are found by their words: where loops may close, unless ``settings.loops.close`` is
        off, and where a lost camera may be.  Without, no loop is looked for.
    close_loops : LoopCloser, optional
        Another that looks for loops after each keyframe.
    """

    settings: Settings = field(default_factory=Settings)
    vocabulary: Vocabulary | None = None
    close_loops: LoopCloser | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        s = self.settings
        self.by_words = None if self.vocabulary is None else CandidatesByWords(self.vocabulary)
        if self.by_words is not None and self.close_loops is None and s.loops.close:
            rng = np.random.default_rng([s.seed, LOOP_SEED])
            self.close_loops = LoopCloser(self.by_words, rng, s)
        self.policy = CovisibilityPolicy(s.keyframe)

    def _prepare(self, number: int, grey: ArrayLike) -> DescribedPicture:
        with stage("features"):
            return describe_picture(number, grey, self.settings.features)

    # --- before there is a map ----------------------------------------------------------------

    def _steps(self) -> MatchingSteps:
        assert self.shape is not None
        return MatchingSteps(self.camera, self.shape, self.settings, self.rng)

    def _look_for_a_start(self, picture: DescribedPicture) -> PictureOutcome:
        steps, s = self._steps(), self.settings.start
        before, why = self.followed, FIRST
        if before is not None:
            self.followed = steps.go_on(before, picture)
            why = start_steps.worn(self.followed, s)
        if self.followed is None or why:
            begun = steps.begin(picture)
            few = start_steps.too_few(begun, s)
            if few and before is not None and not start_steps.too_few(before, s):
                self.followed = before
                return PictureOutcome(picture.number, waiting=f"passed over: {few}")
            self.followed = begun
            return PictureOutcome(picture.number, waiting=few or why)
        if waiting := start_steps.too_early(self.followed, s):
            return PictureOutcome(picture.number, waiting=waiting)
        found = steps.attempt(self.followed)
        if not isinstance(found, str) and not found.reason:
            self._start(found)
        return PictureOutcome(picture.number, attempt=found)

    def _first_map(self, followed: StartMatches, found: Attempt) -> FeatureMap:
        assert self.shape is not None
        return start_steps.first_map(self.camera, self.shape, followed, found, self.settings)

    def _new_tracker(self, first_map: FeatureMap) -> FeatureTracker:
        T, points = first_map.T_kf_world[1].copy(), first_map.measured_in(1)
        tracker = FeatureTracker(self.settings, self.rng, T, points, reference=1)
        if self.by_words is not None:
            tracker.candidates = self.by_words.alike
        return tracker

    # --- with a map ---------------------------------------------------------------------------

    def _track(
        self, tracker: FeatureTracker, known: FeatureMap, picture: DescribedPicture
    ) -> tuple[TrackedFeatures, int]:
        tracked = tracker.track(known, picture)
        return tracked, tracker.reference

    def _count(self, tried: IntArray, found: IntArray, tracked: TrackedFeatures) -> None:
        tried[tracked.found.tried] += 1
        found[tracked.point] += 1

    def _keyframe(
        self,
        known: FeatureMap,
        tracker: FeatureTracker,
        picture: DescribedPicture,
        tracked: TrackedFeatures,
    ) -> LocalMapping:
        mapped = map_keyframe(
            known, picture, tracked.T_cam_world, tracked.feature, tracked.point, self.settings
        )
        if self.close_loops is not None:
            with stage("loops"):
                scale = self.close_loops(known, mapped.kf)
            if scale is not None:
                self.poses = rescaled(self.poses, scale)
                tracker.motion.velocity[:3] *= scale[mapped.kf]
        self._is_keyframe(picture.number, mapped.kf)
        tracker.T_last = known.T_kf_world[mapped.kf].copy()
        tracker.points, tracker.reference = known.measured_in(mapped.kf), mapped.kf
        self.policy.taken()
        return mapped

    # --- the end ------------------------------------------------------------------------------

    def _finish(self, made: FeatureMap) -> None:
        if self.settings.last_steps:
            adjust_all(made, self.settings, self.settings.last_steps)
        if self.settings.camera.refine:
            self.refined = refine_camera(made, robust(self.settings), self.settings.camera)

    def _keyframe_poses(self, made: FeatureMap, T_kf_world: Array | None) -> Array:
        """Those that were culled stay beside their parents in the spanning tree."""
        return settled_poses(made, T_kf_world)

    def counts(self) -> dict[str, int]:
        """What this system counts beside what all do."""
        culled = 0 if self.map is None else self.map.culled
        loops = self.close_loops.counts() if self.close_loops else NO_LOOPS
        return {**loops, "culled_keyframes": culled}

    def _trail(self, followed: StartMatches) -> Trail:
        rows = followed.rows
        level = followed.pictures[0].features.octave[rows]
        return Trail(followed.places[-1, rows], level, followed.places[0, rows])
