"""COLMAP's binary form, packed."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

from vslam_ref.datasets.bundle_files.colmap.binary import CAMERA, COUNT, FEATURE, FILES, IMAGE, POINT, TRACK
from vslam_ref.datasets.bundle_files.colmap.models import BY_NUMBER
from vslam_ref.datasets.bundle_files.colmap.rows import CameraRow, ImageRow, PointRow


def packed(
    cameras: Sequence[CameraRow], images: Sequence[ImageRow], points: Sequence[PointRow]
) -> dict[str, bytes]:
    """Content of the three files."""
    parts = (map(_camera, cameras), map(_image, images), map(_point, points))
    counts = map(len, (cameras, images, points))
    return {
        name: b"".join([COUNT.pack(count), *records])
        for name, count, records in zip(FILES, counts, parts, strict=True)
    }


def _camera(row: CameraRow) -> bytes:
    head = CAMERA.pack(row.number, BY_NUMBER.index(row.model), *row.size)
    return head + struct.pack(f"<{len(row.params)}d", *row.params)


def _image(row: ImageRow) -> bytes:
    features = np.zeros(len(row.point), FEATURE)
    features["uv"], features["point"] = row.uv, row.point
    name = row.name.encode("utf-8", "surrogateescape") + b"\0"
    head = IMAGE.pack(row.number, *row.pose, row.camera)
    return head + name + COUNT.pack(len(features)) + features.tobytes()


def _point(row: PointRow) -> bytes:
    head = POINT.pack(row.number, *row.X, *row.colour, row.error, len(row.track))
    return head + row.track.astype(TRACK).tobytes()
