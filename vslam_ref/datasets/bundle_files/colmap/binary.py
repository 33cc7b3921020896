"""COLMAP's binary form, which its programs write unless told otherwise: bytes into parts.

Little-endian, nothing between the fields::

    cameras.bin    u64 count;  u32 CAMERA_ID, i32 MODEL_ID, u64 WIDTH, u64 HEIGHT, f64 PARAMS[]
    images.bin     u64 count;  u32 IMAGE_ID, f64 Q[4], f64 T[3], u32 CAMERA_ID, NAME with a zero byte behind,
                               u64 features, (f64 X, f64 Y, u64 POINT3D_ID)[]
    points3D.bin   u64 count;  u64 POINT3D_ID, f64 X[3], u8 RGB[3], f64 ERROR, u64 length,
                               (u32 IMAGE_ID, u32 POINT2D_IDX)[]

Every count is compared with the bytes that are left before anything of its size is made.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.datasets.bundle_files.colmap.models import BY_NUMBER, MODELS, count_of_params
from vslam_ref.datasets.bundle_files.colmap.parts import (
    NO_POINT,
    POSE,
    CameraPart,
    FilePlace,
    ImagePart,
    Parts,
    PointParts,
    number_again,
    require_small,
)
from vslam_ref.datasets.bundle_files.loading import FARTHEST, counted, load
from vslam_ref.datasets.text import FormatError

FILES = ("cameras.bin", "images.bin", "points3D.bin")
FEATURE = np.dtype([("uv", "<f8", 2), ("point", "<u8")])
TRACK = np.dtype("<u4")
CAMERA, IMAGE, POINT = struct.Struct("<IiQQ"), struct.Struct("<I7dI"), struct.Struct("<Q3d3BdQ")
COUNT = struct.Struct("<Q")
NONE = 2**64 - 1
LARGEST_ID = 2**63


@dataclass
class ByteReader:
    """A binary file that is read from its beginning on.

    Parameters
    ----------
    path : Path
    data : bytes
    at : int
        Where the next field begins.
    """

    path: Path
    data: bytes
    at: int = 0

    def take(self, kind: struct.Struct, what: str) -> tuple[Any, ...]:
        """Read the fields of ``what``."""
        self._require(kind.size, what)
        fields = kind.unpack_from(self.data, self.at)
        self.at += kind.size
        return fields

    def rows(self, kind: np.dtype[Any], count: int, what: str) -> NDArray[Any]:
        """Read rows of a table, which share the file's memory."""
        self._require(kind.itemsize * count, what)
        found = np.frombuffer(self.data, kind, count, self.at)
        self.at += kind.itemsize * count
        return found

    def count(self, least: int, what: str) -> int:
        """Read how many of ``what`` follow, each at least so many bytes long."""
        (number,) = self.take(COUNT, f"the number of {what}")
        left = len(self.data) - self.at
        if number * least > left:
            wrong = f"{number} {what} need at least {number * least} bytes; {left} are left"
            raise FormatError(self.path, None, f"{wrong}: truncated, or a wrong count")
        return int(number)

    def name(self, what: str) -> str:
        """Read a text up to its zero byte; bytes that are no UTF-8 are kept as they are."""
        end = self.data.find(b"\0", self.at)
        if end < 0:
            raise self._ended(what)
        text = self.data[self.at : end].decode("utf-8", "surrogateescape")
        self.at = end + 1
        return text

    def finish(self, what: str) -> None:
        """Refuse bytes behind the last field."""
        left = len(self.data) - self.at
        if left:
            raise FormatError(
                self.path, None, f"{counted(left, 'byte')} more behind {what}; expected the end of the file"
            )

    def _require(self, size: int, what: str) -> None:
        if size > len(self.data) - self.at:
            raise self._ended(what)

    def _ended(self, what: str) -> FormatError:
        return FormatError(
            self.path,
            None,
            f"the file ends after {len(self.data)} bytes, inside {what}: truncated, or corrupt",
        )


def binary_parts(folder: Path, max_bytes: int | None = None) -> Parts:
    """Read ``cameras.bin``, ``images.bin`` and ``points3D.bin``.

    Parameters
    ----------
    folder : Path
    max_bytes : int, optional
        Limit of each file's size; see :func:`.loading.load`.

    Raises
    ------
    FormatError
        Where a file is not as the module says.
    """
    readers = [ByteReader(folder / name, load(folder / name, max_bytes)) for name in FILES]
    cameras = _cameras(readers[0])
    return Parts(folder, ".bin", cameras, _images(readers[1], cameras), _points(readers[2]))


def require_new(path: Path, place: FilePlace, name: str, key: int, found: dict[int, Any]) -> None:
    """Refuse a number that an earlier record has."""
    if key in found:
        raise place.error(path, number_again(name, key))


