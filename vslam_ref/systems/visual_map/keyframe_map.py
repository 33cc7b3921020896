"""Keyframes, points, and which keyframe saw which point where: what every map of a visual system holds.

====================  ==============================================================================
``keyframes``         ``T_kf_world`` (K, 4, 4); ``frame`` (K,), the number of the picture
``points``            ``X_world`` (N, 3); ``alive`` (N,)
``sightings``         ``kf``, ``point``, ``level`` (M,); ``uv`` (M, 2), pixels of level 0; ``on`` (M,)
====================  ==============================================================================

The row is the name, and no row is used twice.  A kind of map adds columns, and says which sightings a point
needs to live.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.features import level_sigma
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.visual_map.rows import Rows

Bytes = NDArray[np.uint8]
Rowlike = NDArray[Any]
"""Numbers of rows, or a mask of all."""


@dataclass
class KeyframeMap:
    """What all maps of one camera have in common; the tables come from the kind of map.

    Parameters
    ----------
    camera : Camera
    shape : tuple of int
        Height and width of the pictures.
    """

    camera: Camera
    shape: tuple[int, int]
    keyframes: Rows = field(kw_only=True)
    points: Rows = field(kw_only=True)
    sightings: Rows = field(kw_only=True)
    version: int = field(default=0, kw_only=True)

    @property
    def T_kf_world(self) -> Array:
        """Poses of the keyframes, (K, 4, 4)."""
        return self.keyframes["T_kf_world"]

    @property
    def X_world(self) -> Array:
        """All points, dead ones too, (N, 3)."""
        return self.points["X_world"]

    @property
    def alive(self) -> BoolArray:
        """Which points are in use, (N,)."""
        return self.points["alive"]

    def used_keyframes(self) -> IntArray:
        """Numbers of the keyframes that are in use; all of them, unless a kind of map drops some."""
        return np.arange(len(self.keyframes))

    def level_sigma(self, level: ArrayLike) -> Array:
        """Standard deviation of what is found on a level, in pixels of level 0."""
        return level_sigma(level)

    def lives(self, on: BoolArray) -> BoolArray:
        """Which points (N,) may live with the sightings (M,) that are left: those seen twice."""
        return np.asarray(np.bincount(self.sightings["point"][on], minlength=len(self.points)) >= 2)

    def take_back(self, sightings: Rowlike) -> IntArray:
        """Take sightings back (numbers, or a mask of all); return the points (n,) that die of it."""
        on = self.sightings["on"]
        on[sightings] = False
        dead = np.flatnonzero(self.alive & ~self.lives(on))
        self.remove(dead)
        return dead

    def remove(self, points: Rowlike) -> None:
        """Let points die, with all their sightings."""
        self.alive[points] = False
        seen = self.sightings
        rows = np.flatnonzero(seen["on"])
        seen["on"][rows[~self.alive[seen["point"][rows]]]] = False
        self.version += 1

    def change_camera(self, camera: Camera) -> None:
        """Take another camera; poses, points and sightings stay."""
        self.camera = camera
        self.version += 1

    def rows_in(self, kf: int) -> IntArray:
        """Rows of the sightings (n,) of a keyframe."""
        seen = self.sightings
        return np.flatnonzero((seen["kf"] == kf) & seen["on"])

    def measured_in(self, kf: int) -> IntArray:
        """Numbers of the points (n,) that a keyframe sees."""
        return np.asarray(self.sightings["point"][self.rows_in(kf)])

    def greys(self, points: IntArray) -> Bytes:
        """Grey levels of points (n,), where they were first seen."""
        raise NotImplementedError


def shared_points(visual_map: KeyframeMap, kf: int) -> IntArray:
    """How many points each keyframe (K,) has in common with ``kf``; at ``kf``, how many that sees."""
    seen = visual_map.sightings
    in_kf = np.zeros(len(visual_map.points) + 1, np.bool_)  # the last stands for none, -1
    in_kf[visual_map.measured_in(kf)] = True
    common = seen["on"] & in_kf[seen["point"]]
    return np.bincount(seen["kf"][common], minlength=len(visual_map.keyframes))


def neighbours(visual_map: KeyframeMap, kf: int, count: int) -> IntArray:
    """Keyframes (at most ``count``) that share most points with ``kf``, most first; without ``kf`` itself."""
    shared = shared_points(visual_map, kf)
    shared[kf] = 0
    order = np.argsort(-shared, kind="stable")[:count]
    return np.asarray(order[shared[order] > 0])
