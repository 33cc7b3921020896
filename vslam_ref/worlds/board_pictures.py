"""Pictures of a checkerboard, as a camera that is known exactly would take them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.estimation.calibration import Board
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.worlds import boards

DARK, BRIGHT = 30.0, 220.0
"""Grey values of black squares, and of all else."""


class BoardPictures(NamedTuple):
    """Pictures (V, H, W) of grey values, and where the board was in each: T_cam_board (V, 4, 4), metres."""

    images: NDArray[np.uint8]
    T_cam_board: Array


def take(
    board: Board, camera: Camera, size: tuple[int, int], count: int, rng: np.random.Generator, **poses: Any
) -> BoardPictures:
    """Take pictures of a board in random poses, its ring of squares inside the image.

    ``poses`` goes to :func:`boards.poses`, for a board that has the ring's outer corners, too.
    """
    ringed = Board(board.columns + 2, board.rows + 2, board.square)
    corner = se3.from_rt(
        np.eye(3), np.array([board.square, board.square, 0.0])
    )  # of the board in the ringed one
    T = se3.compose(boards.poses(ringed, camera, size, count, rng, **poses), corner)
    xn = normalised_samples(camera, size)
    return BoardPictures(np.stack([render(board, xn, one) for one in T]), T)


def normalised_samples(camera: Camera, size: tuple[int, int], samples: int = 3) -> Array:
    """Viewing directions of an image of ``size`` (W, H), ``samples`` x ``samples`` evenly over each pixel.

    The lens is inverted at the corners of the pixels, and taken as bilinear between: over one pixel the
    second derivative of a usual lens is 1e-3 px, so this is right to 2e-4 px.

    Returns
    -------
    ndarray, shape (H, samples, W, samples, 2)
        On the plane z = 1 of the camera's frame; the lens sees less than half a sphere.
    """
    width, height = size
    v, u = np.meshgrid(np.arange(height + 1) - 0.5, np.arange(width + 1) - 0.5, indexing="ij")
    bearing = camera.unproject(np.stack([u, v], axis=-1)).bearing
    xn = bearing[..., :2] / bearing[..., 2:]
    w = ((np.arange(samples) + 0.5) / samples)[:, None, None]
    xn = xn[:-1, None] + w * (xn[1:] - xn[:-1])[:, None]  # (H, samples, W + 1, 2)
    return np.asarray(xn[..., :-1, None, :] + w[:, 0] * (xn[..., 1:, :] - xn[..., :-1, :])[..., None, :])


def render(board: Board, xn: Array, T_cam_board: Array) -> NDArray[np.uint8]:
    """Grey values (H, W): each pixel is the mean over its samples of what they meet in the board's plane.

    Parameters
    ----------
    board : Board
        Of inner corners; a ring of squares lies around them, and bright paper around that.
    xn : ndarray, shape (H, s, W, s, 2)
        Of :func:`normalised_samples`.
    T_cam_board : ndarray, shape (4, 4)
        Metres.
    """
    to_board = np.linalg.inv(T_cam_board[:3, [0, 1, 3]])  # of a point (x, y, 0) of the board
    x, y, w = (xn[..., 0] * row[0] + xn[..., 1] * row[1] + row[2] for row in to_board)
    column, row = np.floor(x / w / board.square), np.floor(y / w / board.square)
    on = (column >= -1) & (column < board.columns) & (row >= -1) & (row < board.rows) & (w > 0)
    grey = np.where(on & ((column + row) % 2 == 0), DARK, BRIGHT)
    return np.asarray(grey.mean(axis=(1, 3)).round(), dtype=np.uint8)
