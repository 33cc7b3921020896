"""Images of a checkerboard: which files, and where the inner corners are.

OpenCV finds the corners and refines them to sub-pixel; this is measurement.  Nothing else of a calibration is
done by it.  Pixel (0, 0) is the centre of the top-left pixel, as everywhere here.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.datasets.picture_size import require_size
from vslam_ref.datasets.text import FormatError

Array = NDArray[np.float64]
GreyImage = NDArray[np.uint8]

SUFFIXES = (".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".ppm", ".tif", ".tiff", ".webp")
MAX_PIXELS = 100_000_000
CUT_OFF = "Premature end"
"""What the JPEG decoder writes when it fills the rest of a picture with grey."""
LEAST_CORNERS = 3
"""The detector takes no smaller board, in either direction."""
SMALLEST_SIDE = 32
"""Pixels; no board can be seen in a smaller picture, and the detector fails on it."""
WINDOW_SHARE = 0.2
LARGEST_WINDOW = 11
"""Half of the refinement's window: this share of the distance of neighbours, and at most this many pixels.

A window that reaches the next edge, as that of a border beside a narrow last row, pulls its corner there."""


def image_files(names: Sequence[Path | str]) -> list[Path]:
    """Images that are named: files as given, of folders all that end like an image, sorted by name.

    Raises
    ------
    FormatError
        If a name is neither file nor folder, or a folder has no image.
    """
    found: list[Path] = []
    for word in names:
        name = Path(word)
        if not str(word):
            raise FormatError(name, None, "an empty name; expected an image or a folder of images")
        if name.is_dir():
            inside = sorted(p for p in name.iterdir() if p.suffix.lower() in SUFFIXES and p.is_file())
            if not inside:
                raise FormatError(name, None, f"no image in this folder; expected {', '.join(SUFFIXES)}")
            found += inside
        elif name.is_file():
            found.append(name)
        else:
            raise FormatError(name, None, "no such file or folder")
    return found


def read_grey(path: Path | str) -> GreyImage:
    """Read an image as grey values (H, W), as it is stored: a note of how to turn it (EXIF) is not followed.

    A camera's parameters belong to the sensor's rows and columns, however it was held.

    Raises
    ------
    FormatError
        If the file is missing, no image, cut off, or larger than ``MAX_PIXELS``.
    """
    import cv2

    path = Path(path)
    if not path.is_file():
        raise FormatError(path, None, "no such file")
    require_size(path, MAX_PIXELS)
    with _complaints() as told:
        try:
            image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        except cv2.error as error:  # more than 2^30 pixels
            image = None
            told.append(str(error.err))
    why = " ".join(" ".join(told).split())
    if image is None:
        right = f"expected one of {', '.join(SUFFIXES)}"
        raise FormatError(path, None, f"no image that can be read{f' ({why})' if why else ''}; {right}")
    if CUT_OFF in why:
        raise FormatError(path, None, f"{why}: the picture is cut off; fetch it again")
    if image.size > MAX_PIXELS:
        raise FormatError(
            path, None, f"{image.shape[1]}x{image.shape[0]} pixels; at most {MAX_PIXELS} are read"
        )
    grey: GreyImage = image.astype(np.uint8, copy=False)
    return grey


@contextmanager
def _complaints() -> Iterator[list[str]]:
    """Collect what the decoders write to the process's standard error: lines that name no file."""
    told: list[str] = []
    sys.stderr.flush()
    with tempfile.TemporaryFile() as sink:
        kept = os.dup(2)
        try:
            os.dup2(sink.fileno(), 2)
            yield told
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            sink.seek(0)
            told.append(sink.read(1000).decode("utf-8", "replace"))


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
