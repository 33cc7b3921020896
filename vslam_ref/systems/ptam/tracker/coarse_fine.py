"""Two passes over a picture: few large points in a wide search, then many in a narrow one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.pose_tracking import TrackedPose, track_pose
from vslam_ref.estimation.robust import tuned
from vslam_ref.features import level_sigma
from vslam_ref.support.stopwatch import stage
from vslam_ref.systems.ptam.settings import TrackerSettings
from vslam_ref.systems.visual_map import Looks, PreparedPicture, Visible, VisualMap, look, visible


class Pass(NamedTuple):
    """One pass.

    Attributes
    ----------
    seen : Visible
        The points that were tried (n).
    uv : ndarray, shape (n, 2)
        Where they were found, pixels of level 0.
    ok : ndarray of bool, shape (n,)
        Which were found.
    weights : ndarray, shape (n,)
        Of Tukey's loss at the pose; 0 where not found.
    pose : TrackedPose
    """

    seen: Visible
    uv: Array
    ok: BoolArray
    weights: Array
    pose: TrackedPose

    @property
    def inliers(self) -> int:
        """Points found with weight."""
        return int(np.count_nonzero(self.weights > 0)) if not self.pose.reason else 0


def coarse(
    visual_map: VisualMap,
    picture: PreparedPicture,
    T_guess: Array,
    radius: float,
    settings: TrackerSettings,
    looks: Looks,
    rng: np.random.Generator,
) -> Pass:
    """Look for a few points of the coarsest levels around where a guess puts them, and improve the guess.

    ``T_guess`` is (4, 4), ``radius`` in pixels of level 0.
    """
    seen = visible(visual_map, T_guess)
    chosen = _coarsest(seen.level, settings.coarse_points, rng)
    return _pass(visual_map, picture, T_guess, seen.only(chosen), radius, settings, looks)


def fine(
    visual_map: VisualMap,
    picture: PreparedPicture,
    T_guess: Array,
    radius: float,
    settings: TrackerSettings,
    looks: Looks,
    rng: np.random.Generator,
) -> Pass:
    """Look for all visible points, or as many as are allowed, near where they should be.

    ``T_guess`` is (4, 4), ``radius`` in pixels of level 0.
    """
    seen = visible(visual_map, T_guess)
    if len(seen.point) > settings.fine_points:
        chosen = rng.permutation(len(seen.point))[: settings.fine_points]
        seen = seen.only(np.sort(chosen))
    return _pass(visual_map, picture, T_guess, seen, radius, settings, looks)


def _coarsest(level: IntArray, most: int, rng: np.random.Generator) -> IntArray:
    """Rows of at most ``most`` points, random among the two coarsest levels; finer ones fill up."""
    order = rng.permutation(len(level))
    rank = np.where(level >= 2, 0, 2 - level)
    order = order[np.argsort(rank[order], kind="stable")][:most]
    return np.sort(order)


def _pass(
    visual_map: VisualMap,
    picture: PreparedPicture,
    T_guess: Array,
    seen: Visible,
    radius: float,
    settings: TrackerSettings,
    looks: Looks,
) -> Pass:
    measured = look(visual_map, seen, picture, radius, looks)
    rows = np.flatnonzero(measured.ok)
    with stage("pose"):
        pose = track_pose(
            visual_map.camera,
            visual_map.X_world[seen.point[rows]],
            measured.uv[rows],
            T_guess,
            sigma_px=level_sigma(seen.level[rows]),
            loss=tuned(settings.loss, 2),
            steps=settings.steps,
            least_sigma=settings.least_sigma,
        )
    weights = np.zeros(len(seen.point))
    weights[rows] = pose.weights
    return Pass(seen, measured.uv, measured.ok, weights, pose)
