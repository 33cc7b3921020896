"""Before there is a map: corners of a first picture, followed from picture to picture.

::

    first picture          second              third    ...    newest
    corner o - - - - - - - - > o - - - - - - - - > o - - - - - - > o     one trail: its places
            small images,      its own speed,      its own speed,
            a wide radius      a narrow radius     a narrow radius

Until a point has been found once, nobody knows how fast it moves.  The small images tell how the whole
picture moved, and the search is wide.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.features import (
    View,
    finest_from_level,
    follow,
    level_from_finest,
    level_sigma,
    moved_by,
    plane_motion,
)
from vslam_ref.systems.ptam.look import spread, strong_corners
from vslam_ref.systems.ptam.settings import FeatureSettings, StartSettings
from vslam_ref.systems.visual_map import PreparedPicture
from vslam_ref.systems.visual_map.telling import FIRST

LEVELS = (0, 1)
"""Of the pyramid, on which trails run: a bare scene has too few corners on one."""


@dataclass(frozen=True)
class Trails:
    """Points of a first picture and where they went.

    Attributes
    ----------
    pictures : list of PreparedPicture
        P of them, from the first to the newest.
    level : ndarray of int64, shape (n,)
    places : ndarray, shape (P, n, 2)
        Pixels of level 0 in every picture.
    speed : ndarray, shape (n, 2)
        Pixels a picture.
    """

    pictures: list[PreparedPicture]
    level: IntArray
    places: Array
    speed: Array

    @property
    def first(self) -> Array:
        """Places in the first picture (n, 2), pixels."""
        return np.asarray(self.places[0])

    @property
    def now(self) -> Array:
        """Places in the newest picture (n, 2), pixels."""
        return np.asarray(self.places[-1])

    @property
    def moved(self) -> Array:
        """Median distance from the first picture to each (P,), pixels."""
        if not len(self.level):
            return np.zeros(len(self.pictures))
        away = self.places - self.first
        return np.asarray(np.median(np.hypot(away[..., 0], away[..., 1]), axis=1))

    @property
    def length(self) -> float:
        """Median distance that the points have moved, pixels."""
        return float(self.moved[-1])

    def only(self, rows: IntArray, now: Array) -> Trails:
        """Return some of them (m,), with better places (m, 2)."""
        places = self.places[:, rows].copy()
        places[-1] = now
        return Trails(self.pictures, self.level[rows], places, self.speed[rows])


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
    return Trails([picture], np.concatenate(level), uv[None], np.zeros_like(uv))


def go_on(trails: Trails, picture: PreparedPicture, s: StartSettings) -> Trails:
    """Follow all trails into the next picture; those that are lost end.

    Implements :eq:`eq-home`, pixels of level 0.
    """
    went = None
    if len(trails.pictures) > 1:
        went = _step(trails, picture, trails.now + trails.speed, s.search_radius)
    if went is None or went.ok.sum() < s.found_again * len(went.ok):
        wide = _step(trails, picture, _as_the_whole(trails, picture), 2.0 * s.search_radius)
        if went is None or wide.ok.sum() > went.ok.sum():
            went = wide
    now, ok = went
    return Trails(
        [*trails.pictures, picture],
        trails.level[ok],
        np.concatenate([trails.places[:, ok], now[None, ok]]),
        (now - trails.now)[ok],
    )


def _as_the_whole(trails: Trails, picture: PreparedPicture) -> Array:
    """Where the points are (n, 2), pixels, if they moved as the small images did."""
    last = trails.pictures[-1]
    motion = plane_motion(last.small, picture.small)
    return trails.now if motion.reason else moved_by(motion, last.small, trails.now)


def worn(trails: Trails | None, s: StartSettings) -> str:
    """Why trails begin anew with this picture, or nothing."""
    if trails is None:
        return FIRST
    if len(trails.level) < s.least_trails:
        return f"{len(trails.level)} corners were found again: need {s.least_trails}, begun anew"
    if len(trails.pictures) > s.patience:
        return f"{s.patience} pictures without a start: begun anew"
    return ""


def too_few(trails: Trails, s: StartSettings) -> str:
    """Why trails that just began lead nowhere, or nothing."""
    count = len(trails.level)
    return f"{count} corners in a picture: need {s.least_trails}" if count < s.least_trails else ""


def blank(
    trails: Trails, went: Trails, picture: PreparedPicture, s: StartSettings, f: FeatureSettings
) -> str:
    """Why a picture is passed over, or nothing: trails end in it, and it has no corners to begin others with.

    Somebody's hand before the lens, or a frame that was not taken: the trails wait for the next picture.
    """
    if not len(went.level) < s.least_trails <= len(trails.level):
        return ""
    few = too_few(begin(picture, s, f), s)
    return f"passed over: {few}" if few else ""


def too_early(trails: Trails, s: StartSettings) -> str:
    """Why no start is tried yet, or nothing."""
    if trails.length < s.least_motion:
        return f"the corners have moved {trails.length:.2f} px: need {s.least_motion:g}"
    count = len(trails.pictures) - 1
    if count < s.least_pictures:
        return f"the corners were followed over {count} pictures: need {s.least_pictures}"
    return ""


def from_the_first(trails: Trails) -> Array:
    """Where the first picture's own patches lie now (n, 2), pixels; NaN where they are not found any more.

    Followed from picture to picture, a patch drifts off by a little each time.
    """
    return again_in(trails, -1)


def again_in(trails: Trails, number: int) -> Array:
    """The same (n, 2) for one of the trails' pictures, by its number among them; pixels, or NaN."""
    first, then = trails.pictures[0], trails.pictures[number]
    at, ok = _followed(first, then, trails.level, trails.first, trails.places[number], 4.0)
    return np.where(ok[:, None], at, np.nan)


class _Went(NamedTuple):
    """Places (n, 2), pixels of level 0, and which points were found (n,)."""

    now: Array
    ok: BoolArray


def _step(trails: Trails, picture: PreparedPicture, guess: Array, radius: float) -> _Went:
    return _followed(trails.pictures[-1], picture, trails.level, trails.now, guess, radius)


def _followed(
    a: PreparedPicture, b: PreparedPicture, level: IntArray, uv: Array, guess: Array, radius: float
) -> _Went:
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
    return _Went(place, ok)
