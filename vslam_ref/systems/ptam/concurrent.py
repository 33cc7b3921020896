"""Tracking and mapping side by side: the mapper has a thread of its own, and the map is the mapper's.

::

    tracker (the caller's thread)                      mapper (its own thread)
    picture -> shown map -> pose -> keyframe? -- Handed -->  waiting ... map_keyframe on the map
                   ^                                              |
                   +------------ snapshot, FinishedKeyframe <---------------+

The tracker only reads the *shown* map, a snapshot that nobody changes; a newer one is taken between two
pictures.  Poses are carried over by their reference keyframe: what was near keyframe k stays near it,
wherever an adjustment has moved it.  What goes over with a keyframe: the picture, its pose from its reference
keyframe, its sightings by the numbers of points, and how often points were looked for and found since the
last one.

Pictures from a file come as fast as they are asked for.  So the tracker waits where the mapper is too far
behind: a live camera would drop pictures instead.  The steps are those of the interleaved form; only their
order is open, and with it the last digits, and which pictures become keyframes.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import se3
from vslam_ref.support.stopwatch import Stopwatch
from vslam_ref.systems.ptam.mapper.mapper import MappedKeyframe, map_keyframe
from vslam_ref.systems.ptam.ptam import PictureOutcome, Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.systems.ptam.tracker.recover import Known
from vslam_ref.systems.ptam.tracker.tracker import Tracked
from vslam_ref.systems.visual_map import PreparedPicture, VisualMap
from vslam_ref.systems.visual_map.telling import Attempt, nearest_keyframe


class Handed(NamedTuple):
    """A keyframe on its way to the mapper.

    Attributes
    ----------
    picture : PreparedPicture
    kf : int
        Reference keyframe of its pose.
    T_cam_kf : ndarray, shape (4, 4)
        From there; lengths in the map's own unit.
    seen : Known
        Points that it sees, by their numbers.
    tried, found : ndarray of int64, shape (n,)
        How often each of the first n points was looked for, and found, since the last keyframe.
    """

    picture: PreparedPicture
    kf: int
    T_cam_kf: Array
    seen: Known
    tried: IntArray
    found: IntArray


class FinishedKeyframe(NamedTuple):
    """A keyframe that is in the map: number of the picture, what it brought, CPU seconds by stage."""

    number: int
    keyframe: MappedKeyframe
    stages: Mapping[str, float]


def take_in(visual_map: VisualMap, handed: Handed, settings: Settings) -> MappedKeyframe:
    """Take a keyframe that was handed over into the map, in the mapper's thread."""
    count = len(handed.tried)
    visual_map.points["tried"][:count] += handed.tried
    visual_map.points["found"][:count] += handed.found
    T = se3.compose(handed.T_cam_kf, visual_map.T_kf_world[handed.kf])
    return map_keyframe(visual_map, handed.picture, T, handed.seen, settings)


class MapperThread:
    """The mapper: it owns a map, takes keyframes one by one, and shows the map after each.

    Parameters
    ----------
    visual_map : VisualMap
        From now on this thread's; to be touched by nobody else before :meth:`close`.
    settings : Settings
    """

    def __init__(self, visual_map: VisualMap, settings: Settings) -> None:
        self._map, self._settings = visual_map, settings
        self._shown = visual_map.snapshot()
        self._waiting: deque[Handed] = deque()
        self._ready: deque[FinishedKeyframe] = deque()
        self._busy = self._ending = False
        self._error: BaseException | None = None
        self._change = threading.Condition()
        self._thread = threading.Thread(target=self._work, name="mapper", daemon=True)
        self._thread.start()

    def hand(self, handed: Handed) -> None:
        """Hand a keyframe over; never waits."""
        with self._change:
            self._waiting.append(handed)
            self._change.notify_all()

    def unfinished(self) -> int:
        """How many keyframes were handed over and are not in the shown map yet."""
        with self._change:
            return self._unfinished()

    def collect(self) -> tuple[VisualMap, list[FinishedKeyframe]]:
        """Return the map as it is shown now, and the keyframes that are in it since the last call.

        Raises
        ------
        BaseException
            The mapper's own, if it ended with one.
        """
        with self._change:
            self._raise()
            ready = list(self._ready)
            self._ready.clear()
            return self._shown, ready

    def wait(self, most: int) -> None:
        """Wait until at most so many keyframes are unfinished, or the mapper has ended with an exception."""
        with self._change:
            self._change.wait_for(lambda: self._unfinished() <= most or self._error is not None)
            self._raise()

    def close(self, *, finish: bool = True) -> None:
        """End the thread, after all keyframes or, without ``finish``, after the one at hand."""
        with self._change:
            self._ending = True
            if not finish:
                self._waiting.clear()
            self._change.notify_all()
        self._thread.join()

    def _unfinished(self) -> int:
        return len(self._waiting) + self._busy

    def _raise(self) -> None:
        if self._error is not None:
            raise self._error

    def _work(self) -> None:
        try:
            while (handed := self._next()) is not None:
                with Stopwatch() as watch:
                    mapped = take_in(self._map, handed, self._settings)
                shown = self._map.snapshot()
                with self._change:
                    self._shown, self._busy = shown, False
                    self._ready.append(FinishedKeyframe(handed.picture.number, mapped, watch.seconds))
                    self._change.notify_all()
        except BaseException as error:  # it surfaces in the tracker's thread
            with self._change:
                self._error, self._busy = error, False
                self._change.notify_all()

    def _next(self) -> Handed | None:
        with self._change:
            self._change.wait_for(lambda: self._waiting or self._ending)
            self._busy = bool(self._waiting)
            return self._waiting.popleft() if self._waiting else None


