"""What the systems that grow a map by keyframes have in common: a picture in, a pose out, in one order.

::

    picture -> prepare -> no map yet: follow -> attempt -> first map, and the pictures between
                       -> map: tracker -> pose -> counters, the pose noted -> keyframe? -> mapper

A pose is kept relative to its reference keyframe, so that it moves with it; what was told live stays beside.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.support.stopwatch import Stopwatch, stage
from vslam_ref.systems.visual_map.chosen_start import ChosenStart, StartSteps
from vslam_ref.systems.visual_map.keyframe_map import KeyframeMap
from vslam_ref.systems.visual_map.refine_camera import RefinedCamera
from vslam_ref.systems.visual_map.telling import (
    Attempt,
    PictureOutcome,
    Pose,
    Quality,
    TrackedPicture,
    Trail,
    path_of,
)


class Numbered(Protocol):
    """A prepared picture."""

    @property
    def number(self) -> int:
        """In the sequence."""


class FollowedPictures(Protocol):
    """What is followed from picture to picture before there is a map."""

    @property
    def pictures(self) -> Any:
        """Prepared, from the first one on."""


class KeyframeChoice(Protocol):
    """When a tracked picture becomes a keyframe."""

    def wants(self, known: Any, tracked: Any) -> bool:
        """Whether this picture shall be one; called once for each."""

    def taken(self) -> None:
        """Begin anew: it became one."""


PictureT = TypeVar("PictureT", bound=Numbered)
MapT = TypeVar("MapT", bound=KeyframeMap)
FollowedT = TypeVar("FollowedT", bound=FollowedPictures)
TrackerT = TypeVar("TrackerT")


@dataclass
class VisualSlam(ABC, Generic[PictureT, MapT, FollowedT, TrackerT]):
    """One camera, one map, one thread: the same pictures and seed give the same bytes.

    Parameters
    ----------
    camera : Camera
    settings : object
        Of the system; it has a ``seed``.
    chosen : ChosenStart, optional
        Two pictures to start from; by default the system finds them.

    Attributes
    ----------
    map : MapT or None
        None before there is one.
    followed : FollowedT or None
        What is followed before there is a map.
    tracker : TrackerT or None
    policy : KeyframeChoice
        Which tracked pictures become keyframes; each system sets its own.
    poses : dict of int to Pose
        By the number of the picture.
    started_at : tuple of two ints, or None
        Numbers of the pictures that made the first map.
    shape : tuple of two ints, or None
        Rows and columns of the pictures.
    refined : RefinedCamera or None
        After :meth:`finish`, if it was asked for.
    """

    camera: Camera
    settings: Any
    chosen: ChosenStart | None = None
    policy: KeyframeChoice = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.settings.seed)
        self.map: MapT | None = None
        self.followed: FollowedT | None = None
        self.tracker: TrackerT | None = None
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
            picture = self._prepare(number, grey)
            self.shape = shape[0], shape[1]
            if self.map is None:
                with stage("start"):
                    outcome = self._before_the_map(picture)
            else:
                outcome = self._with_the_map(self.map, picture)
        return outcome._replace(stages=watch.seconds)

    # --- what each system has of its own --------------------------------------------------------

    @abstractmethod
    def _prepare(self, number: int, grey: ArrayLike) -> PictureT:
        """What a picture shows: a pyramid with corners, or features."""

    @abstractmethod
    def _steps(self) -> StartSteps:
        """How one comes from picture to picture before there is a map."""

    @abstractmethod
    def _look_for_a_start(self, picture: PictureT) -> PictureOutcome:
        """Go on with a picture, and start where two are found that allow it."""

    @abstractmethod
    def _first_map(self, followed: FollowedT, found: Attempt) -> MapT:
        """The map of two keyframes that a start leaves."""

    @abstractmethod
    def _new_tracker(self, first_map: MapT) -> TrackerT:
        """A tracker that has seen the second keyframe last."""

    @abstractmethod
    def _track(self, tracker: TrackerT, known: MapT, picture: PictureT) -> tuple[Any, int]:
        """A tracked picture, and the keyframe to which its pose is kept; any where it is lost."""

    @abstractmethod
    def _count(self, tried: IntArray, found: IntArray, tracked: Any) -> None:
        """Count for each point (N,) that it was looked for, and whether it was found."""

    @abstractmethod
    def _keyframe(self, known: MapT, tracker: TrackerT, picture: PictureT, tracked: Any) -> Any:
        """Take a tracked picture into the map; return what the mapper says."""

    @abstractmethod
    def _trail(self, followed: FollowedT) -> Trail:
        """What is followed, to be drawn."""

    # --- before there is a map ------------------------------------------------------------------

    def _before_the_map(self, picture: PictureT) -> PictureOutcome:
        if self.chosen is None:
            return self._look_for_a_start(picture)
        self.followed, told = self.chosen.take(self._steps(), self.followed, picture)
        if told.attempt is not None and not told.reason:
            self._start(told.attempt)
        return PictureOutcome(picture.number, attempt=told.attempt or told.reason or None)

    def trail(self) -> Trail | None:
        """What is followed before there is a map; None without any."""
        followed = self.followed
        if followed is None or (self.chosen is None and len(followed.pictures) < 2):
            return None
        return self._trail(followed)

    def _start(self, found: Attempt) -> None:
        """Make the first map, and track the pictures between against it."""
        assert self.followed is not None
        pictures = self.followed.pictures
        self.map = made = self._first_map(self.followed, found)
        self.started_at = pictures[0].number, pictures[-1].number
        for kf, picture in ((0, pictures[0]), (1, pictures[-1])):
            self.poses[picture.number] = Pose(picture.number, kf, np.eye(4), None)
        back = self._new_tracker(made)
        for picture in reversed(pictures[1:-1]):
            tracked, kf = self._track(back, made, picture)
            if tracked.quality is not Quality.LOST:
                self._note(made, picture, tracked, kf, live=False)
        self.tracker = self._new_tracker(made)
        self.followed = None

    # --- with a map -----------------------------------------------------------------------------

    def _with_the_map(self, known: MapT, picture: PictureT) -> PictureOutcome:
        """Track a picture, and take it into the map if it is wanted."""
        assert self.tracker is not None
        tracked, kf = self._track(self.tracker, known, picture)
        mapped = None
        if tracked.quality is not Quality.LOST:
            self._count(known.points["tried"], known.points["found"], tracked)
            self._note(known, picture, tracked, kf, live=True)
            if self.policy.wants(known, tracked):
                mapped = self._keyframe(known, self.tracker, picture, tracked)
        return PictureOutcome(picture.number, tracked, mapped)

    def _note(self, known: MapT, picture: PictureT, tracked: TrackedPicture, kf: int, *, live: bool) -> None:
        """Remember a pose relative to its reference keyframe."""
        T = tracked.T_cam_world
        T_cam_kf = se3.compose(T, se3.inverse(known.T_kf_world[kf]))
        self.poses[picture.number] = Pose(picture.number, kf, T_cam_kf, T if live else None)

    def _is_keyframe(self, number: int, kf: int) -> None:
        """A picture is its own reference now."""
        self.poses[number] = Pose(number, kf, np.eye(4), self.poses[number].live)

    # --- the end --------------------------------------------------------------------------------

    def finish(self) -> None:
        """Adjust everything once more, and the camera with it if that is wanted."""
        if self.map is not None:
            self._finish(self.map)

    @abstractmethod
    def _finish(self, made: MapT) -> None:
        """The last adjustment of a map."""

    def close(self) -> None:
        """Leave nothing running; here there is nothing."""

    def trajectory(self, T_kf_world: Array | None = None) -> tuple[Array, Array]:
        """Numbers of the pictures that have a pose (n,), and their poses ``T_cam_world`` (n, 4, 4).

        With other poses ``T_kf_world (K, 4, 4)`` of the keyframes, if such are given; the map's own unit.
        """
        if self.map is None:
            return path_of({}, np.zeros((0, 4, 4)))
        return path_of(self.poses, self._keyframe_poses(self.map, T_kf_world))

    def _keyframe_poses(self, made: MapT, T_kf_world: Array | None) -> Array:
        """Poses (K, 4, 4) of all keyframes, those that were given or the map's."""
        return made.T_kf_world if T_kf_world is None else T_kf_world
