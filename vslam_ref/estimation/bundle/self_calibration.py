r"""Self-calibration: bundle adjustment that frees the camera, as far as the views determine it.

::

    camera as given, adjusted -> free intrinsics -> one that the views leave open? --yes--> it stays: again
                                                              |no
                                                   adjust -> sigma too large? --yes--> it stays: again
                                                              |no
                                                           the camera

A motion that never turns leaves focal lengths and centre open; views without parallax leave more open.  An
adjustment finds *some* values for them, and a lower cost.  So each intrinsic is judged by its standard
deviation, by the shift of a pixel that it makes somewhere in the picture; the worst one is refused, keeps the
value that was given, and all begins anew from there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle.families import camera_of, model_of_set
from vslam_ref.estimation.bundle.lens_covariance import LensCovariance, lens_covariance, with_free_lens
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.bundle.result import BundleResult
from vslam_ref.estimation.bundle.solver import Options, bundle_adjust
from vslam_ref.estimation.bundle.weights import Robust
from vslam_ref.geometry.cameras import Camera
from vslam_ref.geometry.cameras.images import pixel_grid

GRID = 16
"""Pixels looked at along each side of the picture."""
LEAST_INLIERS = 0.8
"""Of the observations with weight before: fewer, and the adjustment went astray."""
LEANS_ON = {"p1": "cy", "p2": "cx"}
"""A tangential term looks like a shift of the centre: beside one that stays, it would stand in for that."""


class Refused(NamedTuple):
    """Standard deviation of an intrinsic, in its own unit, and the shift of a pixel that it makes."""

    sigma: float
    shift_px: float


class SelfCalibration(NamedTuple):
    """A camera from its own pictures.

    Attributes
    ----------
    result : BundleResult
        Of the last adjustment, with the intrinsics that were kept free.
    sigma : dict of str to float
        Standard deviation of each of these, in its own unit.
    refused : dict of str to Refused
        Intrinsics that the views do not determine: they have the values that were given.
    reason : str
        Empty, or why nothing was changed.
    """

    result: BundleResult
    sigma: dict[str, float]
    refused: dict[str, Refused]
    reason: str

    @property
    def camera(self) -> Camera:
        """The camera that was found."""
        problem = self.result.problem
        return camera_of(problem.model, problem.scene.intrinsics, 0)


def self_calibrate(
    problem: BundleProblem,
    names: tuple[str, ...],
    size: tuple[int, int],
    robust: Robust | None = None,
    options: Options | None = None,
    most_shift_px: float = 5.0,
) -> SelfCalibration:
    """Adjust a scene and the camera that took all its views.

    Implements :eq:`eq-a1-4` (A1.4) with the intrinsics free.

    Parameters
    ----------
    problem : BundleProblem
        One set of intrinsics for all views; the camera as it was given, the scene adjusted with it.
    names : tuple of str
        Intrinsics that may be freed.
    size : (int, int)
        Width and height of the pictures, pixels.
    robust, options : Robust, Options, optional
        As for :func:`~vslam_ref.estimation.bundle.solver.bundle_adjust`.
    most_shift_px : float
        An intrinsic is refused if one standard deviation of it moves some pixel of the picture farther.

    Returns
    -------
    SelfCalibration

    Raises
    ------
    ValueError
        On a name that the model has not, or views with lenses of their own.
    """
    known = model_of_set(problem.model, 0)[0].names()
    unknown = [name for name in names if name not in known]
    if unknown or len(problem.scene.intrinsics) != 1:
        raise ValueError(f"need one lens and some of {', '.join(known)}; got {', '.join(names)}")
    fixed = with_free_lens(problem, np.zeros(len(known), np.bool_))
    start = bundle_adjust(fixed, robust, options)
    free = np.array([name in names for name in known])
    refused: dict[str, Refused] = {}
    while free.any():
        here = with_free_lens(start.problem, free)
        found, certain = start, lens_covariance(replace(start, problem=here))
        if np.isfinite(certain.sigma).all():
            found = bundle_adjust(here, robust, options)
            certain = lens_covariance(found)
        shift = certain.sigma * _shift_per_unit(found.problem, size)[free]
        worst = _worst(shift, certain, most_shift_px)
        if worst is None:
            reason = _astray(start, found, size)
            if reason:
                return SelfCalibration(start, {}, refused, reason)
            kept = [name for name, on in zip(known, free, strict=True) if on]
            return SelfCalibration(found, dict(zip(kept, certain.sigma.tolist(), strict=True)), refused, "")
        rows = np.flatnonzero(free)
        for at, row in enumerate(rows):
            if at == worst or LEANS_ON.get(known[row]) == known[rows[worst]]:
                refused[known[row]] = Refused(float(certain.sigma[at]), float(shift[at]))
                free[row] = False
    return SelfCalibration(start, {}, refused, "the views determine no intrinsic")


def _worst(shift: Array, certain: LensCovariance, most_px: float) -> int | None:
    """Which direction is refused next: the farthest shift, or the largest part of what is open."""
    if np.isinf(shift).any():
        return int(np.argmax(np.where(np.isinf(shift), certain.undetermined, -1.0)))
    return int(np.argmax(shift)) if shift.max() > most_px else None


def _shift_per_unit(problem: BundleProblem, size: tuple[int, int]) -> Array:
    """Largest shift in the picture, pixels, for one unit of each intrinsic (p,)."""
    camera = camera_of(problem.model, problem.scene.intrinsics, 0)
    rays = camera.unproject(_grid(size))
    at = camera.project_with_jacobians(rays.bearing[rays.valid])
    length = np.linalg.norm(at.J_intrinsics[at.valid], axis=1)
    largest: Array = length.max(0, initial=0.0)
    return largest


def _grid(size: tuple[int, int]) -> Array:
    """Pixels (n, 2) all over a picture, its corners among them."""
    whole = pixel_grid((GRID, GRID)).reshape(-1, 2) / (GRID - 1)
    return whole * (np.array(size) - 1.0)


def _astray(start: BundleResult, found: BundleResult, size: tuple[int, int]) -> str:
    """Why an adjustment is not believed, or nothing."""
    camera = camera_of(found.problem.model, found.problem.scene.intrinsics, 0)
    if not np.isfinite(found.cost) or found.cost > start.cost:
        return "the cost did not fall"
    inliers, before = (np.count_nonzero(each.weights) for each in (found, start))
    if inliers < LEAST_INLIERS * before:
        return f"{inliers} observations agree with it: {before} agreed with the camera that was given"
    if not camera.unproject(_grid(size)).valid.all():
        return "the camera that was found has no ray for some pixel of the picture"
    return ""
