"""What A says of keyframe methods and pure rotation, judged on the runs of ``ptam-rotation``."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.experiments.framework import Claim, Study, judged
from vslam_ref.experiments.framework.claims import LEAST_FOR_EVERY_RUN
from vslam_ref.experiments.ptam.turning_runs import TurningRun
from vslam_ref.worlds.rendered import scene

RIGHT = 0.1
"""Metres that a pose may be off and still be called tracked; walls are 2 m away or more."""
SOURCE = "A§1.3.3"


def field_of_view() -> float:
    """Of the scene's camera, degrees across."""
    made = scene("rotation", frames=1)
    ends = made.camera.unproject(np.array([[-0.5, 239.5], [639.5, 239.5]])).bearing
    return float(np.degrees(np.arccos(ends[0] @ ends[1])))


def claims(study: Study[TurningRun]) -> list[Claim]:
    """Judge what A says of keyframe methods, and where it stops to be true."""
    return [
        _lost(study), _starved(study), _no_keyframes(study), _goes_on(study), _no_start(study),
    ]  # fmt: skip


def _of(study: Study[TurningRun], arm: float) -> TurningRun:
    at = study.config.arms.index(arm)
    return TurningRun(*(np.asarray(field)[at] for field in study.data))


def _lost(study: Study[TurningRun]) -> Claim:
    runs, view = _of(study, 0.0), field_of_view()
    holds = runs.started & (runs.lost_at < view)
    return judged(
        "pure-rotation-is-lost",
        SOURCE,
        "A keyframe method that turns on the spot to new things is lost when the old ones leave the picture",
        f"arm 0: in every run the last pose lies before one field of view, {view:.0f} degrees",
        bool(holds.all()),
        f"Turning on the spot, the camera was lost after {_list(np.sort(runs.lost_at))} degrees; the field "
        f"of view has {view:.0f}",
        {"lost_at_deg": runs.lost_at.tolist(), "field_of_view_deg": view},
        share=float(holds.mean()),
    )


def _starved(study: Study[TurningRun]) -> Claim:
    runs, longest = _of(study, 0.0), _of(study, max(study.config.arms))
    holds = runs.started & (runs.points <= 0.05 * longest.points)
    return judged(
        "no-parallax-no-points",
        SOURCE,
        "Turning on the spot, nothing new can be triangulated: there is no parallax",
        "arm 0, points outside of all pictures from before the turn: in every run at most a twentieth of "
        "those with the longest arm",
        bool(holds.all()),
        f"Turning on the spot put {_list(runs.points)} points where nothing had been seen before, the "
        f"longest arm {_list(longest.points)}",
        {"points": runs.points.tolist(), "with_the_longest_arm": longest.points.tolist()},
        share=float(holds.mean()),
    )


def _no_keyframes(study: Study[TurningRun]) -> Claim:
    runs = _of(study, 0.0)
    holds = runs.started & (runs.keyframes == 0)
    return judged(
        "no-points-no-keyframes",
        SOURCE,
        "And so no new keyframes can be made",
        "arm 0: in every run no keyframe in the turn",
        bool(holds.all()),
        f"Turning on the spot made {_list(runs.keyframes)} keyframes: this system makes one when few of the "
        "known points are left in view, with new points or without",
        {"keyframes": runs.keyframes.tolist()},
        share=float(holds.mean()),
    )


def _list(values: Array | IntArray) -> str:
    return ", ".join(f"{v:.0f}" if np.isfinite(v) else "none" for v in values)


def _goes_on(study: Study[TurningRun]) -> Claim:
    longest = max(study.config.arms)
    runs = _of(study, longest)
    through = runs.started & np.isnan(runs.lost_at) & (runs.share > 0.9)
    holds = through & (runs.wander < RIGHT)
    return judged(
        "an-arm-is-enough",
        SOURCE,
        f"With an arm of {longest:g} m the same turn gives new points, and the camera is not lost",
        f"in at least 5 of 6 of the runs a pose at the end, for more than 90 % of the turn, and no error of "
        f"place above {RIGHT:g} m",
        float(holds.mean()) >= 5 / 6 - 1e-9,
        f"With an arm of {longest:g} m, {int(through.sum())} of {len(holds)} runs came through; the camera's "
        f"place is wrong by {1000 * float(np.nanmax(runs.wander)):.0f} mm at most",
        {"share": runs.share.tolist(), "wander_m": runs.wander.tolist()},
        share=float(holds.mean()),
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def _no_start(study: Study[TurningRun]) -> Claim:
    runs = _of(study, 0.0)
    holds = ~np.asarray(runs.alone, bool) & (np.asarray(runs.reason) != "")
    return judged(
        "pure-rotation-does-not-start",
        SOURCE,
        "Without a map before it, a turn on the spot makes none: two pictures have no parallax",
        "arm 0: in every run no map, and a reason",
        bool(holds.all()),
        f"{int(np.sum(runs.alone))} of {len(holds)} turns on the spot made a map; the first one's reason: "
        f'"{runs.reason[0]}"',
        {"started": int(np.sum(runs.alone))},
        share=float(holds.mean()),
    )
