"""How the boards stand, measured under a usual sensor: tilts, and angles between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.calibration.board import BoardCorners
from vslam_ref.estimation.calibration.homography import homography
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.estimation.calibration.problem import (
    CalibrationIterate,
    CalibrationProblem,
    CalibrationState,
)
from vslam_ref.estimation.calibration.start import LEAST_COSINE, find_start, state_of
from vslam_ref.estimation.least_squares import Options, descend
from vslam_ref.estimation.robust import L2
from vslam_ref.geometry.cameras import Camera, Pinhole, Radtan

SENSOR = ("fx", "fy", "cx", "cy")
NO_MORE = {"p1": 0.0, "p2": 0.0, "k3": 0.0}
"""Of a lens that only takes the bend out of the pictures: k1 and k2 are enough."""
FLAT_TILT, ALIKE = np.radians(8.0), np.radians(5.0)
"""Boards tilted by less are called parallel to the image plane; less apart, parallel to each other."""


class BoardDirections(NamedTuple):
    """How the boards stand: largest tilt to the image plane, and largest angle between two, radians."""

    tilt: float
    apart: float
    focal: float | None


class RegularPoint(NamedTuple):
    """The problem at the best fit of a usual sensor.

    Attributes
    ----------
    point : CalibrationIterate
        All free parameters are free again there: its normal equations tell what is not determined.
    boards : BoardDirections
    """

    point: CalibrationIterate
    boards: BoardDirections


def regular_point(corners: BoardCorners, size: tuple[int, int], free: Free) -> RegularPoint | None:
    """The best fit of a sensor with the larger side as focal length, and the centre in the middle.

    Minimises :eq:`eq-calibration-cost` with this sensor held; None where no such camera sees the corners.

    Notes
    -----
    A model whose lens is not free gets one for the fit, or the bend of the pictures would tilt the boards.
    """
    usual = _usual(size, free)
    names = free.model.names()
    bare = all(name in usual for name in names)
    held = Free(Radtan, {n: usual[n] for n in SENSOR} | NO_MORE) if bare else Free(free.model, usual)
    try:
        start = find_start(corners, size, held)
    except ValueError:
        return None
    fit = CalibrationProblem(corners, held, L2())
    here = fit.linearise(state_of(start, held))
    if here is None:
        return None
    found = descend(fit, here, Options(step=1e-8, cost=1e-10, max_iterations=50)).here.state
    params = np.array([usual[name] for name in names]) if bare else found.params
    point = CalibrationProblem(corners, free, L2()).linearise(CalibrationState(params, found.T_cam_board))
    if point is None:
        return None
    cameras = (held.model.from_params(found.params), Pinhole(*(usual[name] for name in SENSOR)))
    return RegularPoint(point, directions(corners, cameras, usual["fx"]))


def _usual(size: tuple[int, int], free: Free) -> dict[str, float]:
    """A usual sensor, and what is fixed."""
    focal = float(free.fixed.get("fx", max(size)))
    sensor = (focal, focal * (free.aspect or 1.0), (size[0] - 1) / 2, (size[1] - 1) / 2)
    return dict(zip(SENSOR, sensor, strict=True)) | dict(free.fixed)


def directions(
    corners: BoardCorners, cameras: Sequence[Camera], focal: float | None = None
) -> BoardDirections:
    """How the boards stand under that of some cameras that makes them most parallel.

    Notes
    -----
    The normal of a plane is the vanishing line of its homography to rays, n = H^-T (0, 0, 1): parallel boards
    have the same one whatever the focal length.  The rotation nearest to a homography would not do: it
    answers for a wrong focal length as well.
    """
    found = [_normals(corners, camera) for camera in cameras]
    stand = [
        BoardDirections(
            float(np.arccos(np.clip(np.abs(n[:, 2]), 0.0, 1.0)).max()),
            float(np.arccos(np.clip(np.abs(n @ n.T), 0.0, 1.0)).max()),
            focal,
        )
        for n in found
        if n is not None
    ]
    return min(stand, key=lambda one: one.apart, default=BoardDirections(np.pi / 2, np.pi / 2, focal))


def _normals(corners: BoardCorners, camera: Camera) -> Array | None:
    """Unit normals (V, 3) of the boards in the camera's frame; None where the camera has no rays for them."""
    rays = camera.unproject(corners.uv)
    if not (rays.valid & (rays.bearing[:, 2] > LEAST_COSINE)).all():
        return None
    xn = rays.bearing[:, :2] / rays.bearing[:, 2:]
    normals = np.empty((corners.views, 3))
    for view in range(corners.views):
        at = corners.view == view
        H = homography(corners.X_board[at, :2], xn[at])
        try:
            normals[view] = np.linalg.solve(H.T, [0.0, 0.0, 1.0])
        except np.linalg.LinAlgError:
            return None
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / length if np.isfinite(length).all() and (length > 0).all() else None


def why_flat(boards: BoardDirections) -> str:
    """Why the sensor is open, where the boards' directions show it; "" where they do not."""
    if boards.apart > ALIKE:
        return ""
    if boards.tilt <= FLAT_TILT:
        return (
            "all boards are nearly parallel to the image plane "
            f"(largest tilt {np.degrees(boards.tilt):.1f} degrees), "
            "where a longer focal length looks like a greater distance: tilt the board by 30 to 45 degrees"
        )
    assumed = "" if boards.focal is None else f" if the focal length is {boards.focal:.0f} px"
    return (
        "all boards are nearly parallel to each other, and count as one view: they stand at "
        f"{np.degrees(boards.tilt):.0f} degrees to the image plane{assumed}, and at most "
        f"{np.degrees(boards.apart):.2g} degrees apart; tilt the board in different directions"
    )
