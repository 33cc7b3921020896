"""Before there is a map: corners of a first picture, followed from picture to picture."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.features import View, finest_from_level, follow, level_from_finest, level_sigma
from vslam_ref.systems.ptam.look import spread, strong_corners
from vslam_ref.systems.ptam.settings import FeatureSettings, StartSettings
from vslam_ref.systems.visual_map import PreparedPicture

LEVELS = (0, 1)
"""Of the pyramid, on which trails run: a bare scene has too few corners on one."""


@dataclass
class Trails:
    """Points of a first picture and where they are now.

    Attributes
    ----------
    pictures : list of PreparedPicture
        From the first to the newest.
    level : ndarray of int64, shape (n,)
    first, now, speed : ndarray, shape (n, 2)
        Pixels of level 0; the speed in pixels a picture.
    """

    pictures: list[PreparedPicture]
    level: IntArray
    first: Array
    now: Array
    speed: Array = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def length(self) -> float:
        """Median distance that the points have moved, pixels."""
        return float(np.median(np.hypot(*(self.now - self.first).T))) if len(self.now) else 0.0

    def only(self, rows: IntArray, now: Array) -> Trails:
        """Return some of them (m,), with better places (m, 2)."""
        return Trails(self.pictures, self.level[rows], self.first[rows], now, self.speed[rows])


def begin(picture: PreparedPicture, s: StartSettings, f: FeatureSettings) -> Trails:
    """Take the strongest corners of a picture, spread over it."""
    level, place = [], []
    for each in LEVELS:
        number = strong_corners(picture, each, f)
        xy = picture.corners[each].xy[number]
        rows = spread(xy, picture.levels[each].shape, s.trails // (1 + each))
        level.append(np.full(len(rows), each))
        place.append(finest_from_level(xy[rows], each))
    uv = np.concatenate(place)
    return Trails([picture], np.concatenate(level), uv, uv.copy(), np.zeros_like(uv))


def go_on(trails: Trails, picture: PreparedPicture, s: StartSettings) -> Trails:
    """Follow all trails into the next picture; those that are lost end."""
    last = trails.pictures[-1]
    guess = trails.now + trails.speed
    now, ok = _followed(last, picture, trails.level, trails.now, guess, s.search_radius)
    kept = Trails(
        [*trails.pictures, picture],
        trails.level[ok],
        trails.first[ok],
        now[ok],
        (now - trails.now)[ok],
    )
    return kept


def from_the_first(trails: Trails) -> Array:
    """Where the first picture's own patches lie now (n, 2), pixels; NaN where they are not found any more.

    Followed from picture to picture, a patch drifts off by a little each time.
    """
    first, last = trails.pictures[0], trails.pictures[-1]
    now, ok = _followed(first, last, trails.level, trails.first, trails.now, 4.0)
    return np.where(ok[:, None], now, np.nan)


def _followed(
    a: PreparedPicture, b: PreparedPicture, level: IntArray, uv: Array, guess: Array, radius: float
) -> tuple[Array, BoolArray]:
    place, ok = uv.copy(), np.zeros(len(uv), np.bool_)
    for each in LEVELS:
        rows = np.flatnonzero(level == each)
        went = follow(
            View(a.levels[each], a.corners[each]),
            View(b.levels[each], b.corners[each]),
            level_from_finest(uv[rows], each),
            max(radius / float(level_sigma(each)), 3.0),
            guess=level_from_finest(guess[rows], each),
        )
        place[rows], ok[rows] = finest_from_level(went.uv, each), went.ok
    return place, ok
