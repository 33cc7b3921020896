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

from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import se3
from vslam_ref.geometry.camera_pose import DecayingVelocity
from vslam_ref.geometry.cameras import Camera
from vslam_ref.support.stopwatch import Stopwatch, stage
from vslam_ref.systems.ptam import trails as trail_steps
from vslam_ref.systems.ptam.chosen import ChosenSteps
from vslam_ref.systems.ptam.look import prepare
from vslam_ref.systems.ptam.mapper.mapper import MappedKeyframe, adjust_all, map_keyframe, robust
from vslam_ref.systems.ptam.policy import KeyframePolicy
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.start import attempt, first_map
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.systems.ptam.tracker.tracker import Tracked, Tracker
from vslam_ref.systems.visual_map import PreparedPicture, VisualMap
from vslam_ref.systems.visual_map.chosen_start import ChosenStart
from vslam_ref.systems.visual_map.refine_camera import RefinedCamera, refine_camera
from vslam_ref.systems.visual_map.telling import (
    Attempt,
    PictureOutcome,
    Pose,
    Trail,
    nearest_keyframe,
    path_of,
)

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
class Ptam:
    """Parallel tracking and mapping, with mapping in line.

    Parameters
    ----------
    camera : Camera
    settings : Settings, optional
    chosen : ChosenStart, optional
        Two pictures to start from; by default the system finds them.
    """

    camera: Camera
    settings: Settings = field(default_factory=Settings)
    chosen: ChosenStart | None = None

    def __post_init__(self) -> None:
        s = self.settings
        self.rng = np.random.default_rng(s.seed)
        self.map: VisualMap | None = None
        self.trails: trail_steps.Trails | None = None
        self.tracker: Tracker | None = None
        self.policy = KeyframePolicy(s.keyframe)
        self.poses: dict[int, Pose] = {}
        self.started_at: tuple[int, int] | None = None
        self.shape: tuple[int, ...] | None = None
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
            with stage("prepare"):
                picture = prepare(number, grey, self.settings.features)
            self.shape = shape
            if self.map is None:
                with stage("start"):
                    outcome = self._before_the_map(picture)
            else:
                outcome = self._with_the_map(picture)
        return outcome._replace(stages=watch.seconds)

    # --- before there is a map ----------------------------------------------------------------

    def _before_the_map(self, picture: PreparedPicture) -> PictureOutcome:
        if self.chosen is not None:
            return self._towards(self.chosen, picture)
        s, f = self.settings.start, self.settings.features
        if self.trails is not None:
            went = trail_steps.go_on(self.trails, picture, s)
            if blank := trail_steps.blank(self.trails, went, picture, s, f):
                return PictureOutcome(picture.number, waiting=blank)
            self.trails = went
        if self.trails is None or trail_steps.worn(self.trails, s):
            why = trail_steps.worn(self.trails, s)
            self.trails = trail_steps.begin(picture, s, f)
            return PictureOutcome(picture.number, waiting=trail_steps.too_few(self.trails, s) or why)
        if waiting := trail_steps.too_early(self.trails, s):
            return PictureOutcome(picture.number, waiting=waiting)
        found = attempt(self.camera, self.trails, s, self.rng)
        if isinstance(found, str):
            return PictureOutcome(picture.number, attempt=found)
        if not found.reason:
            self._start(found)
        elif len(found.row) > s.keep * len(self.trails.now):
            self.trails = self.trails.only(found.row, found.uv_b)
        return PictureOutcome(picture.number, attempt=found)

    def _towards(self, chosen: ChosenStart, picture: PreparedPicture) -> PictureOutcome:
        """Go on towards a start from two chosen pictures."""
        steps = ChosenSteps(self.camera, self.settings, self.rng)
        self.trails, told = chosen.take(steps, self.trails, picture)
        if told.attempt is not None and not told.reason:
            self._start(told.attempt)
        return PictureOutcome(picture.number, attempt=told.attempt or told.reason or None)

    def _start(self, found: Attempt) -> None:
        """Make the first map, and track the pictures between against it."""
        assert self.trails is not None
        pictures = self.trails.pictures
        self.map = first_map(self.camera, self.trails, found, self.settings)
        self.started_at = pictures[0].number, pictures[-1].number
        T_last = self.map.T_kf_world[1].copy()
        for kf, picture in ((0, pictures[0]), (1, pictures[-1])):
            self.poses[picture.number] = Pose(picture.number, kf, np.eye(4), None)
        back = self._tracker(T_last)
        for picture in reversed(pictures[1:-1]):
            tracked = back.track(self.map, picture)
            if tracked.quality is not Quality.LOST:
                self._note(self.map, picture, tracked, live=False)
        self.tracker = self._tracker(T_last)
        self.tracker.last = pictures[-1]
        self.trails = None

    def _tracker(self, T_last: Array) -> Tracker:
        s = self.settings.tracker
        return Tracker(self.settings, self.rng, DecayingVelocity(np.zeros(6), s.decay, s.newest), T_last)

    # --- with a map ---------------------------------------------------------------------------

    def _with_the_map(self, picture: PreparedPicture) -> PictureOutcome:
        assert self.map is not None
        assert self.tracker is not None
        tracked = self.tracker.track(self.map, picture)
        mapped = None
        if tracked.quality is not Quality.LOST:
            self._count(self.map.points["tried"], self.map.points["found"], tracked)
            self._note(self.map, picture, tracked, live=True)
            if self.policy.wants(self.map, tracked):
                mapped = self._keyframe(picture, tracked)
        return PictureOutcome(picture.number, tracked, mapped)

    def _count(self, tried: IntArray, found: IntArray, tracked: Tracked) -> None:
        """Count for each point (N,) that it was looked for, and whether it was found."""
        seen = tracked.fine.seen.point
        tried[seen] += 1
        found[seen[tracked.fine.weights > 0]] += 1

    def _note(self, visual_map: VisualMap, picture: PreparedPicture, tracked: Tracked, *, live: bool) -> None:
        """Remember a pose relative to the keyframe nearest to it."""
        T = tracked.T_cam_world
        kf = nearest_keyframe(visual_map.T_kf_world, T)
        T_cam_kf = se3.compose(T, se3.inverse(visual_map.T_kf_world[kf]))
        self.poses[picture.number] = Pose(picture.number, kf, T_cam_kf, T if live else None)

    def _keyframe(self, picture: PreparedPicture, tracked: Tracked) -> MappedKeyframe:
        assert self.map is not None
        assert self.tracker is not None
        assert self.tracker.known is not None  # it has just tracked this picture
        mapped = map_keyframe(self.map, picture, tracked.T_cam_world, self.tracker.known, self.settings)
        T = self.map.T_kf_world[mapped.kf].copy()
        live = self.poses[picture.number].live
        self.poses[picture.number] = Pose(picture.number, mapped.kf, np.eye(4), live)
        self.tracker.T_last = T
        self.policy.taken()
        return mapped

    # --- the end ------------------------------------------------------------------------------

    def finish(self) -> None:
        """Adjust everything once more, and the camera with it if that is wanted."""
        if self.map is None:
            return
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
        return path_of(self.poses, self.map.T_kf_world if T_kf_world is None else T_kf_world)

    def trail(self) -> Trail | None:
        """Points that are followed before there is a map; None without any."""
        trails = self.trails
        if trails is None or (self.chosen is None and len(trails.pictures) < 2):
            return None
        return Trail(trails.now, trails.level, trails.first)
