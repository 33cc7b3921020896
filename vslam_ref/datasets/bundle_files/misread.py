"""Files written in another convention than their format's: found by what would fit far better.

BAL and Bundler count v upwards from the image's centre, and their cameras look along -z.  Programs that see
the world as computer vision does (v downwards, from a corner, cameras along +z) and write such a file without
a conversion leave one that can be read, and even adjusted: with v the other way round, the mirror image of
the scene fits as well as the scene, only the start is far from it.  So the start gives it away::

    the file as read     ->  median error at the start        the reading that starts best, where that is
    v downwards          ->  median error at the start        another one and at less than half the error,
    from a corner        ->  ...                              is adjusted, too: told if it ends alike

Where the file as read did not converge, any better start is followed, and told only if it ends at less than
half the error.  A right file starts best as it is read: that costs a projection a reading, and is silent.
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
"""Share of the error that the other reading stays below.  Starts moved by up to the size of the scene, of the
public problems with 1,681 to 83,718 observations, never came below 0.84 when they were right."""
ALIKE, ROUNDING = 2.0, 1e-9
"""Ends are alike: up to this share of the other's error, or of the spread where both are rounding."""
CLEAR = 0.1
"""Share of the picture's spread below which a start fits: where no point of the file as read has an image."""
LEAST = 40
"""Observations: with 18, a wrong reading of a bad start reached 0.28."""

V_DOWN = "v counts downwards, the format's upwards (the scene comes out mirrored): change the sign of every v"
CORNER = "pixels are counted from a corner of the image, the format's from its centre: subtract the centre"
AHEAD = (
    "cameras look along +z with y downwards, the format's along -z with y upwards: "
    "multiply every R and t by diag(1, -1, -1)"
)


class OtherReading(NamedTuple):
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


def other_readings(file: BundleFile) -> Iterator[OtherReading]:
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
                yield OtherReading(plain, _joined(looks, counts))
            r, valid = reprojection(plain)
            shift = np.median(r[valid], axis=0) if valid.any() else np.zeros(2)
            if np.hypot(*shift) > FAR_BETTER * spread(file.problem):
                moved = replace(plain, seen=replace(seen, uv=seen.uv + shift))
                yield OtherReading(moved, _joined(looks, counts, CORNER))


FLIP4 = np.eye(4)
FLIP4[:3, :3] = FLIP


def _joined(*parts: str) -> str:
    return "; ".join(part for part in parts if part)


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
    best = min(other_readings(file), key=_start_of, default=None)
    share = _start_of(best) / start if best is not None else 1.0
    if best is None or not share < (FAR_BETTER if result.converged else 1.0):
        return ""
    before, found = typical_error(result.residual, result.valid), adjust(best.problem)
    after = typical_error(found.residual, found.valid)
    clear = np.isfinite(start) or _start_of(best) < CLEAR * spread(file.problem)
    level = (
        max(ALIKE * before, ROUNDING * spread(file.problem)) if share < FAR_BETTER else FAR_BETTER * before
    )
    if not clear or not after <= level:
        return ""
    errors = (
        f"{here:.3g} px at the {when}" + (f" (as it was read {there:.3g} px)" if np.isfinite(there) else "")
        for when, here, there in (("start", _start_of(best), start), ("end", after, before))
    )
    name = FORMATS[file.format]
    return (
        f"the file seems to follow another convention than {name}'s: {best.what}. "
        f"So read, the median error is {' and '.join(errors)}"
    )


def _start_of(reading: OtherReading) -> float:
    return typical_error(*reprojection(reading.problem))
