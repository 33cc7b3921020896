"""Bundle adjustment of a map, all of it or the newest part, and what is taken back afterwards."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import IntArray
from vslam_ref.estimation.bundle import (
    BundleProblem,
    BundleResult,
    Observations,
    Options,
    Robust,
    Scene,
    bundle_adjust,
    freedom,
)
from vslam_ref.estimation.bundle.local import local_problem
from vslam_ref.features import level_sigma
from vslam_ref.systems.visual_map.visual_map import VisualMap, neighbours


class Adjusted(NamedTuple):
    """What an adjustment did.

    Attributes
    ----------
    result : BundleResult
        Its record.
    taken_back : int
        Sightings that no longer count: their error was beyond Tukey's constant.
    died : ndarray of int64, shape (n,)
        Points that were lost with them.
    """

    result: BundleResult
    taken_back: int
    died: IntArray


class _Whole(NamedTuple):
    """A map as a problem: which points and sightings of the map its rows are."""

    problem: BundleProblem
    points: IntArray
    sightings: IntArray


def adjust(
    visual_map: VisualMap,
    robust: Robust,
    *,
    active: ArrayLike | None = None,
    fixed: ArrayLike = (0,),
    options: Options | None = None,
) -> Adjusted:
    """Move keyframes and points to where the sightings agree best, and take back those that do not.

    Implements :eq:`eq-a2-9` (A2.9) with the sightings of a map: residuals over 2^level pixels.

    Parameters
    ----------
    visual_map : VisualMap
        Changed in place.
    robust : Robust
        Tukey's loss with an adaptive scale.
    active : array_like of int, shape (a,), optional
        Keyframes that move, for a local adjustment; all by default.
    fixed : array_like of int, shape (f,)
        Keyframes that never move.
    options : Options, optional

    Returns
    -------
    Adjusted
    """
    whole = as_problem(visual_map, fixed)
    if active is None:
        result = bundle_adjust(whole.problem, robust, options)
        scene, rows = result.problem.scene, np.arange(len(whole.sightings))
    else:
        part = local_problem(whole.problem, active)
        result = bundle_adjust(part.problem, robust, options)
        scene, rows = part.put_back(whole.problem, result.problem.scene).scene, part.observations
    visual_map.T_kf_world[:] = scene.T_cam_world
    visual_map.X_world[whole.points] = scene.X_world
    wrong = rows[(result.weights <= 0.0) | ~result.valid]
    died = visual_map.take_back(whole.sightings[wrong])
    return Adjusted(result, len(wrong), died)


def as_problem(visual_map: VisualMap, fixed: ArrayLike = (0,)) -> _Whole:
    """Return the living points and their sightings as a problem of bundle adjustment, in pixels.

    Keyframes ``fixed (f,)`` do not move.
    """
    seen = visual_map.sightings
    on = np.flatnonzero(seen["on"])
    points = np.flatnonzero(visual_map.alive)
    new = np.full(len(visual_map.points), -1)
    new[points] = np.arange(len(points))
    camera = visual_map.camera
    scene = Scene(visual_map.T_kf_world, visual_map.X_world[points], camera.params[None])
    cov = np.eye(2) * (level_sigma(seen["level"][on]) ** 2)[:, None, None]
    observed = Observations(seen["kf"][on], new[seen["point"][on]], seen["uv"][on], cov)
    model = type(camera)
    free = freedom(model, scene, fixed_views=fixed)
    return _Whole(BundleProblem(model, scene, observed, free=free), points, on)


def local_active(visual_map: VisualMap, newest: int, count: int) -> IntArray:
    """Return the newest keyframe and its ``count`` best connected ones, without keyframe 0, which stays."""
    chosen = np.concatenate([[newest], neighbours(visual_map, newest, count)])
    return np.asarray(chosen[chosen != 0], dtype=np.int64)
