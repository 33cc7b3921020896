"""A video file as pictures: counted once, then decoded forwards.

What a container says about the number of its pictures is often wrong, and jumping inside of it may land on
another picture.  So all are decoded once at opening, which also gives their times; a picture that lies
behind is reached from the start.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.pictures import MAX_PIXELS, Picture, complaints, from_opencv
from vslam_ref.datasets.text import FormatError

SUFFIXES = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".ogv", ".webm")
BEGINNINGS = ((0, b"RIFF"), (0, b"\x1aE\xdf\xa3"), (4, b"ftyp"), (4, b"moov"), (4, b"mdat"), (4, b"free"),
              (4, b"wide"), (0, b"\x00\x00\x01\xba"), (0, b"\x00\x00\x01\xb3"), (0, b"OggS"))  # fmt: skip
"""Of AVI, Matroska and WebM, MP4 and MOV, MPEG, Ogg.  Playlists, which may name other places, are none."""


def is_film(path: Path) -> bool:
    """Whether a file is called like a video."""
    return path.suffix.lower() in SUFFIXES


class VideoFile:
    """An opened video.

    Attributes
    ----------
    size : (int, int)
        Width and height, pixels.
    times : ndarray, shape (N,)
        Seconds, not falling, by the file's own stamps.
    rate : float
        Pictures a second by the file, or 0 where it does not say.
    notes : tuple of str

    Raises
    ------
    FormatError
        If it is no video, or none that this OpenCV can decode.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._video, self._next = self._open(), 0
        self.size, self.rate, stated = self._head()
        stamps = []
        with complaints():
            while self._video.grab():
                stamps.append(self._stamp())
        if not stamps:
            raise FormatError(path, None, "no picture can be decoded; expected a video")
        self._next = len(stamps)
        self.notes: tuple[str, ...] = ()
        self.times = self._in_order(np.array(stamps) / 1e3)
        if stated > 0 and stated != len(stamps):
            self.notes += (f"the file says {stated} pictures; {len(stamps)} can be decoded",)

    def picture(self, number: int) -> Picture:
        """Decode picture ``number``, from 0.

        Raises
        ------
        FormatError
            If it cannot be decoded.
        """
        with complaints():
            if number < self._next:
                self._video.release()
                self._video, self._next = self._open(), 0
            while self._next < number and self._video.grab():
                self._next += 1
            done, values = self._video.read()
        self._next += 1
        if not done or values is None:
            raise FormatError(self.path, None, f"picture {number} cannot be decoded")
        return from_opencv(values)

    def _open(self) -> Any:
        import cv2

        if not self.path.is_file():
            raise FormatError(self.path, None, "no such file")
        with self.path.open("rb") as stream:
            head = stream.read(16)
        if not any(head[at : at + len(magic)] == magic for at, magic in BEGINNINGS):
            right = "expected AVI, MP4, MOV, MKV, WebM, MPEG or Ogg"
            raise FormatError(self.path, None, f"no video by its first bytes; {right}")
        with complaints():
            video = cv2.VideoCapture(str(self.path.resolve()))
        if not video.isOpened():
            raise FormatError(
                self.path, None, "no video that this OpenCV can decode; convert it to MP4 or WebM"
            )
        return video

    def _head(self) -> tuple[tuple[int, int], float, int]:
        """Size, rate and number of pictures as the file says."""
        import cv2

        get = self._video.get
        width, height = int(get(cv2.CAP_PROP_FRAME_WIDTH)), int(get(cv2.CAP_PROP_FRAME_HEIGHT))
        if not (width >= 1 and height >= 1 and width * height <= MAX_PIXELS):
            raise FormatError(self.path, None, f"{width}x{height} pixels; at most {MAX_PIXELS} are read")
        rate, count = float(get(cv2.CAP_PROP_FPS)), float(get(cv2.CAP_PROP_FRAME_COUNT))
        return (width, height), rate if 0 < rate < 1e4 else 0.0, int(count) if 0 < count < 1e9 else 0

    def _stamp(self) -> float:
        """Milliseconds of the picture that was grabbed last."""
        import cv2

        stamp = float(self._video.get(cv2.CAP_PROP_POS_MSEC))
        return stamp if np.isfinite(stamp) and abs(stamp) < 1e12 else 0.0

    def _in_order(self, stamps: Array) -> Array:
        """Stamps that do not fall; by the rate where the file has none."""
        if len(stamps) > 1 and not stamps[-1] > stamps[0]:
            rate = self.rate or 30.0
            self.notes += (f"the video has no times: picture k, from 0, is at k/{rate:g} s",)
            return np.arange(len(stamps)) / rate
        fell = int((np.diff(stamps) < 0).sum())
        if fell:  # pictures come in the order to show them, stamps in the order of decoding
            self.notes += (f"{fell} time(s) of the video earlier than the one before: sorted",)
        return np.sort(stamps)
