"""Images of a checkerboard: where the inner corners are.

OpenCV finds the corners and refines them to sub-pixel; this is measurement.  Nothing else of a calibration is
done by it.  Pixel (0, 0) is the centre of the top-left pixel, as everywhere here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array

LEAST_CORNERS = 3
"""The detector takes no smaller board, in either direction."""
SMALLEST_SIDE = 32
"""Pixels; no board can be seen in a smaller picture, and the detector fails on it."""
WINDOW_SHARE = 0.2
LARGEST_WINDOW = 11
"""Half of the refinement's window: this share of the distance of neighbours, and at most this many pixels.

A window that reaches the next edge, as that of a border beside a narrow last row, pulls its corner there."""


def find_corners(image: NDArray[Any], columns: int, rows: int) -> Array | None:
    """Inner corners of a checkerboard, to sub-pixel.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W)
        Grey values.
    columns, rows : int
        Inner corners along a row and a column of the board, at least 3.

    Returns
    -------
    ndarray, shape (rows * columns, 2), or None
        Pixels, row by row as :attr:`~vslam_ref.estimation.calibration.board.Board.points`; None where the
        whole board was not found.  Which of its corners is the first may change from image to image.

    Raises
    ------
    ValueError
        On an image that is not grey, or a board that is too small for the detector.

    Notes
    -----
    The refinement looks at a window of a fifth of the distance of neighbours to each side, and at 11 pixels
    at most.  On the 26 pictures of ``opencv_samples`` this leaves errors of at most 0.6 pixels after
    calibration; 11 pixels throughout, as in many examples, leave errors of up to 5.
    """
    import cv2

    if image.ndim != 2 or image.dtype != np.uint8 or image.size == 0:
        raise ValueError(f"image has shape {image.shape} and type {image.dtype}; need grey uint8, (H, W)")
    if min(columns, rows) < LEAST_CORNERS:
        raise ValueError(
            f"board {columns}x{rows}: at least {LEAST_CORNERS} inner corners each way can be found"
        )
    if min(image.shape) < SMALLEST_SIDE:
        return None
    found, corners = cv2.findChessboardCorners(image, (columns, rows))
    if not found:
        return None
    # OpenCV 4 answers (N, 1, 2), OpenCV 5 (1, N, 2)
    start = np.ascontiguousarray(corners.reshape(-1, 1, 2), dtype=np.float32)
    half = _half_window(start.reshape(rows, columns, 2))
    until = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-4)
    refined = cv2.cornerSubPix(image, start, (half, half), (-1, -1), until)
    uv: Array = refined.reshape(-1, 2).astype(np.float64)
    return uv if np.isfinite(uv).all() else None


def _half_window(grid: NDArray[np.float32]) -> int:
    """Half of the refinement's window: inside the neighbours of a typical corner, 2 at least."""
    along = [np.linalg.norm(np.diff(grid, axis=axis), axis=-1).ravel() for axis in (0, 1)]
    return int(np.clip(WINDOW_SHARE * np.median(np.concatenate(along)), 2, LARGEST_WINDOW))
