"""Where to begin: a camera and poses, from homographies, for lenses with and without much distortion.

Zhang's closed form knows no distortion; a wide lens may bend its answer into no camera at all.  So its
answer is one candidate of many: some focal lengths and a few strengths of the lens.  Each candidate camera
turns the corners into rays, each view's rays give a homography and this a pose, and the candidate whose
poses put the corners nearest to where they were found is the start.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.calibration.board import LEAST_CORNERS, BoardCorners
from vslam_ref.estimation.calibration.homography import homography
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.estimation.calibration.problem import CalibrationState, residual
from vslam_ref.estimation.calibration.zhang import pose_from_homography, sensor_from_homographies
from vslam_ref.geometry.cameras import Camera

LENSES: dict[str, tuple[tuple[float, ...], ...]] = {
    "Pinhole": ((),),
    "Fov": ((0.2,), (0.6,), (1.0,), (1.4,)),  # not 0: the lens is even in omega, its slope there is zero
    "Radtan": ((0.0,) * 5, (-0.25, 0.0, 0.0, 0.0, 0.0)),
    "Rational": ((0.0,) * 8, (-0.25,) + (0.0,) * 7),
    "Fisheye": ((0.0,) * 4,),
}
FOCAL_SHARES = np.geomspace(0.2, 4.0, 13)
"""Focal lengths tried, in the image's larger side: lenses of 136 to 14 degrees."""

LEAST_COSINE = 0.15
"""Rays flatter than this to the plane z = 1, 81 degrees off the axis, take no part in a homography."""


class Start(NamedTuple):
    """Camera, poses T_cam_board (V, 4, 4), and the root mean square error there, pixels."""

    camera: Camera
    T_cam_board: Array
    rms_px: float


def find_start(corners: BoardCorners, size: tuple[int, int], free: Free) -> Start:
    """Best of some candidate cameras.

    Parameters
    ----------
    corners : BoardCorners
    size : (int, int)
        Width and height of the images, pixels; a candidate's principal point is their centre.
    free : Free
        Model and fixed parameters, which every candidate has.

    Returns
    -------
    Start

    Raises
    ------
    ValueError
        If no candidate sees the corners as images of a flat board.
    """
    best: Start | None = None
    for params in _candidates(corners, size, free):
        found = poses_for(corners, params, free.model)
        if found is not None and (best is None or found.rms_px < best.rms_px):
            best = found
    if best is None:
        raise ValueError(
            f"no {free.model.__name__} camera sees these corners as a flat board in front of it; "
            "are the corners in the order of the board?"
        )
    return best


def _candidates(corners: BoardCorners, size: tuple[int, int], free: Free) -> Iterator[Array]:
    """Intrinsics to try."""
    centre = [(size[0] - 1) / 2, (size[1] - 1) / 2]
    sensors = [[share * max(size)] * 2 + centre for share in FOCAL_SHARES]
    views = [corners.of(v) for v in range(corners.views)]
    H = np.stack([homography(view.X_board[:, :2], view.uv) for view in views])
    zhang = sensor_from_homographies(H, size).numbers
    if zhang is not None:
        sensors.append(zhang.tolist())
    for lens in LENSES[free.model.__name__]:
        for sensor in sensors:
            yield free.apply(np.array([*sensor, *lens]))


def poses_for(corners: BoardCorners, params: Array, model: type[Camera]) -> Start | None:
    """Pose of each view for a known camera, by homography; None where it has no ray for enough corners.

    Parameters
    ----------
    corners : BoardCorners
    params : ndarray, shape (n,)
        Intrinsics; focal lengths and centre in pixels.
    model : type
        The camera's model.
    """
    camera = model.from_params(params)
    rays = camera.unproject(corners.uv)
    usable = rays.valid & (rays.bearing[:, 2] > LEAST_COSINE)
    xn = rays.bearing[:, :2] / np.where(usable, rays.bearing[:, 2], 1.0)[:, None]
    H = np.empty((corners.views, 3, 3))
    for view in range(corners.views):
        at = usable & (corners.view == view)
        if at.sum() < LEAST_CORNERS:
            return None
        H[view] = homography(corners.X_board[at, :2], xn[at])
    try:
        T_cam_board = pose_from_homography(H)
    except ValueError:
        return None
    r = residual(params, T_cam_board[corners.view], corners.X_board, corners.uv, lens=model.lens)
    rms = float(np.sqrt((r * r).sum(axis=1).mean()))
    return Start(camera, T_cam_board, rms) if np.isfinite(rms) else None


def state_of(start: Start, free: Free) -> CalibrationState:
    """The start as a state, with the fixed parameters put in."""
    return CalibrationState(free.apply(start.camera.params), start.T_cam_board)
