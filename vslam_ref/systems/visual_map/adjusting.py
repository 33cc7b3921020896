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
from vslam_ref.estimation.bundle.self_calibration import SelfCalibration, self_calibrate
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.visual_map.keyframe_map import KeyframeMap, neighbours


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
    """A map as a problem: which keyframes, points and sightings of the map its rows are."""

    problem: BundleProblem
    views: IntArray
    points: IntArray
    sightings: IntArray


def adjust(
    visual_map: KeyframeMap,
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
    visual_map : KeyframeMap
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
        return _put_back(visual_map, whole, result.problem.scene, result)
    part = local_problem(whole.problem, np.searchsorted(whole.views, active))
    result = bundle_adjust(part.problem, robust, options)
    scene = part.put_back(whole.problem, result.problem.scene).scene
    return _put_back(visual_map, whole, scene, result, part.observations)


def adjust_with_camera(
    visual_map: KeyframeMap,
    camera: Camera,
    names: tuple[str, ...],
    robust: Robust,
    *,
    most_shift_px: float,
    options: Options | None = None,
) -> SelfCalibration:
    """Move everything but the first keyframe, and those intrinsics that the motion determines.

    Implements :eq:`eq-a2-9` with the camera free.

    Parameters
    ----------
    visual_map : KeyframeMap
        Changed in place, its camera too, unless there is a reason why not.
    camera : Camera
        The map's own camera, in a model that has the intrinsics to be freed.
    names : tuple of str
        Intrinsics that may be freed.
    robust : Robust
    most_shift_px : float
        An intrinsic is refused if one standard deviation of it moves some pixel farther.
    options : Options, optional

    Returns
    -------
    SelfCalibration
    """
    whole = as_problem(visual_map, camera=camera)
    height, width = visual_map.shape
    found = self_calibrate(whole.problem, names, (width, height), robust, options, most_shift_px)
    if not found.reason:
        visual_map.change_camera(found.camera)
        _put_back(visual_map, whole, found.result.problem.scene, found.result)
    return found


def _put_back(
    visual_map: KeyframeMap, whole: _Whole, scene: Scene, result: BundleResult, rows: IntArray | None = None
) -> Adjusted:
    """Write a scene into the map, and take back what had no weight; rows of the problem, all by default."""
    visual_map.T_kf_world[whole.views] = scene.T_cam_world
    visual_map.X_world[whole.points] = scene.X_world
    wrong = np.flatnonzero((result.weights <= 0.0) | ~result.valid)
    wrong = wrong if rows is None else rows[wrong]
    died = visual_map.take_back(whole.sightings[wrong])
    return Adjusted(result, len(wrong), died)


def as_problem(visual_map: KeyframeMap, fixed: ArrayLike = (0,), camera: Camera | None = None) -> _Whole:
    """Return the living points and their sightings as a problem of bundle adjustment, in pixels.

    Keyframes ``fixed (f,)`` do not move; ``camera`` is the map's by default.
    """
    seen = visual_map.sightings
    on = np.flatnonzero(seen["on"])
    views, points = visual_map.used_keyframes(), np.flatnonzero(visual_map.alive)
    camera = camera or visual_map.camera
    scene = Scene(visual_map.T_kf_world[views], visual_map.X_world[points], camera.params[None])
    view, point = np.searchsorted(views, seen["kf"][on]), np.searchsorted(points, seen["point"][on])
    cov = np.eye(2) * (visual_map.level_sigma(seen["level"][on]) ** 2)[:, None, None]
    observed = Observations(view, point, seen["uv"][on], cov)
    model = type(camera)
    free = freedom(model, scene, fixed_views=np.searchsorted(views, fixed))
    return _Whole(BundleProblem(model, scene, observed, free=free), views, points, on)


def local_active(visual_map: KeyframeMap, newest: int, count: int) -> IntArray:
    """Return the newest keyframe and its ``count`` best connected ones, without keyframe 0, which stays."""
    chosen = np.concatenate([[newest], neighbours(visual_map, newest, count)])
    return np.asarray(chosen[chosen != 0], dtype=np.int64)
