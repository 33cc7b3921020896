r"""From trails to a first map, or the reason why not yet.

::

    first picture ----------- last picture      estimate_motion: answers, each with its cost
              \                 /
               a picture between               ask_third: which answer it allows
                      |
                parallax, cost                 enough for a map?
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.relative_pose import MotionEstimate, estimate_motion
from vslam_ref.estimation.third_picture import ThirdPicture, ask_third
from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.features import level_sigma
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.geometry.multiview import Views, two_views
from vslam_ref.geometry.multiview.two_views import Choice, Draws
from vslam_ref.geometry.multiview.two_views.consensus import ONE_EQUATION, truncated_cost
from vslam_ref.systems.ptam.mapper.mapper import adjust_all
from vslam_ref.systems.ptam.mapper.new_points import new_points
from vslam_ref.systems.ptam.settings import Settings, StartSettings
from vslam_ref.systems.ptam.trails import Trails, again_in, from_the_first
from vslam_ref.systems.visual_map import VisualMap

WORST_PIXELS = 3.0
"""Pixels of the level: root mean square distance of a point of the first map from its two sightings."""


DRAWS = Draws(least=50)
"""Samples: as many as the confidence of 0.999 asks for, 50 at least.

More would look for a sample that noise has harmed less, and all answers are refined anyway.
"""
ANSWERS = 3
"""Of the two pictures, the cheapest: both of a plane, and that of the essential matrix."""


class Attempt(NamedTuple):
    """What the pictures told.

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
        Numbers of these trails.
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


def attempt(camera: Camera, trails: Trails, s: StartSettings, rng: np.random.Generator) -> Attempt | str:
    """Try to start from the ends of trails and a picture between; a sentence if there is nothing to try."""
    again = from_the_first(trails)
    ok = np.isfinite(again[:, 0])
    if ok.sum() < max(s.least_trails, 8):
        return f"{ok.sum()} of {len(ok)} corners are still found: need {s.least_trails}"
    uv_a, uv_b, level = trails.first[ok], again[ok], trails.level[ok]
    pair = Pair(uv_a, uv_b, level, np.flatnonzero(ok))
    a, b = camera.unproject(uv_a).xn, camera.unproject(uv_b).xn
    sigma = _sigma(camera)
    found = estimate_motion(a, b, rng, sigma=sigma, draws=DRAWS)
    if len(trails.pictures) < 3 or found.choice is None or found.reason not in ("", found.choice.reason):
        # nothing lies between, or it is no rival's fault
        return _judged(camera, pair, s, found, None, -1)
    number = _between(trails)
    third = _asked(camera, trails, pair, found.choice, number, sigma)
    return _judged(camera, pair, s, found, third, trails.pictures[number].number)


def _between(trails: Trails) -> int:
    """Return which of the pictures lies half way, by how far the points had moved."""
    moved = trails.moved
    return 1 + int(np.argmin(np.abs(moved[1:-1] - 0.5 * moved[-1])))


def _asked(
    camera: Camera, trails: Trails, pair: Pair, choice: Choice, number: int, sigma: float
) -> ThirdPicture:
    """Let one of the trails' pictures decide between the cheapest answers of the pair."""
    again = again_in(trails, number)[pair.row]
    seen = np.isfinite(again[:, 0])
    a, m, b = (camera.unproject(uv[seen]).xn for uv in (pair.uv_a, again, pair.uv_b))
    share = float(trails.moved[number] / max(trails.moved[-1], 1e-9))
    return ask_third(choice.answers[:ANSWERS], a, m, b, sigma=sigma, share=share)


class Pair(NamedTuple):
    """Matches: ``uv_a (n, 2)``, ``uv_b (n, 2)`` in pixels of level 0, ``level (n,)``, trail ``row (n,)``."""

    uv_a: Array
    uv_b: Array
    level: IntArray
    row: IntArray


