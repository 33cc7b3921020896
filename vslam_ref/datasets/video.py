"""Pictures as a video file: WebM with VP8, which a browser plays, or AVI with a JPEG for each picture."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
SIZES = ("small", "half", "full", "none")
"""Of a film: 320 pixels wide, half of the pictures' width, all of it, or no film."""
SMALL = 320


class Film(Protocol):
    """What takes the pictures: call it with one, RGB (rows, columns, 3), first row on top."""

    def __call__(self, picture: Bytes) -> None:
        """Add a picture."""


@contextmanager
def webm(path: Path, size: str = "small", fps: float = 10.0) -> Iterator[Film]:
    """Write pictures of one size to a WebM file.

    Parameters
    ----------
    path : Path
        Not written if no picture comes.
    size : {"small", "half", "full"}
        320 pixels wide, or half of the pictures' width, or all of it; both sides are made even, as VP8 wants
        it, and at least 16 pixels.
    fps : float
        Pictures a second.

    Raises
    ------
    ValueError
        If a picture has another size than the first, the size is unknown, or this OpenCV writes no WebM.
    """
    with _written(path, "VP80", size, fps) as film:
        yield film


@contextmanager
def avi(path: Path, fps: float = 30.0) -> Iterator[Film]:
    """Write pictures of one size to an AVI file, each as a JPEG: larger than WebM, the same bytes each time.

    Parameters and errors are those of :func:`webm`; the size is "full".
    """
    with _written(path, "MJPG", "full", fps) as film:
        yield film


@contextmanager
def _written(path: Path, code: str, size: str, fps: float) -> Iterator[Film]:
    import cv2

    if size not in SIZES[:-1]:
        raise ValueError(f"size {size!r} of a film: must be one of {', '.join(SIZES[:-1])}")
    writer, given, shape = None, None, (0, 0)

    def add(picture: Bytes) -> None:
        nonlocal writer, given, shape
        if writer is None:
            given, shape = picture.shape, _even(picture.shape, size)
            with _quiet():  # it says that it knows no such tag in such a file, and writes it
                writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*code), fps, shape)
            if not writer.isOpened():
                raise ValueError(f"{path}: this OpenCV writes no {path.suffix[1:]} video")
        if picture.shape != given:
            raise ValueError(f"a picture of {picture.shape} in a film of {given}: all must have one size")
        shrink = shape[0] < picture.shape[1]
        way = cv2.INTER_AREA if shrink else cv2.INTER_NEAREST
        writer.write(cv2.resize(np.ascontiguousarray(picture[..., ::-1]), shape, interpolation=way))

    try:
        yield add
    finally:
        if writer is not None:
            writer.release()


def _even(shape: tuple[int, ...], size: str) -> tuple[int, int]:
    """Width and height of the film of pictures (rows, columns, 3), both even."""
    rows, columns = shape[:2]
    share = {"small": SMALL / columns, "half": 0.5, "full": 1.0}[size]
    width, height = (max(2 * round(share * n / 2 + 1e-9), 16) for n in (columns, rows))
    return width, height


@contextmanager
def _quiet() -> Iterator[None]:
    """Nothing reaches the standard error stream, not from C code either."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
