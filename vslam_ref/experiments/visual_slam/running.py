"""One picture after the other into the system, and what became of each."""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.sequences import Image, Sequence
from vslam_ref.experiments.visual_slam.kinds import SystemKind, VisualSystem, kind_of
from vslam_ref.features.vocabulary import Vocabulary
from vslam_ref.systems.ptam import ConcurrentPtam
from vslam_ref.systems.visual_map.chosen_start import ChosenStart
from vslam_ref.systems.visual_map.telling import FIRST, Attempt, PictureOutcome, TrackedPicture

UNUSABLE, WAITING, START, GOOD, POOR, LOST = "unusable", "waiting", "start", "good", "poor", "lost"
STATES = (UNUSABLE, WAITING, START, GOOD, POOR, LOST)
"""No picture; no map yet; the picture that made the map; and the qualities of tracking."""


class Marks(NamedTuple):
    """Points that were followed in a picture, to be drawn into it.

    Attributes
    ----------
    uv : ndarray of float32, shape (n, 2)
        Pixels of level 0.
    level : ndarray of uint8, shape (n,)
    first : ndarray of float32, shape (n, 2), or None
        Before there is a map: where the points were in the first picture.
    """

    uv: NDArray[np.float32]
    level: NDArray[np.uint8]
    first: NDArray[np.float32] | None = None


NOTHING = Marks(np.zeros((0, 2), np.float32), np.zeros(0, np.uint8))


class Frame(NamedTuple):
    """What became of one picture.

    Attributes
    ----------
    number : int
        In its source.
    time : float
        Seconds, by the sequence.
    state : str
        One of ``STATES``.
    way : str
        How the pose was found.
    tried, found : int
        Points looked for, and found with weight.
    sigma : float
        Scale of the errors, pixels of the point's level; NaN where there is no pose.
    seconds : float
        That the system took, by the clock on the wall.
    stages : mapping of str to float
        Seconds that its stages took of the processor, as the system names them.
    keyframe : bool
    marks : Marks
    """

    number: int
    time: float
    state: str
    way: str = ""
    tried: int = 0
    found: int = 0
    sigma: float = np.nan
    seconds: float = np.nan
    stages: Mapping[str, float] = MappingProxyType({})
    keyframe: bool = False
    marks: Marks = NOTHING


@dataclass
class Run:
    """A run, to its end or as far as it came.

    Attributes
    ----------
    sequence : Sequence
    settings : Settings
        Of the system.
    system : VisualSystem
    frames : list of Frame
    start : Attempt or None
        Of the two pictures that made the map.
    refusals : Counter
        Why there was no start: reason with its numbers taken out -> how often.
    examples : dict
        The same -> the last reason of the kind as it was told.
    finish_seconds : float
        Of the last adjustment.
    interrupted : bool
        Whether the run, or its film, was ended before its time.
    filmed : int or None
        Pictures of the film; None without one.
    concurrent : bool
        Whether mapping had a thread of its own.
    """

    sequence: Sequence
    settings: Any
    system: VisualSystem
    frames: list[Frame] = field(default_factory=list)
    start: Attempt | None = None
    refusals: Counter[str] = field(default_factory=Counter)
    examples: dict[str, str] = field(default_factory=dict)
    finish_seconds: float = 0.0
    interrupted: bool = False
    filmed: int | None = None
    concurrent: bool = False

    @property
    def kind(self) -> SystemKind:
        """Which system it is."""
        return kind_of(self.settings)

    def refused(self, reason: str) -> None:
        """Count a reason why there is no map yet."""
        kind = re.sub(r"\d+(\.\d+)?(e[+-]?\d+)?", "…", reason)
        self.refusals[kind] += 1
        self.examples[kind] = reason

    def no_start(self) -> str | None:
        """Why there is no map, by the most frequent reason; None if there is one."""
        if self.system.map is not None:
            return None
        if self.system.chosen is not None:
            return self.system.chosen.no_start()
        if not self.refusals:
            return "no picture could be looked at" if not self._looked_at() else "one picture is no start"
        kind, count = self.refusals.most_common(1)[0]
        return f"{self.examples[kind]} (so at {count} of {self.refusals.total()} pictures)"

    def _looked_at(self) -> int:
        return sum(frame.state != UNUSABLE for frame in self.frames)


