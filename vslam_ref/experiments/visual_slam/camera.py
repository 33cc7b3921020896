"""What self-calibration found, and what a second run with it would change."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vslam_ref.datasets.calibration_files import CameraFile
from vslam_ref.estimation.bundle.self_calibration import LEANS_ON
from vslam_ref.experiments.visual_slam.paths import scale_drift, trajectory
from vslam_ref.experiments.visual_slam.running import Run
from vslam_ref.metrics.trajectory import absolute_error
from vslam_ref.systems.visual_map.refine_camera import RefinedCamera

CLEAR = 2.0
"""Standard deviations that a number of the camera must move, for the change to be more than noise."""
UNITS = {"fx": "px", "fy": "px", "cx": "px", "cy": "px", "omega": "rad"}


class PathChange(NamedTuple):
    """The path with the camera as given beside that with the refined one; None where it cannot be told.

    Attributes
    ----------
    percent : float or None
        RMS distance after a similarity, of the length of the refined path.
    drift : float or None
        Scale of the last third over that of the first, that bring the path as given to the refined one.
    """

    percent: float | None
    drift: float | None


def path_change(run: Run, refined: RefinedCamera) -> PathChange:
    """What the refined camera has changed in the path of a run."""
    now, before = (trajectory(None, run.system.trajectory(T)[1]) for T in (None, refined.T_kf_before))
    length = float(np.linalg.norm(np.diff(now.t_world_body, axis=0), axis=1).sum())
    try:
        apart = absolute_error(before, now, "sim3").stats.rmse
    except ValueError:
        return PathChange(None, None)
    return PathChange(100 * apart / length if length > 0 else None, scale_drift(before, now))


def camera_numbers(run: Run) -> dict[str, Any] | None:
    """The refined camera for the JSON; None where none was asked for."""
    refined = run.system.refined
    if refined is None:
        return None
    change = path_change(run, refined)
    return {
        "model": type(refined.camera).__name__.lower(),
        "given": dict(zip(refined.given.names(), refined.given.params.tolist(), strict=True)),
        "refined": dict(zip(refined.camera.names(), refined.camera.params.tolist(), strict=True)),
        "sigma": refined.sigma,
        "refused": {
            name: {"sigma": _finite(why.sigma), "shift_px": _finite(why.shift_px)}
            for name, why in refined.refused.items()
        },
        "reason": refined.reason,
        "path_change_percent": change.percent,
        "path_change_drift": change.drift,
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def camera_notes(run: Run) -> list[str]:
    """What was refused and why, and what a second run would change."""
    refined = run.system.refined
    if refined is None:
        return []
    limit = run.settings.camera.most_shift
    told = [refusal(name, refined, limit) for name in refined.refused]
    if refined.reason:
        return [*told, f"the camera is kept as it was given: {refined.reason}"]
    told = [*told, second_run(refined, path_change(run, refined))]
    if within_noise(refined):
        told.append(
            f"no number of the camera moved by more than {CLEAR:g} of its sigmas: keep the camera given"
        )
    return told


def refusal(name: str, refined: RefinedCamera, limit: float) -> str:
    """Why an intrinsic was not changed."""
    why = refined.refused[name]
    start = dict(zip(refined.given.names(), refined.given.params, strict=True)).get(name, 0.0)
    kept = f"kept at {start:.6g}"
    if not np.isfinite(why.sigma):
        return f"{name} is not determined by this motion (sigma: infinite): {kept}"
    unit = f" {UNITS[name]}" if name in UNITS else ""
    if why.shift_px <= limit:
        return (
            f"{name} can only be told together with {LEANS_ON[name]}, which this motion does not show: {kept}"
        )
    moved = f"moves a pixel by up to {why.shift_px:.3g} px, limit {limit:.3g}"
    return f"{name} is not determined by this motion (sigma {why.sigma:.3g}{unit}, {moved}): {kept}"


def within_noise(refined: RefinedCamera) -> bool:
    """Whether no intrinsic moved by more than :data:`CLEAR` of its own standard deviations."""
    given = dict(zip(refined.given.names(), refined.given.params, strict=True))
    found = dict(zip(refined.camera.names(), refined.camera.params, strict=True))
    return all(abs(found[n] - given.get(n, 0.0)) <= CLEAR * s for n, s in refined.sigma.items() if n in found)


def second_run(refined: RefinedCamera, change: PathChange) -> str:
    """What a second run with the refined camera would change."""
    pixels = f"pixels move by up to {refined.shift.largest:.3g} px (RMS {refined.shift.rms:.3g})"
    path = "" if change.percent is None else f", the path by {change.percent:.2g} % of its length"
    scale = (
        ""
        if change.drift is None
        else f", the last third against the first by a factor of {change.drift:.3g}"
    )
    live = "tracked anew with --camera camera.yaml, the poses between keyframes and the live path follow"
    return f"the refined camera: {pixels}{path}{scale}; {live}"


def camera_rows(run: Run) -> list[list[str]]:
    """Rows of a table: intrinsic, given, refined, sigma, unit."""
    refined = run.system.refined
    if refined is None:
        return []
    given = dict(zip(refined.given.names(), refined.given.params, strict=True))
    rows = []
    for name, value in zip(refined.camera.names(), refined.camera.params, strict=True):
        sigma = f"{refined.sigma[name]:.3g}" if name in refined.sigma else "kept"
        rows.append([name, f"{given.get(name, 0.0):.6g}", f"{value:.6g}", sigma, UNITS.get(name, "")])
    return rows


def camera_file(run: Run) -> CameraFile | None:
    """The refined camera to be written; None where it is as it was given."""
    refined = run.system.refined
    if refined is None or refined.reason:
        return None
    std = tuple(refined.sigma.get(name, 0.0) for name in refined.camera.names())
    return CameraFile(refined.camera, run.sequence.size, std=std)
