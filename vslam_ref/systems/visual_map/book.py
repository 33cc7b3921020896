"""A map in plain dictionaries: who saw what where, what is adjusted, and what is taken back.

Poses ``T (4, 4)`` map the map's frame to a camera's, points ``X (3,)`` have the map's own unit, pixels
``u (2,)`` are of level 0.  :mod:`.visual_map` holds the same in arrays; chapter 12 reads this.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle import BundleProblem, Observations, Scene, freedom
from vslam_ref.estimation.bundle.book import bundle_adjust_book
from vslam_ref.estimation.robust import tuned
from vslam_ref.estimation.robust.scale import MAD_NORM_2D
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.visual_map.visual_map import PreparedPicture

TUKEY = tuned("tukey", 2)
FLOOR = 0.4
"""Pixels of the level: the scale of the errors is at least this."""


class BookSighting(NamedTuple):
    """Place u (2,) in pixels of level 0, the level on which it was found, whether it is the point's first."""

    u: Array
    level: int
    first: bool = False


@dataclass
class BookMap:
    """Keyframes: poses (4, 4), pictures.  By number X (3,), own unit, looks and finds.  Who saw whom."""

    camera: Camera
    poses: list[Array] = field(default_factory=list)
    pictures: list[PreparedPicture] = field(default_factory=list)
    X: dict[int, Array] = field(default_factory=dict)
    sightings: dict[tuple[int, int], BookSighting] = field(default_factory=dict)
    tried: dict[int, int] = field(default_factory=dict)
    found: dict[int, int] = field(default_factory=dict)

    def seen(self) -> dict[int, set[int]]:
        """Which points each keyframe sees."""
        return {k: {p for kf, p in self.sightings if kf == k} for k in range(len(self.poses))}

    def depth(self, kf: int) -> float:
        """Median depth of what a keyframe sees, in the map's own unit."""
        return float(np.median([se3.act(self.poses[kf], self.X[p])[2] for p in self.seen()[kf]]))

    def add(self, X: Array, a: int, b: int, level: int, places: tuple[Array, Array]) -> int:
        """Take in a point X (3,), own unit, seen first in keyframe a, then in b, at two pixels (2,)."""
        p = len(self.tried)  # never the number of another, dead or alive
        self.X[p], self.tried[p], self.found[p] = X, 0, 0
        self.sightings[a, p] = BookSighting(places[0], level, first=True)
        self.sightings[b, p] = BookSighting(places[1], level)
        return p

    def drop(self, p: int) -> None:
        """End a point, with all its sightings."""
        del self.X[p]
        self.sightings = {key: at for key, at in self.sightings.items() if key[1] != p}

    def take_back(self, kf: int, p: int) -> None:
        """A sighting that counts no longer; a point ends with its first, or with the last but one."""
        if p in self.X:
            at = self.sightings.pop((kf, p))
            if at.first or sum(other == p for _, other in self.sightings) < 2:
                self.drop(p)


def adjust(made: BookMap, active: set[int], points: set[int]) -> None:
    """Move keyframes and points to where the sightings agree best; take back those that do not."""
    keys = [key for key in sorted(made.sightings) if key[1] in points]
    for _ in range(2):  # the second time with the scale of what is left
        sigma = max(MAD_NORM_2D * float(np.median([size(made, *key) for key in keys])), FLOOR)  # eq-mad-norm
        views, numbers = sorted({k for k, _ in keys}), sorted(points)
        scene = bundle_adjust_book(problem(made, keys, active, sigma), TUKEY, iterations=5).scene  # eq-a2-9
        for k, T in zip(views, scene.T_cam_world, strict=True):
            made.poses[k] = T
        for p, X in zip(numbers, scene.X_world, strict=True):
            made.X[p] = X
    for key in keys:
        if key in made.sightings and size(made, *key) >= TUKEY.c * sigma:
            made.take_back(*key)


def size(made: BookMap, kf: int, p: int) -> float:
    """Error of a sighting in pixels of its level; infinite behind the camera."""
    seen = made.sightings[kf, p]
    at = made.camera.pixel_from_world(made.poses[kf], made.X[p])
    return float(np.hypot(*(at.uv - seen.u))) / 2**seen.level if at.valid else np.inf  # eq-a2-7


def problem(made: BookMap, keys: list[tuple[int, int]], active: set[int], sigma: float) -> BundleProblem:
    """Sightings as a problem of bundle adjustment: some keyframes move; sigma is in pixels of the level."""
    views, numbers = sorted({k for k, _ in keys}), sorted({p for _, p in keys})
    scene = Scene(
        np.stack([made.poses[k] for k in views]),
        np.stack([made.X[p] for p in numbers]),
        made.camera.params[None],
    )
    seen = [made.sightings[key] for key in keys]
    observed = Observations(
        np.array([views.index(k) for k, _ in keys]),
        np.array([numbers.index(p) for _, p in keys]),
        np.stack([at.u for at in seen]),
        np.stack([(sigma * 2**at.level) ** 2 * np.eye(2) for at in seen]),  # eq-level-sigma
    )
    model = type(made.camera)
    free = freedom(model, scene, fixed_views=[i for i, k in enumerate(views) if k not in active])
    return BundleProblem(model, scene, observed, free=free)
