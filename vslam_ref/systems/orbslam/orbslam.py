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

from vslam_ref.arrays import Array
from vslam_ref.features.vocabulary import Vocabulary
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.support.stopwatch import Stopwatch, stage
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
from vslam_ref.systems.orbslam.start_steps import MatchingSteps
from vslam_ref.systems.orbslam.tracker.tracker import FeatureTracker, TrackedFeatures
from vslam_ref.systems.visual_map.chosen_start import ChosenStart
from vslam_ref.systems.visual_map.refine_camera import RefinedCamera, refine_camera
from vslam_ref.systems.visual_map.telling import FIRST, Attempt, PictureOutcome, Pose, Quality, Trail, path_of

LOOP_SEED = 1
"""Beside the seed of the system: samples for loops do not change those of the tracker."""
NO_LOOPS = {"loops": 0, "loops_rejected": 0, "essential_edges": 0}
STAGES = (
    "features", "start", "search", "pose", "local map", "recover",
    "keyframe in", "new points", "fuse", "local", "cull", "loops", "rest",
)  # fmt: skip
"""Of a step, in their order: before there is a map; the tracker's; the mapper's; and what is left."""


@dataclass
class OrbSlam:
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

    camera: Camera
    settings: Settings = field(default_factory=Settings)
    chosen: ChosenStart | None = None
    vocabulary: Vocabulary | None = None
    close_loops: LoopCloser | None = None

    def __post_init__(self) -> None:
        s = self.settings
        self.by_words = None if self.vocabulary is None else CandidatesByWords(self.vocabulary)
        if self.by_words is not None and self.close_loops is None and s.loops.close:
            rng = np.random.default_rng([s.seed, LOOP_SEED])
            self.close_loops = LoopCloser(self.by_words, rng, s)
        self.rng = np.random.default_rng(s.seed)
        self.map: FeatureMap | None = None
        self.matched: start_steps.StartMatches | None = None
        self.tracker: FeatureTracker | None = None
        self.policy = CovisibilityPolicy(s.keyframe)
        self.poses: dict[int, Pose] = {}
        self.started_at: tuple[int, int] | None = None
        self.shape: tuple[int, int] | None = None
        self.refined: RefinedCamera | None = None

    def step(self, number: int, grey: ArrayLike) -> PictureOutcome:
        """Take the next picture.

        Parameters
        ----------
        number : int
            Its number in the sequence; each comes once.
        grey : array_like of uint8, shape (H, W)

        Returns
        -------
        PictureOutcome

        Raises
        ------
        ValueError
            If it is not grey with 8 bits, or has another size than the pictures before.
        """
        shape = np.shape(grey)
        if self.shape not in (None, shape):
            raise ValueError(f"picture {number} has shape {shape}: the ones before had {self.shape}")
        with Stopwatch() as watch:
            with stage("features"):
                picture = describe_picture(number, grey, self.settings.features)
            self.shape = shape[0], shape[1]
            if self.map is None:
                with stage("start"):
                    outcome = self._before_the_map(picture)
            else:
                outcome = self._with_the_map(self.map, picture)
        return outcome._replace(stages=watch.seconds)

    # --- before there is a map ----------------------------------------------------------------

    def _steps(self) -> MatchingSteps:
        assert self.shape is not None
        return MatchingSteps(self.camera, self.shape, self.settings, self.rng)

    def _before_the_map(self, picture: DescribedPicture) -> PictureOutcome:
        steps, s = self._steps(), self.settings.start
        if self.chosen is not None:
            return self._towards(self.chosen, picture)
        before, why = self.matched, FIRST
        if before is not None:
            self.matched = steps.go_on(before, picture)
            why = start_steps.worn(self.matched, s)
        if self.matched is None or why:
            begun = steps.begin(picture)
            few = start_steps.too_few(begun, s)
            if few and before is not None and not start_steps.too_few(before, s):
                self.matched = before
                return PictureOutcome(picture.number, waiting=f"passed over: {few}")
            self.matched = begun
            return PictureOutcome(picture.number, waiting=few or why)
        if waiting := start_steps.too_early(self.matched, s):
            return PictureOutcome(picture.number, waiting=waiting)
        found = steps.attempt(self.matched)
        if not isinstance(found, str) and not found.reason:
            self._start(found)
        return PictureOutcome(picture.number, attempt=found)

    def _towards(self, chosen: ChosenStart, picture: DescribedPicture) -> PictureOutcome:
        """Go on towards a start from two chosen pictures."""
        self.matched, told = chosen.take(self._steps(), self.matched, picture)
        if told.attempt is not None and not told.reason:
            self._start(told.attempt)
        return PictureOutcome(picture.number, attempt=told.attempt or told.reason or None)

    def _start(self, found: Attempt) -> None:
        """Make the first map, and track the pictures between against it."""
        assert self.matched is not None
        assert self.shape is not None
        pictures = self.matched.pictures
        self.map = start_steps.first_map(self.camera, self.shape, self.matched, found, self.settings)
        self.started_at = pictures[0].number, pictures[-1].number
        for kf, picture in ((0, pictures[0]), (1, pictures[-1])):
            self.poses[picture.number] = Pose(picture.number, kf, np.eye(4), None)
        back = self._tracker(self.map)
        for picture in reversed(pictures[1:-1]):
            tracked = back.track(self.map, picture)
            if tracked.quality is not Quality.LOST:
                self._note(picture, tracked, back.reference, live=False)
        self.tracker = self._tracker(self.map)
        self.matched = None

    def _tracker(self, feature_map: FeatureMap) -> FeatureTracker:
        """A tracker that has seen the second keyframe last."""
        T, points = feature_map.T_kf_world[1].copy(), feature_map.measured_in(1)
        tracker = FeatureTracker(self.settings, self.rng, T, points, reference=1)
        if self.by_words is not None:
            tracker.candidates = self.by_words.alike
        return tracker

    # --- with a map ---------------------------------------------------------------------------

    def _with_the_map(self, feature_map: FeatureMap, picture: DescribedPicture) -> PictureOutcome:
        assert self.tracker is not None
        tracked = self.tracker.track(feature_map, picture)
        mapped = None
        if tracked.quality is not Quality.LOST:
            feature_map.points["tried"][tracked.found.tried] += 1
            feature_map.points["found"][tracked.point] += 1
            self._note(picture, tracked, self.tracker.reference, live=True)
            if self.policy.wants(feature_map, tracked):
                mapped = self._keyframe(feature_map, self.tracker, picture, tracked)
        return PictureOutcome(picture.number, tracked, mapped)

    def _note(self, picture: DescribedPicture, tracked: TrackedFeatures, kf: int, *, live: bool) -> None:
        """Remember a pose relative to its reference keyframe."""
        assert self.map is not None
        T = tracked.T_cam_world
        T_cam_kf = se3.compose(T, se3.inverse(self.map.T_kf_world[kf]))
        self.poses[picture.number] = Pose(picture.number, kf, T_cam_kf, T if live else None)

    def _keyframe(
        self,
        feature_map: FeatureMap,
        tracker: FeatureTracker,
        picture: DescribedPicture,
        tracked: TrackedFeatures,
    ) -> LocalMapping:
        mapped = map_keyframe(
            feature_map, picture, tracked.T_cam_world, tracked.feature, tracked.point, self.settings
        )
        if self.close_loops is not None:
            with stage("loops"):
                scale = self.close_loops(feature_map, mapped.kf)
            if scale is not None:
                self.poses = rescaled(self.poses, scale)
                tracker.motion.velocity[:3] *= scale[mapped.kf]
        live = self.poses[picture.number].live
        self.poses[picture.number] = Pose(picture.number, mapped.kf, np.eye(4), live)
        tracker.T_last = feature_map.T_kf_world[mapped.kf].copy()
        tracker.points, tracker.reference = feature_map.measured_in(mapped.kf), mapped.kf
        self.policy.taken()
        return mapped

    # --- the end ------------------------------------------------------------------------------

    def finish(self) -> None:
        """Adjust everything once more, and the camera with it if that is wanted."""
        if self.map is None:
            return
        if self.settings.last_steps:
            adjust_all(self.map, self.settings, self.settings.last_steps)
        if self.settings.camera.refine:
            self.refined = refine_camera(self.map, robust(self.settings), self.settings.camera)

    def close(self) -> None:
        """Leave nothing running; here there is nothing."""

    def trajectory(self, T_kf_world: Array | None = None) -> tuple[Array, Array]:
        """Numbers of the pictures that have a pose (n,), and their poses ``T_cam_world`` (n, 4, 4).

        With other poses ``T_kf_world (K, 4, 4)`` of the keyframes, if such are given; the map's own unit.
        """
        if self.map is None:
            return path_of({}, np.zeros((0, 4, 4)))
        return path_of(self.poses, settled_poses(self.map, T_kf_world))

    def counts(self) -> dict[str, int]:
        """What this system counts beside what all do."""
        culled = 0 if self.map is None else self.map.culled
        loops = self.close_loops.counts() if self.close_loops else NO_LOOPS
        return {**loops, "culled_keyframes": culled}

    def trail(self) -> Trail | None:
        """Features that are followed before there is a map; None without any."""
        matched = self.matched
        if matched is None or (self.chosen is None and len(matched.pictures) < 2):
            return None
        rows = matched.rows
        level = matched.pictures[0].features.octave[rows]
        return Trail(matched.places[-1, rows], level, matched.places[0, rows])
