"""What a system that tracks pictures tells: of each picture, of its path, and of a start that was tried."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.geometry import camera_pose, se3

FIRST = "the first picture"
"""Why nothing is tried with it."""


class Quality(Enum):
    """How well a picture was tracked."""

    GOOD = "good"
    POOR = "poor"
    LOST = "lost"


class Told(NamedTuple):
    """A tracked picture in a few words.

    Attributes
    ----------
    quality : Quality
    way : str
        How the pose was found.
    tried : int
        Points that were looked for.
    uv : ndarray, shape (n, 2)
        Where those lie that agree with the pose, pixels of level 0.
    level : ndarray of int64, shape (n,)
        Of the pyramid, on which they were found.
    sigma : float
        Scale of their errors, pixels of their level.
    """

    quality: Quality
    way: str
    tried: int
    uv: Array
    level: IntArray
    sigma: float


class TrackedPicture(Protocol):
    """What a tracker returns; each system has its own."""

    @property
    def quality(self) -> Quality:
        """Whether the pose is to be believed."""

    @property
    def T_cam_world(self) -> Array:
        """The pose (4, 4), in the map's own unit."""

    def told(self) -> Told:
        """The same in a few words."""


class Attempt(NamedTuple):
    """What two pictures told when a start was tried with them.

    Attributes
    ----------
    T_b_a : ndarray, shape (4, 4)
    uv_a, uv_b : ndarray, shape (n, 2)
        Matches that were asked, pixels.
    level : ndarray of int64, shape (n,)
    good : ndarray of bool, shape (n,)
        Those that agree, with depth.
    X_a : ndarray, shape (n, 3)
        Points in the first camera's frame; the base line is 1.
    cost : float
        Pixels squared per pair, outliers too, but not pairs that fit no answer.
    rivals : tuple of (str, float)
        Other answers of the two pictures and their costs.
    parallax : float
        Median, degrees.
    reason : str
        Empty if this is a start.
    row : ndarray of int64, shape (n,)
        Numbers of these matches among those that were followed.
    between : int
        Number of the picture that was asked which answer is right; -1 where none was.
    """

    T_b_a: Array
    uv_a: Array
    uv_b: Array
    level: IntArray
    good: BoolArray
    X_a: Array
    cost: float
    rivals: tuple[tuple[str, float], ...]
    parallax: float
    reason: str
    row: IntArray
    between: int


class PictureOutcome(NamedTuple):
    """What became of one picture.

    Attributes
    ----------
    number : int
    tracked : TrackedPicture or None
        None before there is a map.
    mapped : object or None
        What the mapper says, if it became a keyframe.
    attempt : Attempt or str or None
        Of a start, if one was tried; a sentence where there was nothing to try.
    waiting : str
        Why no start was even tried; empty where one was, or where there is a map.
    queued : bool
        Whether it was handed to a mapper in another thread, to become a keyframe.
    stages : mapping of str to float
        CPU time of the thread, seconds, by those of the system's stages that had a part in it; together the
        whole step.
    """

    number: int
    tracked: Any = None
    mapped: Any = None
    attempt: Attempt | str | None = None
    waiting: str = ""
    queued: bool = False
    stages: Mapping[str, float] = MappingProxyType({})


class Pose(NamedTuple):
    """Pose relative to a keyframe, ``T_cam_kf (4, 4)``, and ``live (4, 4)`` as told then; own unit."""

    number: int
    kf: int
    T_cam_kf: Array
    live: Array | None


def path_of(poses: Mapping[int, Pose], T_kf_world: ArrayLike) -> tuple[Array, Array]:
    """Numbers of the pictures that have a pose (n,), and their poses ``T_cam_world`` (n, 4, 4).

    Keyframes ``T_kf_world (K, 4, 4)``, in the map's own unit.
    """
    if not poses:
        return np.zeros(0, np.int64), np.zeros((0, 4, 4))
    T = np.asarray(T_kf_world)
    each = [poses[number] for number in sorted(poses)]
    return np.array(sorted(poses)), np.stack([se3.compose(p.T_cam_kf, T[p.kf]) for p in each])


def nearest_keyframe(T_kf_world: ArrayLike, T_cam_world: ArrayLike) -> int:
    """Number of the keyframe (K, 4, 4) nearest to a pose (4, 4), by the centres in the map's own unit."""
    centres = camera_pose.centre_from_pose(T_kf_world)
    return int(np.argmin(np.linalg.norm(centres - camera_pose.centre_from_pose(T_cam_world), axis=1)))


class Trail(NamedTuple):
    """Points that are followed before there is a map: where they are now, their level, where they began.

    ``now (n, 2)``, ``level (n,)``, ``first (n, 2)``; pixels of level 0.
    """

    now: Array
    level: IntArray
    first: Array
