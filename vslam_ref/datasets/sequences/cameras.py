"""A camera file of any kind that this library reads, told by its content.

Beside the kinds of :mod:`vslam_ref.datasets.calibration_files` there are two short ones::

    fx fy cx cy width height        plain ``calib.txt``: pixels, no lens; the size may be left out
    P0: fx 0 cx 0 0 fy cy 0 0 0 1 0     KITTI's ``calib.txt``: one line a camera, rectified, 3 x 4
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vslam_ref.datasets.calibration_files import (
    CameraFile,
    read_euroc,
    read_kalibr,
    read_opencv,
    read_ptam,
    read_tum_mono,
)
from vslam_ref.datasets.calibration_files.ptam import VARIABLE
from vslam_ref.datasets.text import FormatError, number, numbers, read_lines
from vslam_ref.geometry.cameras import Pinhole

PLAIN = ("fx", "fy", "cx", "cy", "width", "height")
KINDS = (
    "calib.txt (fx fy cx cy width height), KITTI's calib.txt, OpenCV, Kalibr, EuRoC, PTAM's camera.cfg, "
    "TUM monoVO's camera.txt"
)
KITTI = "P0"
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
    lines = list(read_lines(path, MAX_BYTES))
    if any(text.startswith(VARIABLE) for _, text in lines):
        return read_ptam(path, size)
    keys = {match[1] for _, text in lines if (match := re.match(r"([A-Za-z_]\w*)\s*:", text))}
    if KITTI in keys:
        return read_kitti_camera(path)
    if "cam0" in keys:
        return read_kalibr(path)[0]
    if "sensor_type" in keys:
        return read_euroc(path)
    if keys:
        return read_opencv(path)
    if len(lines) == 1 and len(lines[0][1].split()) in (4, 6):
        return read_plain_camera(path)
    if len(lines) == 4:
        return read_tum_mono(path).recorded
    line = lines[0][0] if lines else None
    raise FormatError(path, line, f"no camera file that is known here; expected one of {KINDS}")


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
