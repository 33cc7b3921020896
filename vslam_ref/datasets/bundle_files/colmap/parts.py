"""What the three files of a COLMAP model say, in either form, before it is a problem.

::

    cameras   CAMERA_ID -> model, size, parameters
    images    IMAGE_ID  -> pose, camera, name; places and POINT3D_ID of its features
    points    POINT3D_ID -> X Y Z, colour; its track: (IMAGE_ID, number of the feature) again and again

A text has lines, a binary file has none: its errors name the camera, image or point instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.bundle_files.loading import FARTHEST
from vslam_ref.datasets.text import FormatError

POSE = ("QW", "QX", "QY", "QZ", "TX", "TY", "TZ")
NO_POINT = -1
"""POINT3D_ID of a feature without a point: -1 in a text, the largest number of 64 bits in a binary file."""


class FilePlace(NamedTuple):
    """Where something stands: its line in a text, or what it is in a binary file."""

    line: int | None
    called: str = ""

    def error(self, path: Path, what: str, below: int = 0) -> FormatError:
        """The error at this place, or some lines below it."""
        if self.line is None:
            return FormatError(path, None, f"{self.called}: {what}")
        return FormatError(path, self.line + below, what)


class CameraPart(NamedTuple):
    """A camera: its model's name in the file, width and height, and parameters in the file's order."""

    place: FilePlace
    model: str
    size: tuple[int, int]
    params: list[float]


class ImagePart(NamedTuple):
    """An image; of its features the places (F, 2) and the points' numbers (F,), -1 for none."""

    place: FilePlace
    pose: list[float]
    camera: int
    name: str
    uv: Array
    point: IntArray


class PointParts(NamedTuple):
    """All points.

    Attributes
    ----------
    place : callable
        ``k -> FilePlace`` of point k.
    ids : ndarray, shape (N,)
    X : ndarray, shape (N, 3)
    colours : ndarray of uint8, shape (N, 3)
    track_point : ndarray, shape (m,)
        Which point, from 0, each entry of ``track`` belongs to.
    track : ndarray, shape (m, 2)
        IMAGE_ID and the number of the feature.
    """

    place: Callable[[int], FilePlace]
    ids: IntArray
    X: Array
    colours: NDArray[np.uint8]
    track_point: IntArray
    track: IntArray


@dataclass(frozen=True)
class Parts:
    """The three files, with the folder and the ending of their names."""

    folder: Path
    suffix: str
    cameras: dict[int, CameraPart]
    images: dict[int, ImagePart]
    points: PointParts

    def path(self, name: str) -> Path:
        """Path of ``cameras``, ``images`` or ``points3D``."""
        return self.folder / f"{name}{self.suffix}"


def require_small(path: Path, place: FilePlace, values: Sequence[float], names: Sequence[str]) -> None:
    """Refuse numbers that are not finite, or so large that they leave no digits for others."""
    for name, value in zip(names, values, strict=True):
        if not abs(value) < FARTHEST:
            raise place.error(path, f"{name} is {value:g}; expected a number of size less than {FARTHEST:g}")


def number_again(name: str, key: int, first: int | None = None) -> str:
    """What is said of a number that an earlier record has; ``first`` is that record's line, in a text."""
    where = "" if first is None else f"line {first} has it already, "
    return f"{name} {key} again; {where}expected another"
