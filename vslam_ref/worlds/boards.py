"""Boards in front of a known camera: exact corners, and corners with noise."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.calibration.board import Board, BoardView
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Camera

TRIES = 10_000


def poses(
    board: Board,
    camera: Camera,
    size: tuple[int, int],
    count: int,
    rng: np.random.Generator,
    *,
    tilt: tuple[float, float] = (0.2, 0.8),
    fill: tuple[float, float] = (0.4, 0.8),
) -> Array:
    """Random poses of the board, all of whose corners lie in the image.

    Parameters
    ----------
    board : Board
    camera : Camera
    size : (int, int)
        Width and height of the image, pixels.
    count : int
        Number of poses.
    rng : Generator
    tilt : (float, float)
        Least and largest angle between board and image plane, radians.
    fill : (float, float)
        Least and largest width of the board in the image, if it were not tilted, as share of the image's.

    Returns
    -------
    ndarray, shape (count, 4, 4)
        T_cam_board, in the board's unit.

    Raises
    ------
    ValueError
        If hardly any pose shows the whole board.
    """
    found: list[Array] = []
    middle = board.points.mean(axis=0)
    width = np.ptp(board.points[:, 0])
    for _ in range(TRIES):
        if len(found) == count:
            return np.stack(found)
        around = rng.uniform(-np.pi, np.pi)
        axis = np.array([np.cos(around), np.sin(around), 0.0])
        R = so3.exp(rng.uniform(*tilt) * axis) @ so3.exp([0.0, 0.0, rng.uniform(-0.3, 0.3)])
        distance = camera.fx * width / (rng.uniform(*fill) * size[0])
        at = camera.unproject(rng.uniform([0.2, 0.2], [0.8, 0.8]) * (np.array(size) - 1.0))
        T = se3.from_rt(R, distance * at.bearing - R @ middle)
        seen = camera.pixel_from_world(T, board.points)
        inside = (seen.uv >= 0).all() and (seen.uv <= np.array(size) - 1.0).all()
        if at.valid and seen.valid.all() and inside:
            found.append(T)
    raise ValueError(f"only {len(found)} of {count} poses show the whole board in {TRIES} tries")


def views(
    board: Board,
    camera: Camera,
    T_cam_board: Array,
    sigma_px: float = 0.0,
    rng: np.random.Generator | None = None,
) -> list[BoardView]:
    """Corners of the board at some poses, with Gaussian noise.

    Parameters
    ----------
    board : Board
    camera : Camera
    T_cam_board : ndarray, shape (V, 4, 4)
    sigma_px : float
        Standard deviation of each coordinate, pixels.
    rng : Generator, optional
        Needed where ``sigma_px`` is not 0.

    Returns
    -------
    list of BoardView

    Raises
    ------
    ValueError
        If a corner is not visible, or noise is wanted without a generator.
    """
    if sigma_px != 0.0 and rng is None:
        raise ValueError(f"sigma_px={sigma_px} needs a random generator")
    seen = camera.pixel_from_world(T_cam_board[:, None], board.points)
    if not seen.valid.all():
        raise ValueError("a corner is behind the camera or outside its field")
    noise = sigma_px * rng.standard_normal(seen.uv.shape) if rng is not None else 0.0
    return [BoardView(board.points, uv) for uv in seen.uv + noise]