class ConcurrentPtam(Ptam):
    """Parallel tracking and mapping with the mapper in a thread of its own; close it in the end."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.mapper: MapperThread | None = None
        self.shown: VisualMap | None = None
        self.tried = self.found = np.zeros(0, np.int64)
        self.handed_at: deque[int] = deque()
        self.tracked_so_far = 0
        self.mapping_stages: dict[int, Mapping[str, float]] = {}

    def _start(self, found: Attempt) -> None:
        super()._start(found)
        assert self.map is not None
        self.mapper = MapperThread(self.map, self.settings)
        self.shown, _ = self.mapper.collect()
        self._count_anew(self.shown)

    def _with_the_map(self, known: VisualMap, picture: PreparedPicture) -> PictureOutcome:
        assert self.tracker is not None
        assert self.mapper is not None
        self.tracked_so_far += 1
        shown = self._look_at_the_newest_map(self.mapper)
        tracked, kf = self._track(self.tracker, shown, picture)
        if tracked.quality is Quality.LOST:
            return PictureOutcome(picture.number, tracked)
        self._count(self.tried, self.found, tracked)
        self._note(shown, picture, tracked, kf, live=True)
        queued = self.policy.wants(shown, tracked) and len(self.handed_at) < self.settings.mapper.queue
        if queued:
            self._hand(self.mapper, shown, picture, tracked)
        return PictureOutcome(picture.number, tracked, queued=queued)

    def _look_at_the_newest_map(self, mapper: MapperThread) -> VisualMap:
        """Wait if the mapper is too far behind; then take its newest map, and carry the last pose over."""
        assert self.shown is not None
        late = sum(self.tracked_so_far - at > self.settings.mapper.lag for at in self.handed_at)
        if late:
            mapper.wait(len(self.handed_at) - late)
        shown, ready = mapper.collect()
        for done in ready:
            self._finished(done)
        if shown is not self.shown:
            self._carry_over(self.shown, shown)
            self.shown = shown
        return shown

    def _finished(self, done: FinishedKeyframe) -> None:
        self.handed_at.popleft()
        self._is_keyframe(done.number, done.keyframe.kf)
        self.mapping_stages[done.number] = done.stages

    def _carry_over(self, before: VisualMap, now: VisualMap) -> None:
        """Move the tracker's last pose with its reference keyframe, and make room for new points."""
        assert self.tracker is not None
        kf = nearest_keyframe(before.T_kf_world, self.tracker.T_last)
        T_cam_kf = se3.compose(self.tracker.T_last, se3.inverse(before.T_kf_world[kf]))
        self.tracker.T_last = se3.compose(T_cam_kf, now.T_kf_world[kf])
        more = np.zeros(len(now.points) - len(self.tried), np.int64)
        self.tried, self.found = np.concatenate([self.tried, more]), np.concatenate([self.found, more])

    def _hand(
        self, mapper: MapperThread, shown: VisualMap, picture: PreparedPicture, tracked: Tracked
    ) -> None:
        assert self.tracker is not None
        assert self.tracker.known is not None  # it has just tracked this picture
        pose = self.poses[picture.number]
        mapper.hand(Handed(picture, pose.kf, pose.T_cam_kf, self.tracker.known, self.tried, self.found))
        self.handed_at.append(self.tracked_so_far)
        self._count_anew(shown)
        self.policy.taken()

    def _count_anew(self, shown: VisualMap) -> None:
        self.tried, self.found = np.zeros((2, len(shown.points)), np.int64)

    def finish(self) -> None:
        """Let the mapper end its keyframes, then adjust everything once more."""
        if self.mapper is not None:
            self.mapper.close()
            _, ready = self.mapper.collect()
            for done in ready:
                self._finished(done)
            self.mapper = None
        super().finish()

    def close(self) -> None:
        """End the mapper's thread without the keyframes that still wait."""
        if self.mapper is not None:
            mapper, self.mapper = self.mapper, None
            mapper.close(finish=False)
