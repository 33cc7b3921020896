"""A camera file of any kind that this library reads, told by its content.

Beside the kinds of :mod:`vslam_ref.datasets.calibration_files` there are two short ones::

    fx fy cx cy width height        plain ``calib.txt``: pixels, no lens; the size may be left out
    P0: fx 0 cx 0 0 fy cy 0 0 0 1 0     KITTI's ``calib.txt``: one line a camera, rectified, 3 x 4
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from vslam_ref.datasets.calibration_files import CameraFile, read_camera_info, read_ptam, read_tum_mono
from vslam_ref.datasets.calibration_files.camera_info import from_message
from vslam_ref.datasets.calibration_files.camodocal import from_camodocal
from vslam_ref.datasets.calibration_files.euroc import from_sensor
from vslam_ref.datasets.calibration_files.kalibr import from_chain
from vslam_ref.datasets.calibration_files.kitti_raw import read_kitti_raw
from vslam_ref.datasets.calibration_files.opencv_storage import from_entries
from vslam_ref.datasets.calibration_files.orbslam import from_settings
from vslam_ref.datasets.calibration_files.ost import read_ost
from vslam_ref.datasets.calibration_files.ptam import VARIABLE
from vslam_ref.datasets.storage_nodes import GZIP, parse_storage, storage_bytes
from vslam_ref.datasets.text import FormatError, decoded, number, numbers, read_bytes, read_lines
from vslam_ref.datasets.yaml_nodes import Node
from vslam_ref.geometry.cameras import Pinhole

PLAIN = ("fx", "fy", "cx", "cy", "width", "height")
KINDS = (
    "calib.txt (fx fy cx cy width height), KITTI's calib.txt and calib_cam_to_cam.txt, OpenCV (YAML, XML, "
    "JSON), ROS camera_info and ost.txt, ORB-SLAM's settings, Kalibr, EuRoC, camodocal, PTAM's camera.cfg, "
    "TUM monoVO's camera.txt"
)
MESSAGE = {"k", "d", "distortion_model"}
"""Entries of a ROS message, in small letters."""
KITTI, KITTI_RAW = "P0", "K_00"
MAX_BYTES = 2**20
LONGEST_SIDE = 2**20


def read_camera(path: Path, size: tuple[int, int]) -> CameraFile:
    """Read the camera that took pictures of a size, from a file of any kind.

    Of several cameras the first is taken; of TUM monoVO's two the one that recorded.

    Parameters
    ----------
    path : Path
    size : (int, int)
        Width and height of the pictures, pixels.

    Raises
    ------
    FormatError
        If the file is of no known kind, malformed, or for pictures of another size.
    """
    found = _by_content(path, size)
    width, height = size
    here = f"the pictures have {width}x{height}"
    if found.size is not None and found.size != size:
        given = f"for pictures of {found.size[0]}x{found.size[1]} pixels"
        raise FormatError(path, None, f"the camera is {given}; {here}: give the camera of this resolution")
    camera = found.camera
    if not (-0.5 <= camera.cx < width - 0.5 and -0.5 <= camera.cy < height - 0.5):
        what = f"the camera's centre ({camera.cx:g}, {camera.cy:g}) lies outside of the picture"
        raise FormatError(path, None, f"{what}; {here}: give the camera of this resolution")
    return found


def _by_content(path: Path, size: tuple[int, int]) -> CameraFile:
    begin = _begin(path)
    if re.search(rb"^\[image\]\s*$", begin, re.MULTILINE):
        return read_ost(path)
    if begin.startswith((b"<", b"{", b"[")):
        return _parsed(parse_storage(path, storage_bytes(path)))
    keys = set(re.findall(r"^([A-Za-z_][\w.]*)[ \t]*:", begin.decode("utf-8", "replace"), re.MULTILINE))
    if MESSAGE.issubset(key.lower() for key in keys):
        return read_camera_info(path)
    lines = list(_lines(path))
    if any(text.startswith(VARIABLE) for _, text in lines):
        return read_ptam(path, size)
    if KITTI_RAW in keys:
        return read_kitti_raw(path, size)
    if KITTI in keys:
        return read_kitti_camera(path)
    if keys:
        return _parsed(parse_storage(path, storage_bytes(path)))
    if len(lines) == 1 and len(lines[0][1].split()) in (4, 6):
        return read_plain_camera(path)
    if len(lines) == 4:
        return read_tum_mono(path).recorded
    line = lines[0][0] if lines else None
    raise FormatError(path, line, f"no camera file that is known here; expected one of {KINDS}")


def _parsed(top: Node) -> CameraFile:
    """The camera of a file of entries, whose names tell the kind."""
    keys = top.items()
    if MESSAGE.issubset(key.lower() for key in keys):
        return from_message(top)
    if "Camera" in keys or any(key.startswith(("Camera.", "Camera1.")) for key in keys):
        return from_settings(top)
    if any(re.fullmatch(r"cam\d", key) for key in keys):
        chain = from_chain(top)
        told = (f"{top.path}: cam0 of {len(chain)} cameras is read",) if len(chain) > 1 else ()
        return replace(chain[0], notes=(*told, *chain[0].notes))
    if "model_type" in keys and "projection_parameters" in keys:
        return from_camodocal(top)
    if "sensor_type" in keys or "T_BS" in keys:
        return from_sensor(top)
    return from_entries(top)


def _begin(path: Path) -> bytes:
    """The file's first bytes, unpacked if it is packed, without a byte order mark and blanks before."""
    data = read_bytes(path, MAX_BYTES, whole=False)
    data = storage_bytes(path) if data.startswith(GZIP) else data
    return data.removeprefix(b"\xef\xbb\xbf").lstrip()


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines that say something."""
    for number_, text in enumerate(decoded(path, storage_bytes(path)).splitlines(), 1):
        stripped = text.strip()
        if stripped and not stripped.startswith("#"):
            yield number_, stripped


def read_plain_camera(path: Path) -> CameraFile:
    """Read ``fx fy cx cy width height``, pixels; the last two may be left out.

    Raises
    ------
    FormatError
        If the file is not one such line, comments aside.
    """
    lines = list(read_lines(path, MAX_BYTES))
    if len(lines) != 1:
        line = lines[1][0] if lines else None
        raise FormatError(path, line, f"{len(lines)} lines; expected one: {' '.join(PLAIN)}")
    line, words = lines[0][0], lines[0][1].split()
    names = PLAIN[:4] if len(words) == 4 else PLAIN
    values = numbers(path, line, words, names)
    try:
        camera = Pinhole(*values[:4])
    except ValueError as error:
        raise FormatError(path, line, str(error)) from None
    if len(values) == 4:
        return CameraFile(camera)
    sides = values[4:]
    if not all(v.is_integer() and 1 <= v <= LONGEST_SIDE for v in sides):
        what = f"size is {' '.join(words[4:])}; expected width and height, whole numbers"
        raise FormatError(path, line, what)
    return CameraFile(camera, (int(sides[0]), int(sides[1])))


def read_kitti_camera(path: Path) -> CameraFile:
    """Read KITTI's ``calib.txt``: twelve numbers of a rectified projection, the same for all four cameras.

    Only the last column differs, which says where a camera stands beside the first; line P0 is read.

    Raises
    ------
    FormatError
        If there is no such line, or it is no projection of a camera without skew.
    """
    name = KITTI
    for line, text in read_lines(path, MAX_BYTES):
        key, _, rest = text.partition(":")
        if key.strip() != name:
            continue
        words = rest.split()
        if len(words) != 12:
            raise FormatError(path, line, f"{name} has {len(words)} numbers; expected 12, a 3 x 4 matrix")
        P = np.array([number(path, line, word, name) for word in words]).reshape(3, 4)[:, :3]
        wanted = np.array([[P[0, 0], 0, P[0, 2]], [0, P[1, 1], P[1, 2]], [0, 0, 1.0]])
        if not np.array_equal(P, wanted):
            raise FormatError(path, line, f"{name} is not fx 0 cx · 0 fy cy · 0 0 1 ·; expected that")
        try:
            return CameraFile(Pinhole(*P[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()), None, None, name)
        except ValueError as error:
            raise FormatError(path, line, f"{name}: {error}") from None
    raise FormatError(path, None, f"no line {name}:; expected KITTI's calibration")


def write_plain_camera(path: Path, camera: Pinhole, size: tuple[int, int]) -> None:
    """Write ``fx fy cx cy width height`` so that :func:`read_plain_camera` reads the same doubles."""
    from vslam_ref.support.files import write_text

    values = " ".join(repr(float(v)) for v in camera.params)
    write_text(path, f"# {' '.join(PLAIN)}\n{values} {size[0]} {size[1]}\n")
