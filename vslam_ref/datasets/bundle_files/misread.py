"""Files written in another convention than their format's: found by what would fit far better.

BAL and Bundler count v upwards from the image's centre, and their cameras look along -z.  Programs that see
the world as computer vision does (v downwards, from a corner, cameras along +z) and write such a file without
a conversion leave one that can be read, and even adjusted: views from afar fit a mirrored scene not badly.
What gives it away is that another reading of the same numbers fits far better::

    the file as read     ->  median error at the start        of all readings that which starts best,
    v downwards          ->  median error at the start        if it is not the file's own, is adjusted, too:
    from a corner        ->  ...                              told if it ends at less than half the error

A right file starts best as it is read, so it costs a projection a reading, and nothing is told.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.datasets.bundle_files.opengl_cameras import DOWN, FLIP
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.estimation.bundle.problem import BundleProblem, Scene
from vslam_ref.estimation.bundle.projection import reprojection
from vslam_ref.estimation.bundle.result import BundleResult

FORMATS = {"bal": "BAL", "bundler": "Bundler"}
FAR_BETTER = 0.5
"""Share of the error that the other reading must stay below, at the end."""
CLEAR = 0.1
"""Share of the picture's spread below which a start fits: where no point of the file as read has an image."""
LEAST = 8
"""Observations: fewer fit anything."""

V_DOWN = "v counts downwards; the format's v counts upwards: change the sign of every v"
CORNER = "pixels are counted from a corner of the image; the format counts from its centre: subtract it"
AHEAD = (
    "cameras look along +z with y downwards; the format's look along -z with y upwards: "
    "turn every R and t by diag(1, -1, -1)"
)


class Reading(NamedTuple):
    """The same numbers understood in another way, and what that way is."""

    problem: BundleProblem
    what: str


def typical_error(r: Array, valid: BoolArray) -> float:
    """Median length of residuals (n, 2), pixels; one without an image counts as infinite.

    Examples
    --------
    >>> typical_error(np.array([[3.0, 4.0], [0.0, 1.0], [0.0, 0.0]]), np.array([True, True, False]))
    5.0
    """
    return float(np.median(np.where(valid, np.hypot(*r.T), np.inf))) if len(r) else np.inf


def spread(problem: BundleProblem) -> float:
    """Median distance of what was seen from its middle, pixels."""
    uv = problem.seen.uv
    return float(np.median(np.hypot(*(uv - np.median(uv, axis=0)).T)))


def other_readings(file: BundleFile) -> Iterator[Reading]:
    """Readings of a file whose format has cameras that look back; none of another format's."""
    if file.format not in FORMATS:
        return
    ahead = file.problem.scene
    turned = Scene(FLIP4 @ ahead.T_cam_world, ahead.X_world, ahead.intrinsics)
    for scene, looks in ((ahead, ""), (turned, AHEAD)):
        for sign, counts in ((np.ones(2), ""), (DOWN, V_DOWN)):
            seen = replace(file.problem.seen, uv=file.problem.seen.uv * sign)
            plain = replace(file.problem, scene=scene, seen=seen)
            if looks or counts:
                yield Reading(plain, _joined(looks, counts))
            r, valid = reprojection(plain)
            shift = np.median(r[valid], axis=0) if valid.any() else np.zeros(2)
            if np.hypot(*shift) > FAR_BETTER * spread(file.problem):
                moved = replace(plain, seen=replace(seen, uv=seen.uv + shift))
                yield Reading(moved, _joined(looks, counts, CORNER))


FLIP4 = np.eye(4)
FLIP4[:3, :3] = FLIP


def _joined(*parts: str) -> str:
    return "; and ".join(part for part in parts if part)


def likely_misread(
    file: BundleFile, result: BundleResult, adjust: Callable[[BundleProblem], BundleResult]
) -> str:
    """Say which other convention a file seems to be written in, or nothing.

    Parameters
    ----------
    file : BundleFile
        As it was read, at its start.
    result : BundleResult
        Of its adjustment.
    adjust : callable
        The same adjustment, of another reading; called once at most.

    Returns
    -------
    str
        A sentence for the user, or "".
    """
    if file.problem.sizes[2] < LEAST:
        return ""
    start = typical_error(*reprojection(file.problem))
    best = min(other_readings(file), key=lambda one: typical_error(*reprojection(one.problem)), default=None)
    needed = (FAR_BETTER if result.converged else 1.0) * start
    if best is None or not typical_error(*reprojection(best.problem)) < needed:
        return ""
    before = typical_error(result.residual, result.valid)
    found = adjust(best.problem)
    after = typical_error(found.residual, found.valid)
    if not after < (FAR_BETTER * before if np.isfinite(before) else CLEAR * spread(file.problem)):
        return ""
    errors = f"{after:.3g} px instead of {before:.3g} px" if np.isfinite(before) else f"{after:.3g} px"
    name = FORMATS[file.format]
    return f"not {name}'s convention, it seems: {best.what}. So read, the median error is {errors}"
