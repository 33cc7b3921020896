"""From matches of a first picture and later ones to a first map, or the reason why not yet.

::

    first picture      ...      a picture between   ...   newest
    feature o - - - - - - - - - - - > o - - - - - - - - - > o      one row: its places, NaN where not found

Each later picture is matched with the first, so nothing drifts: a feature is looked for in a window around
where it was found last.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.vocabulary import Matching, turned_alike
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.geometry.multiview.two_views import essential_consensus
from vslam_ref.systems.orbslam.feature_map import DescribedPicture, FeatureMap
from vslam_ref.systems.orbslam.mapper.adjusting import adjust_all
from vslam_ref.systems.orbslam.mapper.new_points import new_points
from vslam_ref.systems.orbslam.settings import FeatureSettings, Settings, StartSettings
from vslam_ref.systems.orbslam.spanning_tree import link
from vslam_ref.systems.orbslam.window_search import Places, assigned, search_windows
from vslam_ref.systems.visual_map.starting import DRAWS, Between, Pair, judge_start, one_pixel, unit_depth
from vslam_ref.systems.visual_map.telling import Attempt

TURNS = Matching(bins=30, kept=3, least=0.1)
"""Of the histogram of turns: matches whose turn is not among the commonest are wrong."""


@dataclass(frozen=True)
class StartMatches:
    """A first picture and what later ones show of it.

    Attributes
    ----------
    pictures : list of DescribedPicture
        P of them, the first one first.
    places : ndarray, shape (P, n, 2)
        Where each feature of the first lies, pixels of level 0; NaN where it was not found.
    feature : ndarray of int64, shape (n,)
        Its number in the newest picture, or -1.
    last : ndarray, shape (n, 2)
        Where it was found last.
    """

    pictures: list[DescribedPicture]
    places: Array
    feature: IntArray
    last: Array

    @property
    def rows(self) -> IntArray:
        """Features of the first picture that the newest shows, (m,)."""
        return np.flatnonzero(self.feature >= 0)

    def moved(self, number: int) -> float:
        """Median distance from the first picture to one of the pictures, pixels; 0 where none was found."""
        away = np.hypot(*(self.places[number] - self.places[0]).T)
        return float(np.median(away[np.isfinite(away)])) if np.isfinite(away).any() else 0.0


def begin(picture: DescribedPicture, s: StartSettings) -> StartMatches:
    """Take a picture as the first."""
    f = picture.features
    feature = np.where(f.octave < s.octaves, np.arange(len(f.uv)), -1)
    return StartMatches([picture], f.uv[None], feature, f.uv)


def go_on(
    matched: StartMatches,
    picture: DescribedPicture,
    shape: tuple[int, int],
    s: StartSettings,
    f: FeatureSettings,
) -> StartMatches:
    """Match the first picture with the next, near where its features were found last; ``shape`` (H, W)."""
    a, b = matched.pictures[0].features, picture.features
    places = Places(
        matched.last, np.full(len(a.uv), s.window * shape[1]), a.octave - 1, a.octave + 1, a.descriptor
    )
    feature = assigned(search_windows(places, b), limit=f.near, ratio=s.ratio, room=len(b.uv))
    feature[a.octave >= s.octaves] = -1
    rows = np.flatnonzero(feature >= 0)
    feature[rows[~turned_alike(a.angle[rows], b.angle[feature[rows]], TURNS)]] = -1
    found = feature >= 0
    now = np.where(found[:, None], b.uv[feature], np.nan) if len(b.uv) else np.full_like(matched.last, np.nan)
    return StartMatches(
        [*matched.pictures, picture],
        np.concatenate([matched.places, now[None]]),
        feature,
        np.where(found[:, None], now, matched.last),
    )


def too_few(matched: StartMatches, s: StartSettings) -> str:
    """Why a picture that just became the first leads nowhere, or nothing."""
    count = len(matched.rows)
    return f"{count} features in a picture: need {s.least_matches}" if count < s.least_matches else ""


def worn(matched: StartMatches, s: StartSettings) -> str:
    """Why the newest picture becomes the first, or nothing."""
    if len(matched.rows) < s.least_matches:
        return f"{len(matched.rows)} features were found again: need {s.least_matches}, begun anew"
    if len(matched.pictures) > s.patience:
        return f"{s.patience} pictures without a start: begun anew"
    return ""


def too_early(matched: StartMatches, s: StartSettings) -> str:
    """Why no start is tried yet, or nothing."""
    moved, count = matched.moved(-1), len(matched.pictures) - 1
    if moved < s.least_motion:
        return f"the features have moved {moved:.2f} px: need {s.least_motion:g}"
    if count < s.least_pictures:
        return f"the features were followed over {count} pictures: need {s.least_pictures}"
    return ""


def attempt(
    camera: Camera, matched: StartMatches, s: StartSettings, scale: float, rng: np.random.Generator
) -> Attempt | str:
    """Try to start from the first picture, the newest and one between; a sentence if that is nothing.

    The scale of the octaves has no unit.
    """
    rows = matched.rows
    if len(rows) < max(s.least_matches, 8):
        return f"{len(rows)} features are still found: need {s.least_matches}"
    level = matched.pictures[0].features.octave[rows]
    pair = Pair(matched.places[0, rows], matched.places[-1, rows], level, scale ** level.astype(float), rows)
    return judge_start(camera, pair, _between(camera, matched, s, rng), s, rng)


def _between(
    camera: Camera, matched: StartMatches, s: StartSettings, rng: np.random.Generator
) -> Between | None:
    """The picture that lies half way, by how far the features had moved; None without one.

    A corner may have been found beside its place there: what fits no motion from the first picture is left
    out, as the pairs that fit none are.
    """
    moved = np.array([matched.moved(k) for k in range(len(matched.pictures))])
    if len(moved) < 3:
        return None
    number = 1 + int(np.argmin(np.abs(moved[1:-1] - 0.5 * moved[-1])))
    first, uv = (matched.places[k, matched.rows] for k in (0, number))
    seen = np.flatnonzero(np.isfinite(uv[:, 0]))
    a, m = camera.unproject(first[seen]).xn, camera.unproject(uv[seen]).xn
    fits = essential_consensus(a, m, rng, sigma=one_pixel(camera), draws=DRAWS)
    if fits.reason:
        return None
    kept = np.full_like(uv, np.nan)
    kept[seen[fits.inliers]] = uv[seen[fits.inliers]]
    share = float(moved[number] / max(moved[-1], 1e-9))
    return Between(matched.pictures[number].number, kept, share, s.agree)


def first_map(
    camera: Camera, shape: tuple[int, int], matched: StartMatches, found: Attempt, settings: Settings
) -> FeatureMap:
    """Make a map of two keyframes from a start; the median depth in the first is 1, in its own unit.

    Implements A§3.1, the start of the map.
    """
    scale = 1.0 / float(np.median(found.X_a[found.good, 2]))
    T_b_a = se3.from_rt(se3.rotation(found.T_b_a), scale * se3.translation(found.T_b_a))
    f = settings.features
    feature_map = FeatureMap(camera, shape, f.octaves, f.scale)
    feature_map.add_keyframe(se3.identity(), matched.pictures[0])
    feature_map.add_keyframe(T_b_a, matched.pictures[-1])
    rows = found.row[found.good]
    numbers = feature_map.add_points(scale * found.X_a[found.good], 1)
    feature_map.see(0, rows, numbers)
    feature_map.see(1, matched.feature[rows], numbers)
    link(feature_map, 1)
    adjust_all(feature_map, settings, settings.last_steps)
    new_points(feature_map, 1, settings.mapper, f)
    adjust_all(feature_map, settings, settings.last_steps)
    unit_depth(feature_map)
    feature_map.refresh(np.flatnonzero(feature_map.alive))
    return feature_map
