"""What is written of a camera, an image and a point, in either form of COLMAP's model."""

from __future__ import annotations

from typing import NamedTuple

from vslam_ref.arrays import Array, IntArray


class CameraRow(NamedTuple):
    """CAMERA_ID, model, width and height, parameters in the model's order."""

    number: int
    model: str
    size: tuple[int, int]
    params: list[float]


class ImageRow(NamedTuple):
    """IMAGE_ID, pose (7 numbers), CAMERA_ID, name; pixels (F, 2) and POINT3D_ID (F,) of its features."""

    number: int
    pose: list[float]
    camera: int
    name: str
    uv: Array
    point: IntArray


class PointRow(NamedTuple):
    """POINT3D_ID, X Y Z, R G B, ERROR, and the track (n, 2): IMAGE_ID and number of the feature."""

    number: int
    X: list[float]
    colour: list[int]
    error: float
    track: IntArray
