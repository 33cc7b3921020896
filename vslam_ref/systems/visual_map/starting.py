r"""From matches of two pictures, and a third between them, to the motion of a start, or the reason why not.

::

    first picture ----------- last picture      estimate_motion: answers, each with its cost
              \                 /
               a picture between               ask_third: which answer it allows
                      |
            parallax, depths, cost             enough for a map?
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.relative_pose import MotionEstimate, estimate_motion
from vslam_ref.estimation.third_picture import ThirdPicture, ask_third
from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.geometry.multiview import Views, two_views
from vslam_ref.geometry.multiview.two_views import Choice, Draws
from vslam_ref.geometry.multiview.two_views.choice import RATIO
from vslam_ref.geometry.multiview.two_views.consensus import ONE_EQUATION, truncated_cost
from vslam_ref.systems.visual_map.keyframe_map import KeyframeMap
from vslam_ref.systems.visual_map.telling import Attempt

WORST_PIXELS = 3.0
"""Pixels of the level: root mean square distance of a point of the first map from its two sightings."""


DRAWS = Draws(least=50)
"""Samples: as many as the confidence of 0.999 asks for, 50 at least.

More would look for a sample that noise has harmed less, and all answers are refined anyway.
"""
ANSWERS = 3
"""Of the two pictures, the cheapest: both of a plane, and that of the essential matrix."""


class StartLimits(Protocol):
    """What a start must have: settings of a system.

    Attributes
    ----------
    parallax : float
        Median, degrees.  A point has depth from half of it on.
    wide_parallax : float
        Degrees, of ``wide_points`` at least.
    wide_points : int
    cost : float
        Largest, pixels squared per pair.
    """

    @property
    def parallax(self) -> float: ...  # noqa: D102
    @property
    def wide_parallax(self) -> float: ...  # noqa: D102
    @property
    def wide_points(self) -> int: ...  # noqa: D102
    @property
    def cost(self) -> float: ...  # noqa: D102


class Pair(NamedTuple):
    """Matches: pixels of level 0 ``uv_a (n, 2)``, ``uv_b (n, 2)``; ``level (n,)``, its width ``sigma (n,)``.

    ``row (n,)`` says which they are among those that were followed.
    """

    uv_a: Array
    uv_b: Array
    level: IntArray
    sigma: Array
    row: IntArray


class Between(NamedTuple):
    """A picture between: its number, where the matches lie in it (n, 2), pixels, NaN where not seen.

    ``share`` of the way that it lies behind the first; it may cost ``agree`` times as much as the pair.
    """

    number: int
    uv: Array
    share: float
    agree: float = RATIO


def judge_start(
    camera: Camera, pair: Pair, between: Between | None, s: StartLimits, rng: np.random.Generator
) -> Attempt:
    """Find the motion of two pictures, let a picture between decide what they leave open, triangulate.

    Implements A§2.2.2, the start from two pictures; lengths in base lines.
    """
    a, b = camera.unproject(pair.uv_a).xn, camera.unproject(pair.uv_b).xn
    found = estimate_motion(a, b, rng, sigma=one_pixel(camera), draws=DRAWS)
    if between is None or found.choice is None or found.reason not in ("", found.choice.reason):
        # nothing lies between, or it is no rival's fault
        return _judged(camera, pair, s, found, None, -1)
    third = _asked(camera, pair, found.choice, between)
    return _judged(camera, pair, s, found, third, between.number)


def _asked(camera: Camera, pair: Pair, choice: Choice, between: Between) -> ThirdPicture:
    """Let a picture between decide between the cheapest answers of the pair."""
    seen = np.isfinite(between.uv[:, 0])
    a, m, b = (camera.unproject(uv[seen]).xn for uv in (pair.uv_a, between.uv, pair.uv_b))
    sigma, share, agree = one_pixel(camera), between.share, between.agree
    return ask_third(choice.answers[:ANSWERS], a, m, b, sigma=sigma, share=share, agree=agree)


def _judged(
    camera: Camera,
    pair: Pair,
    s: StartLimits,
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
    fits = fit.fits & (points.rmse_px <= WORST_PIXELS * pair.sigma)
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
        reason=reason or missing(parallax, wide, fit.cost, s),
        row=pair.row,
        between=between,
    )


def _fit(camera: Camera, T_b_a: Array, choice: Choice, pair: Pair) -> _Fit:
    """Tell how well a motion explains the pairs."""
    a, b = camera.unproject(pair.uv_a).xn, camera.unproject(pair.uv_b).xn
    motions = np.concatenate([T_b_a[None], choice.answers])
    squared = two_views.cheirality(motions, a, b, one_pixel(camera)).squared
    fits = squared <= ONE_EQUATION
    cost = truncated_cost(squared[0, fits.any(axis=0)], ONE_EQUATION) if fits.any() else ONE_EQUATION
    return _Fit(float(cost), fits[0])


class _Fit(NamedTuple):
    """Cost per pair that fits any answer, pixels squared, and which pairs fit this one (n,)."""

    cost: float
    fits: BoolArray


def one_pixel(camera: Camera) -> float:
    """One pixel, in normalised positions."""
    return 1.0 / float(np.sqrt(camera.fx * camera.fy))


def missing(parallax: float, wide: int, cost: float, s: StartLimits) -> str:
    """Why a motion is no start, or nothing; angles in degrees, the cost in pixels squared."""
    if parallax < s.parallax:
        return f"the rays of a point differ by {parallax:.2f} degrees: need {s.parallax:g}"
    if wide < s.wide_points:
        return f"{wide} points have {s.wide_parallax:g} degrees of parallax: need {s.wide_points}"
    if cost > s.cost:
        return f"the cost is {cost:.2f} px^2 a point: at most {s.cost:g}"
    return ""


def unit_depth(visual_map: KeyframeMap) -> None:
    """Make the median depth in the first keyframe 1, the map's own unit, after an adjustment changed it."""
    scale = 1.0 / float(np.median(visual_map.X_world[visual_map.measured_in(0), 2]))
    visual_map.X_world[:] *= scale
    visual_map.T_kf_world[:, :3, 3] *= scale
