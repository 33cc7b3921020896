"""Pictures as a video file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]


class Film(Protocol):
    """What takes the pictures: call it with one, RGB (rows, columns, 3), first row on top."""

    def __call__(self, picture: Bytes) -> None:
        """Add a picture."""


@contextmanager
def mp4(path: Path, fps: float = 10.0) -> Iterator[Film]:
    """Write pictures of one size to an MP4 file (MPEG-4 part 2, as every player knows it).

    Sizes are made even, as the format wants it, by repeating the last row or column.

    Raises
    ------
    ValueError
        If a picture has another size than the first, or this OpenCV writes no MP4.
    """
    import cv2

    writer, size = None, None

    def add(picture: Bytes) -> None:
        nonlocal writer, size
        rows, columns = picture.shape[:2]
        even = np.pad(picture, ((0, rows % 2), (0, columns % 2), (0, 0)), mode="edge")
        shape = (even.shape[1], even.shape[0])
        if writer is None:
            writer, size = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), fps, shape), shape
            if not writer.isOpened():
                raise ValueError(f"{path}: this OpenCV writes no MP4 video")
        if shape != size:
            raise ValueError(f"a picture of {shape} in a video of {size}: all must have one size")
        writer.write(np.ascontiguousarray(even[..., ::-1]))

    try:
        yield add
    finally:
        if writer is not None:
            writer.release()