def _judged(
    camera: Camera,
    pair: Pair,
    s: StartSettings,
    found: MotionEstimate,
    third: ThirdPicture | None,
    between: int,
) -> Attempt:
    """Triangulate, and say what is missing for a start."""
    choice, reason = found.choice, found.reason if third is None else third.reason
    T_b_a, fit = found.T_b_a, _Fit(np.inf if choice is None else choice.cost, found.inliers)
    if third is not None and third.views is not None and choice is not None:
        T_b_a = third.views.T_b_a
        fit = _fit(camera, T_b_a, choice, pair)
    views = Views(camera, np.stack([se3.identity(), T_b_a]))
    points = triangulate(views, np.stack([pair.uv_a, pair.uv_b], 1), min_parallax=0.0, max_iterations=10)
    fits = fit.fits & (points.rmse_px <= WORST_PIXELS * level_sigma(pair.level))
    angle = np.degrees(points.parallax)
    good = fits & points.ok & (angle >= 0.5 * s.parallax)
    parallax = float(np.median(angle[fits])) if fits.any() else 0.0
    wide = int((angle[fits] >= s.wide_parallax).sum())
    return Attempt(
        T_b_a=T_b_a,
        uv_a=pair.uv_a,
        uv_b=pair.uv_b,
        level=pair.level,
        good=good,
        X_a=points.X_world,
        cost=fit.cost,
        rivals=choice.rivals if choice is not None else (),
        parallax=parallax,
        reason=reason or _missing(parallax, wide, fit.cost, s),
        row=pair.row,
        between=between,
    )


def _fit(camera: Camera, T_b_a: Array, choice: Choice, pair: Pair) -> _Fit:
    """Tell how well a motion explains the pairs."""
    a, b = camera.unproject(pair.uv_a).xn, camera.unproject(pair.uv_b).xn
    motions = np.concatenate([T_b_a[None], choice.answers])
    squared = two_views.cheirality(motions, a, b, _sigma(camera)).squared
    fits = squared <= ONE_EQUATION
    cost = truncated_cost(squared[0, fits.any(axis=0)], ONE_EQUATION) if fits.any() else ONE_EQUATION
    return _Fit(float(cost), fits[0])


class _Fit(NamedTuple):
    """Cost per pair that fits any answer, pixels squared, and which pairs fit this one (n,)."""

    cost: float
    fits: BoolArray


def _sigma(camera: Camera) -> float:
    """One pixel, in normalised positions."""
    return 1.0 / float(np.sqrt(camera.fx * camera.fy))


def _missing(parallax: float, wide: int, cost: float, s: StartSettings) -> str:
    """Why a motion is no start, or nothing."""
    if parallax < s.parallax:
        return f"the rays of a point differ by {parallax:.2f} degrees: need {s.parallax:g}"
    if wide < s.wide_points:
        return f"the rays of {wide} points differ by {s.wide_parallax:g} degrees: need {s.wide_points} points"
    if cost > s.cost:
        return f"the mean squared error of the matches is {cost:.3g} px^2: at most {s.cost:g}"
    return ""


def first_map(camera: Camera, trails: Trails, found: Attempt, settings: Settings) -> VisualMap:
    """Make a map of two keyframes from a start; the median depth in the first is 1, in its own unit.

    Implements A§2.2.2.
    """
    first, last = trails.pictures[0], trails.pictures[-1]
    scale = 1.0 / float(np.median(found.X_a[found.good, 2]))
    T_b_a = se3.from_rt(se3.rotation(found.T_b_a), scale * se3.translation(found.T_b_a))
    height, width = first.levels[0].shape
    visual_map = VisualMap(camera, (height, width), len(first.levels))
    visual_map.add_keyframe(se3.identity(), first)
    visual_map.add_keyframe(T_b_a, last)
    g = found.good
    numbers = visual_map.add_points(scale * found.X_a[g], 0, found.level[g], found.uv_a[g])
    visual_map.observe(1, numbers, found.level[g], found.uv_b[g])
    adjust_all(visual_map, settings, settings.mapper.global_steps)
    new_points(visual_map, 1, last, settings.mapper, settings.features)
    adjust_all(visual_map, settings, settings.mapper.global_steps)
    _set_scale(visual_map)
    return visual_map


def _set_scale(visual_map: VisualMap) -> None:
    """Make the median depth in the first keyframe 1 again, after the adjustment was free to change it."""
    scale = 1.0 / float(np.median(visual_map.X_world[visual_map.measured_in(0), 2]))
    visual_map.X_world[:] *= scale
    visual_map.T_kf_world[:, :3, 3] *= scale
