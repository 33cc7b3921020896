"""One picture after the other into the system, and what became of each."""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.sequences import Image, Sequence
from vslam_ref.systems.ptam.concurrent import ConcurrentPtam
from vslam_ref.systems.ptam.ptam import PictureOutcome, Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.start import Attempt
from vslam_ref.systems.ptam.tracker.tracker import Tracked
from vslam_ref.systems.ptam.trails import FIRST, Trails
from vslam_ref.systems.visual_map.chosen_start import ChosenStart

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
        Seconds that its stages took of the processor, as :data:`~vslam_ref.systems.ptam.STAGES` names them.
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
    system : Ptam
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
    """

    sequence: Sequence
    settings: Settings
    system: Ptam
    frames: list[Frame] = field(default_factory=list)
    start: Attempt | None = None
    refusals: Counter[str] = field(default_factory=Counter)
    examples: dict[str, str] = field(default_factory=dict)
    finish_seconds: float = 0.0
    interrupted: bool = False
    filmed: int | None = None

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
    settings: Settings,
    stop: Callable[[Run], bool] = lambda done: False,
    progress: Callable[[], object] = lambda: None,
    *,
    chosen: ChosenStart | None = None,
    concurrent: bool = False,
) -> Run:
    """Run PTAM over a sequence.

    Parameters
    ----------
    sequence : Sequence
        With a camera.
    settings : Settings
    stop : callable
        Asked before each picture, with the run so far; true ends it there.
    progress : callable
        Called after each picture.
    chosen : ChosenStart, optional
        Two pictures to start from.
    concurrent : bool
        With the mapper in a thread of its own.

    Raises
    ------
    ValueError
        If the sequence has no camera.
    """
    if sequence.camera is None:
        raise ValueError(f"{sequence.name} has no camera: need one")
    system = (ConcurrentPtam if concurrent else Ptam)(sequence.camera, settings, chosen)
    done = Run(sequence, settings, system)
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
        return _tracked(frame, outcome, outcome.tracked)
    if not had_map and done.system.map is not None and isinstance(outcome.attempt, Attempt):
        done.start = outcome.attempt
        return frame._replace(state=START, keyframe=True, marks=_start_marks(outcome.attempt))
    return _waited(done, frame, outcome)


def _tracked(frame: Frame, outcome: PictureOutcome, tracked: Tracked) -> Frame:
    fine = tracked.fine
    state = tracked.quality.value
    if state == LOST:
        return frame._replace(state=state, way=tracked.way, tried=len(fine.seen.point))
    held = fine.weights > 0
    marks = Marks(fine.uv[held].astype(np.float32), fine.seen.level[held].astype(np.uint8))
    return frame._replace(
        state=state,
        way=tracked.way,
        tried=len(fine.seen.point),
        found=int(held.sum()),
        sigma=float(tracked.pose.sigma),
        keyframe=outcome.mapped is not None or outcome.queued,
        marks=marks,
    )


def _start_marks(attempt: Attempt) -> Marks:
    good = attempt.good
    uv, first = (values[good].astype(np.float32) for values in (attempt.uv_b, attempt.uv_a))
    return Marks(uv, attempt.level[good].astype(np.uint8), first)


def _waited(done: Run, frame: Frame, outcome: PictureOutcome) -> Frame:
    """No map yet: note the reason, and the trails to be drawn."""
    trails = done.system.trails
    if done.system.chosen is not None:
        return frame if trails is None else frame._replace(tried=len(trails.now), marks=_trail_marks(trails))
    if isinstance(outcome.attempt, Attempt):
        done.refused(outcome.attempt.reason)
    elif outcome.attempt is not None:
        done.refused(outcome.attempt)
    if outcome.waiting and outcome.waiting != FIRST:
        done.refused(outcome.waiting)
    if trails is None or len(trails.pictures) < 2:
        return frame
    return frame._replace(tried=len(trails.now), marks=_trail_marks(trails))


def _trail_marks(trails: Trails) -> Marks:
    now, first = trails.now.astype(np.float32), trails.first.astype(np.float32)
    return Marks(now, trails.level.astype(np.uint8), first)


def path(run: Run, live: bool = False) -> tuple[IntArray, Array]:
    """Numbers (n,) of pictures with a pose, and ``T_cam_world`` (n, 4, 4); ``live``: as they were told."""
    if not live:
        numbers, T = run.system.trajectory()
        return numbers.astype(np.int64), T
    told = [pose for _, pose in sorted(run.system.poses.items()) if pose.live is not None]
    T = np.stack([pose.live for pose in told if pose.live is not None]) if told else np.zeros((0, 4, 4))
    return np.array([pose.number for pose in told], np.int64), T
