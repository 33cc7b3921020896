"""One run of PTAM over a recorded sequence, in numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.experiments.ptam.recorded import RecordedSequence, open_recorded, second_path
from vslam_ref.experiments.visual_slam import numbers, running
from vslam_ref.support.config import replace_settings

REASON_LENGTH = 200


class OffsetRun(NamedTuple):
    """What became of one run; NaN where there is nothing to tell.

    Attributes
    ----------
    offset, started : ndarray
        First picture, and whether there was a map in time.
    first, second : ndarray
        The two pictures of the start; -1 without one.
    frames, tracked, lost : ndarray
        Pictures from the offset on, those with a pose, and those lost after the start.
    share_all, share_after : ndarray
        With a pose, of all pictures, and of those from the second one of the start on.
    error, live, second_error : ndarray
        Of the final path, of the live path, and of the final path against the other one; in the table's unit.
    drift : ndarray
        Scale of the last third over that of the first.
    refined_error, refined_drift : ndarray
        Of a second run with the camera that a first one has refined.
    keyframes, points : ndarray
    reason : ndarray of str
        Why there was no start.
    """

    offset: IntArray
    started: BoolArray
    first: IntArray
    second: IntArray
    frames: IntArray
    tracked: IntArray
    lost: IntArray
    share_all: Array
    share_after: Array
    error: Array
    live: Array
    second_error: Array
    drift: Array
    refined_error: Array
    refined_drift: Array
    keyframes: IntArray
    points: IntArray
    reason: NDArray[np.str_]


def run_twice(
    each: RecordedSequence, offset: int, pictures: int | None, settings: Any
) -> tuple[running.Run, running.Run | None]:
    """Run a system from one picture to the end; where the table asks for it, with a refined camera, too.

    ``settings`` decide which system runs.  The second run takes the camera that another one has refined; it
    is None where none was asked for, or where the camera could not be refined.
    """
    sequence = open_recorded(each, offset, pictures)

    def stop(done: running.Run) -> bool:
        return done.system.map is None and len(done.frames) >= each.start_within

    done = running.run(sequence, settings, stop)
    if each.most_refined is None or done.system.map is None:
        return done, None
    refined = running.run(sequence, replace_settings(settings, {"camera.refine": True}), stop).system.refined
    if refined is None:
        return done, None
    return done, running.run(replace(sequence, camera=refined.camera), settings, stop)


def told(
    each: RecordedSequence, offset: int, done: running.Run, refined: running.Run | None = None
) -> OffsetRun:
    """Return the numbers of a run that began with picture ``offset``, and of one with a refined camera."""
    which, T = running.path(done)
    final = numbers.accuracy(done.sequence, which, T)
    live = numbers.accuracy(done.sequence, *running.path(done, live=True))
    other = second_path(each)
    second = numbers.accuracy(replace(done.sequence, truth=other), which, T) if other is not None else None
    started = done.system.started_at
    frames = len(done.sequence)
    later = frames if started is None else int((done.sequence.numbers >= started[1]).sum())
    kept = 0 if started is None else int((which >= started[1]).sum())
    first_two = (-1, -1) if started is None else started
    visual_map = done.system.map

    again = None if refined is None else numbers.accuracy(refined.sequence, *running.path(refined))

    def scaled(found: numbers.Accuracy | None) -> float:
        value = None if found is None else getattr(found, each.error)
        return np.nan if value is None else each.error_scale * value

    return OffsetRun(
        np.array(offset),
        np.array(started is not None),
        np.array(first_two[0]),
        np.array(first_two[1]),
        np.array(frames),
        np.array(len(which)),
        np.array(sum(frame.state == running.LOST for frame in done.frames)),
        np.array(len(which) / frames),
        np.array(kept / later if started is not None else np.nan),
        np.array(scaled(final)),
        np.array(scaled(live)),
        np.array(scaled(second)),
        np.array(np.nan if final.drift is None else final.drift),
        np.array(scaled(again)),
        np.array(np.nan if again is None or again.drift is None else again.drift),
        np.array(0 if visual_map is None else len(visual_map.keyframes)),
        np.array(0 if visual_map is None else int(visual_map.alive.sum())),
        np.array(done.no_start() or "", f"<U{REASON_LENGTH}"),
    )