def _cameras(file: ByteReader) -> dict[int, CameraPart]:
    found: dict[int, CameraPart] = {}
    total = file.count(CAMERA.size, "cameras")
    for k in range(total):
        key, number, *size = file.take(CAMERA, f"camera {k + 1} of {total}")
        place = FilePlace(None, f"camera {k + 1} of {total} (CAMERA_ID {key})")
        require_new(file.path, place, "CAMERA_ID", key, found)
        if not 0 <= number < len(BY_NUMBER):
            right = f"expected 0 to {len(BY_NUMBER) - 1} ({BY_NUMBER[0]} to {BY_NUMBER[-1]})"
            raise place.error(file.path, f"MODEL_ID is {number}; {right}")
        for name, value in zip(("WIDTH", "HEIGHT"), size, strict=True):
            if value >= 2**31:
                raise place.error(file.path, f"{name} is {value}; expected less than 2^31")
        model = BY_NUMBER[number]
        params = file.rows(
            np.dtype("<f8"), count_of_params(model), f"the parameters of {place.called}"
        ).tolist()
        if model in MODELS:
            require_small(file.path, place, params, MODELS[model].parameters)
        found[key] = CameraPart(place, model, (size[0], size[1]), params)
    file.finish(f"the last of {total} cameras")
    return found


def _images(file: ByteReader, cameras: dict[int, CameraPart]) -> dict[int, ImagePart]:
    found: dict[int, ImagePart] = {}
    total = file.count(IMAGE.size + 1 + COUNT.size, "images")
    for k in range(total):
        key, *pose, camera = file.take(IMAGE, f"image {k + 1} of {total}")
        place = FilePlace(None, f"image {k + 1} of {total} (IMAGE_ID {key})")
        require_new(file.path, place, "IMAGE_ID", key, found)
        require_small(file.path, place, pose, POSE)
        if camera not in cameras:
            raise place.error(file.path, f"CAMERA_ID is {camera}; expected one of {FILES[0]}")
        name = file.name(f"the name of {place.called}")
        features = file.count(FEATURE.itemsize, f"features of {place.called}")
        table = file.rows(FEATURE, features, f"the features of {place.called}")
        uv, point = np.ascontiguousarray(table["uv"], dtype=np.float64), table["point"]
        _require_features(file.path, place, uv, point)
        ids = np.where(point == NONE, np.uint64(0), point).astype(np.int64)
        ids[point == NONE] = NO_POINT
        found[key] = ImagePart(place, pose, camera, name, uv, ids)
    file.finish(f"the last of {total} images")
    return found


def _require_features(path: Path, place: FilePlace, uv: Array, point: NDArray[Any]) -> None:
    bad = np.argwhere(~(np.abs(uv) < FARTHEST))
    if len(bad):
        k, axis = bad[0].tolist()
        right = f"expected a number of size less than {FARTHEST:g}"
        raise place.error(path, f"{'XY'[axis]} of feature {k} is {uv[k, axis]:g}; {right}")
    large = np.flatnonzero((point >= LARGEST_ID) & (point != NONE))
    if len(large):
        k = int(large[0])
        raise place.error(path, f"POINT3D_ID of feature {k} is {point[k]}; expected less than 2^63")


def _points(file: ByteReader) -> PointParts:
    total = file.count(POINT.size, "points")
    found: dict[int, None] = {}
    rows: list[tuple[Any, ...]] = []
    tracks: list[NDArray[Any]] = []
    for k in range(total):
        key, *values, _, length = file.take(POINT, f"point {k + 1} of {total}")
        place = _place_of_point(k, total, key)
        require_new(file.path, place, "POINT3D_ID", key, found)
        if key >= LARGEST_ID:
            raise place.error(file.path, f"POINT3D_ID is {key}; expected less than 2^63")
        require_small(file.path, place, values[:3], ("X", "Y", "Z"))
        found[key] = None
        left = len(file.data) - file.at
        if 2 * TRACK.itemsize * length > left:
            what = (
                f"a track of {length} needs {2 * TRACK.itemsize * length} bytes; {left} are left: truncated"
            )
            raise place.error(file.path, what)
        tracks.append(file.rows(TRACK, 2 * length, f"the track of {place.called}"))
        rows.append(tuple(values))
    file.finish(f"the last of {total} points")
    ids = np.array(list(found), dtype=np.int64)
    table = np.array(rows, dtype=np.float64).reshape(-1, 6)
    track = np.concatenate([*tracks, np.zeros(0, TRACK)]).astype(np.int64).reshape(-1, 2)
    return PointParts(
        lambda k: _place_of_point(k, total, int(ids[k])),
        ids,
        table[:, :3],
        table[:, 3:].astype(np.uint8),
        np.repeat(np.arange(total), [len(one) // 2 for one in tracks]),
        track,
    )


def _place_of_point(k: int, total: int, key: int) -> FilePlace:
    return FilePlace(None, f"point {k + 1} of {total} (POINT3D_ID {key})")