def run(
    sequence: Sequence,
    settings: Any,
    stop: Callable[[Run], bool] = lambda done: False,
    progress: Callable[[], object] = lambda: None,
    *,
    chosen: ChosenStart | None = None,
    concurrent: bool = False,
    vocabulary: Vocabulary | None = None,
) -> Run:
    """Run a system over a sequence.

    Parameters
    ----------
    sequence : Sequence
        With a camera.
    settings : Settings
        Of PTAM or of ORB-SLAM; they decide which of the two runs.
    stop : callable
        Asked before each picture, with the run so far; true ends it there.
    progress : callable
        Called after each picture.
    chosen : ChosenStart, optional
        Two pictures to start from.
    concurrent : bool
        With the mapper in a thread of its own.
    vocabulary : Vocabulary, optional
        For ORB-SLAM; by default the one that comes with the package.

    Raises
    ------
    ValueError
        If the sequence has no camera.
    """
    if sequence.camera is None:
        raise ValueError(f"{sequence.name} has no camera: need one")
    system = kind_of(settings).make(sequence.camera, settings, chosen, concurrent, vocabulary)
    done = Run(sequence, settings, system, concurrent=concurrent)
    with closing(system):
        for image in sequence:
            if stop(done):
                done.interrupted = True
                break
            done.frames.append(_one(done, image))
            progress()
        began = time.perf_counter()
        system.finish()
        done.finish_seconds = time.perf_counter() - began
    if isinstance(system, ConcurrentPtam):
        done.frames = [_with_mapping(frame, system.mapping_stages) for frame in done.frames]
    return done


def _with_mapping(frame: Frame, mapping: Mapping[int, Mapping[str, float]]) -> Frame:
    """A picture with the time that the mapper's thread took for it, where it became a keyframe."""
    more = mapping.get(frame.number)
    return frame if more is None else frame._replace(stages={**more, **frame.stages})


def _one(done: Run, image: Image) -> Frame:
    """Give one picture to the system."""
    if image.grey is None:
        return Frame(image.number, image.time, UNUSABLE)
    had_map = done.system.map is not None
    began = time.perf_counter()
    outcome = done.system.step(image.number, image.grey)
    seconds = time.perf_counter() - began
    frame = Frame(image.number, image.time, WAITING, seconds=seconds, stages=outcome.stages)
    if outcome.tracked is not None:
        return _tracked(done, frame, outcome)
    if not had_map and done.system.map is not None and isinstance(outcome.attempt, Attempt):
        done.start = outcome.attempt
        return frame._replace(state=START, keyframe=True, marks=_start_marks(done, outcome.attempt))
    return _waited(done, frame, outcome)


def _tracked(done: Run, frame: Frame, outcome: PictureOutcome) -> Frame:
    tracked: TrackedPicture = outcome.tracked
    told = tracked.told()
    state = told.quality.value
    if state == LOST:
        return frame._replace(state=state, way=told.way, tried=told.tried)
    return frame._replace(
        state=state,
        way=told.way,
        tried=told.tried,
        found=len(told.uv),
        sigma=told.sigma,
        keyframe=outcome.mapped is not None or outcome.queued,
        marks=Marks(told.uv.astype(np.float32), halvings(done, told.level)),
    )


def halvings(done: Run, level: IntArray) -> NDArray[np.uint8]:
    """Levels (n,) as levels of a pyramid whose pixels are twice as wide from one to the next, rounded."""
    width = done.kind.width(done.settings)
    return np.asarray(np.rint(level * np.log2(width)), np.uint8)


def _start_marks(done: Run, attempt: Attempt) -> Marks:
    good = attempt.good
    uv, first = (values[good].astype(np.float32) for values in (attempt.uv_b, attempt.uv_a))
    return Marks(uv, halvings(done, attempt.level[good]), first)


def _waited(done: Run, frame: Frame, outcome: PictureOutcome) -> Frame:
    """No map yet: note the reason, and the trails to be drawn."""
    if done.system.chosen is None:
        if isinstance(outcome.attempt, Attempt):
            done.refused(outcome.attempt.reason)
        elif outcome.attempt is not None:
            done.refused(outcome.attempt)
        if outcome.waiting and outcome.waiting != FIRST:
            done.refused(outcome.waiting)
    trail = done.system.trail()
    if trail is None:
        return frame
    now, first = trail.now.astype(np.float32), trail.first.astype(np.float32)
    return frame._replace(tried=len(now), marks=Marks(now, halvings(done, trail.level), first))


def path(run: Run, live: bool = False) -> tuple[IntArray, Array]:
    """Numbers (n,) of pictures with a pose, and ``T_cam_world`` (n, 4, 4); ``live``: as they were told."""
    if not live:
        numbers, T = run.system.trajectory()
        return numbers.astype(np.int64), T
    told = [pose for _, pose in sorted(run.system.poses.items()) if pose.live is not None]
    T = np.stack([pose.live for pose in told if pose.live is not None]) if told else np.zeros((0, 4, 4))
    return np.array([pose.number for pose in told], np.int64), T
