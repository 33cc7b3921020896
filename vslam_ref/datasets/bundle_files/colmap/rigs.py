"""Rigs and frames, which COLMAP writes since version 3.12: where the poses of a model really stand.

::

    rigs      RIG_ID NUM_SENSORS  REF_SENSOR_TYPE REF_SENSOR_ID  (SENSOR_TYPE SENSOR_ID HAS_POSE [Q T])[]
    frames    FRAME_ID RIG_ID  Q T (world to rig)  NUM_DATA_IDS  (SENSOR_TYPE SENSOR_ID DATA_ID)[]

    T_cam_world = T_sensor_rig T_rig_world,    T_sensor_rig of the reference sensor is the identity

DATA_ID of a camera is an IMAGE_ID.  With these files COLMAP takes every pose from them and passes over those
in ``images``, which a program that knows no rigs may have left behind.  So does this reader where they
disagree, and says so.  A rig is not kept rigid here: every image moves by itself.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.bundle_files.colmap.binary import ByteReader
from vslam_ref.datasets.bundle_files.colmap.parts import POSE, FilePlace, Parts, require_small
from vslam_ref.datasets.bundle_files.colmap.text import records, small_numbers, text_lines, whole
from vslam_ref.datasets.bundle_files.loading import LARGEST, UNIT_TOLERANCE, counted
from vslam_ref.datasets.text import decoded, read_bytes
from vslam_ref.geometry import quaternion, se3, so3

NAMES = ("rigs", "frames")
SENSORS = {"INVALID": -1, "CAMERA": 0, "IMU": 1}
CAMERA = SENSORS["CAMERA"]
SAME = 1e-6
"""Radians, and share of the distance: what printing in twelve digits leaves is a thousand times less."""


class RigSensor(NamedTuple):
    """A sensor: its kind and number."""

    kind: int
    number: int


class RigPart(NamedTuple):
    """Reference sensor, and for the others T_sensor_rig, or None where it is not known."""

    reference: RigSensor | None
    poses: dict[RigSensor, Array | None]


class FramePart(NamedTuple):
    """A moment of a rig: T_rig_world, and the images taken then by their sensors."""

    place: FilePlace
    rig: int
    T_rig_world: Array
    images: list[tuple[RigSensor, int]]


class _Fields(Protocol):
    """One record, field after field."""

    place: FilePlace

    def whole(self, kind: str, name: str) -> int: ...
    def sensor(self, name: str) -> RigSensor: ...
    def pose(self) -> list[float]: ...


def frame_poses(parts: Parts) -> tuple[dict[int, Array] | None, tuple[str, ...]]:
    """Poses of images by rigs and frames, and what is to be told: IMAGE_ID -> T_cam_world (4, 4).

    None without frames.

    Raises
    ------
    FormatError
        Where one of the files is not as the module says.
    """
    rigs_path, frames_path = (parts.path(name) for name in NAMES)
    there = [path.name for path in (rigs_path, frames_path) if path.exists()]
    if not frames_path.exists():
        return None, tuple(f"{name} without {frames_path.name} is not used" for name in there)
    rigs = dict(_rigs(rigs_path)) if rigs_path.exists() else None
    frames = list(_frames(frames_path, rigs))
    found: dict[int, Array] = {}
    for frame in frames:
        for sensor, image in frame.images:
            T_sensor_rig = _in_rig(frame, sensor, rigs)
            if T_sensor_rig is not None:
                found[image] = T_sensor_rig @ frame.T_rig_world
    tied = max((1 + len(rig.poses) for rig in (rigs or {}).values()), default=1)
    most = max((len(frame.images) for frame in frames), default=1)
    return found, (_told(there, max(tied, most)),)


def _in_rig(frame: FramePart, sensor: RigSensor, rigs: dict[int, RigPart] | None) -> Array | None:
    """T_sensor_rig, or None where it is not known.  Without rigs, the only camera of a frame is its rig."""
    if rigs is None:
        return np.eye(4) if len(frame.images) == 1 else None
    rig = rigs[frame.rig]
    return np.eye(4) if sensor == rig.reference else rig.poses.get(sensor)


def _told(names: list[str], tied: int) -> str:
    both = " and ".join(names)
    if tied > 1:
        each = "here every image moves by itself, and nothing of them is written again"
        tie = "tie" if len(names) > 1 else "ties"
        return f"{both} {tie} up to {tied} sensors together: {each}"
    return f"{both}: every image has a frame of its own; nothing of them is needed or written again"


def chosen_poses(
    parts: Parts, own: Array, by_frame: dict[int, Array] | None
) -> tuple[Array, tuple[str, ...]]:
    """Poses (V, 4, 4): an image's own, or that of its frame where the two disagree; and what is told.

    Parameters
    ----------
    parts : Parts
    own : ndarray, shape (V, 4, 4)
        Of the images, as their file has them.
    by_frame : dict of int to ndarray, or None
        From :func:`frame_poses`.
    """
    if by_frame is None:
        return own, ()
    T, moved, lost = own.copy(), [], 0
    for k, key in enumerate(parts.images):
        if key not in by_frame:
            lost += 1
            continue
        angle = float(np.linalg.norm(so3.log(own[k, :3, :3] @ by_frame[key][:3, :3].T)))
        distance = float(np.linalg.norm(own[k, :3, 3] - by_frame[key][:3, 3]))
        if angle > SAME or distance > SAME * (1.0 + float(np.linalg.norm(by_frame[key][:3, 3]))):
            T[k] = by_frame[key]
            moved.append((angle, distance))
    frames, images = (parts.path(name).name for name in ("frames", "images"))
    told = []
    if moved:
        turn, shift = np.max(moved, axis=0)
        degrees, length = round(float(np.rad2deg(turn)), 4), round(float(shift), 6)
        by = f"up to {degrees:g} degrees and {length:g} in translation"
        told.append(
            f"{len(moved)} of {len(own)} poses in {images} differ from those of {frames}, by {by}: "
            f"those of {frames} are taken, as COLMAP does"
        )
    if lost:
        told.append(f"{frames} has no pose for {counted(lost, 'image')}: taken from {images}")
    return T, tuple(told)


# --- both forms --------------------------------------------------------------------------------------


def _rigs(path: Path) -> Iterator[tuple[int, RigPart]]:
    for fields in _each(path, "RIG_ID NUM_SENSORS and its sensors", 8):
        key, sensors = fields.whole("I", "RIG_ID"), fields.whole("I", "NUM_SENSORS")
        reference = fields.sensor("REF_SENSOR") if sensors else None
        poses: dict[RigSensor, Array | None] = {}
        for _ in range(sensors - 1):
            sensor = fields.sensor("SENSOR")
            has_pose = fields.whole("B", "HAS_POSE")
            poses[sensor] = _motion(path, fields) if has_pose else None
        yield key, RigPart(reference, poses)


def _frames(path: Path, rigs: dict[int, RigPart] | None) -> Iterator[FramePart]:
    for fields in _each(path, "FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS and its data", 68):
        fields.whole("I", "FRAME_ID")
        rig = fields.whole("I", "RIG_ID")
        if rigs is not None and rig not in rigs:
            raise fields.place.error(path, f"RIG_ID is {rig}; expected one of {NAMES[0]}{path.suffix}")
        T_rig_world = _motion(path, fields)
        data = []
        for _ in range(fields.whole("I", "NUM_DATA_IDS")):
            data.append((fields.sensor("SENSOR"), fields.whole("Q", "DATA_ID")))
        images = [(sensor, image) for sensor, image in data if sensor.kind == CAMERA]
        yield FramePart(fields.place, rig, T_rig_world, images)


def _motion(path: Path, fields: _Fields) -> Array:
    values = fields.pose()
    length = float(np.linalg.norm(values[:4]))
    if not abs(length - 1.0) <= UNIT_TOLERANCE:
        what = f"quaternion of length {length:.6g}; expected 1 within {UNIT_TOLERANCE:g}"
        raise fields.place.error(path, what)
    return np.asarray(se3.from_rt(quaternion.matrix(quaternion.normalise(values[:4])), values[4:]))


def _each(path: Path, right: str, least: int) -> Iterator[_Fields]:
    """Records of a file; each must be used up before the next one is asked for."""
    data = read_bytes(path, LARGEST)
    if path.suffix == ".txt":
        for line, _, words in records(path, text_lines(decoded(path, data)), right, lambda n: n >= 2):
            text = _WordFields(path, FilePlace(line), words)
            yield text
            text.finish(right)
    else:
        reader, name = ByteReader(path, data), path.stem
        total = reader.count(least, name)
        for k in range(total):
            yield _ByteFields(reader, FilePlace(None, f"{name[:-1]} {k + 1} of {total}"))
        reader.finish(f"the last of {total} {name}")


@dataclass
class _WordFields:
    """A line of a text."""

    path: Path
    place: FilePlace
    words: list[str]
    at: int = 0

    def whole(self, kind: str, name: str) -> int:
        return whole(self.path, self.place.line or 0, self._take(name, 1)[0], name)

    def sensor(self, name: str) -> RigSensor:
        kind = self._take(f"{name}_TYPE", 1)[0]
        if kind not in SENSORS:
            what = f"{name}_TYPE is {kind[:40]!r}; expected one of {', '.join(SENSORS)}"
            raise self.place.error(self.path, what)
        return RigSensor(SENSORS[kind], self.whole("I", f"{name}_ID"))

    def pose(self) -> list[float]:
        words = self._take("a pose", len(POSE))
        return small_numbers(self.path, self.place.line or 0, words, POSE.__getitem__)

    def finish(self, right: str) -> None:
        if self.at < len(self.words):
            more = len(self.words) - self.at
            raise self.place.error(self.path, f"{more} words too many; expected {right}")

    def _take(self, name: str, count: int) -> list[str]:
        found = self.words[self.at : self.at + count]
        if len(found) < count:
            raise self.place.error(self.path, f"the line ends where {name} is expected")
        self.at += count
        return found


@dataclass
class _ByteFields:
    """A record of a binary file."""

    reader: ByteReader
    place: FilePlace

    def whole(self, kind: str, name: str) -> int:
        return int(self.reader.take(struct.Struct(f"<{kind}"), f"{name} of {self.place.called}")[0])

    def sensor(self, name: str) -> RigSensor:
        return RigSensor(*self.reader.take(struct.Struct("<iI"), f"{name} of {self.place.called}"))

    def pose(self) -> list[float]:
        values = list(self.reader.take(struct.Struct("<7d"), f"the pose of {self.place.called}"))
        require_small(self.reader.path, self.place, values, POSE)
        return values
