"""KITTI's ``calib_cam_to_cam.txt`` of the raw recordings: four cameras, before and after rectification.

::

    S_00: 1392 512                    size of the pictures as they were taken
    K_00: fx 0 cx 0 fy cy 0 0 1       their camera
    D_00: k1 k2 p1 p2 k3
    S_rect_00: 1242 375               size of the rectified ones, which most people have
    P_rect_00: fx 0 cx 0 0 fy cy 0 0 0 1 0     their camera, without a lens; 3 x 4

The pictures' size tells which of the two is meant.  Pixel (0, 0) is the centre of the top-left pixel.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.text import FormatError, number, read_lines
from vslam_ref.geometry.cameras import Pinhole, Radtan

MAX_BYTES = 2**20
COUNTS = {"S": 2, "K": 9, "D": 5, "S_rect": 2, "P_rect": 12}


def read_kitti_raw(path: Path | str, size: tuple[int, int], camera: int = 0) -> CameraFile:
    """Read one of the cameras: the rectified one where the pictures have its size, else the one that was.

    Parameters
    ----------
    path : Path or str
    size : (int, int)
        Width and height of the pictures, pixels.
    camera : int
        Its number, 0 and 1 grey, 2 and 3 colour.

    Raises
    ------
    FormatError
        Where a line is missing, stands twice, or has not its numbers.
    """
    path = Path(path)
    found = _entries(path, f"{camera:02d}")
    cameras = len({key for key in _keys(path) if key.startswith("S_") and not key.startswith("S_rect")})
    told = (f"{path}: camera {camera:02d} of {cameras} is read",) if cameras > 1 else ()
    rectified = _size(path, found, "S_rect")
    if size == rectified:
        line, P = found["P_rect"]
        return CameraFile(_pinhole(path, line, P.reshape(3, 4)[:, :3]), rectified, notes=told)
    line, K = found["K"]
    plain = _pinhole(path, line, K.reshape(3, 3))
    return CameraFile(Radtan(*plain.params, *found["D"][1].tolist()), _size(path, found, "S"), notes=told)


def _keys(path: Path) -> set[str]:
    return {text.partition(":")[0].strip() for _, text in read_lines(path, MAX_BYTES)}


def _entries(path: Path, which: str) -> dict[str, tuple[int, Array]]:
    """Line number and numbers of each entry of a camera."""
    wanted = {f"{key}_{which}": key for key in COUNTS}
    found: dict[str, tuple[int, Array]] = {}
    for line, text in read_lines(path, MAX_BYTES):
        name, _, rest = text.partition(":")
        key = wanted.get(name.strip())
        if key is None:
            continue
        if key in found:
            raise FormatError(path, line, f"{name} again; line {found[key][0]} has it already")
        words = rest.split()
        if len(words) != COUNTS[key]:
            raise FormatError(path, line, f"{name} has {len(words)} numbers; expected {COUNTS[key]}")
        found[key] = line, np.array([number(path, line, word, name) for word in words])
    for name, key in wanted.items():
        if key not in found:
            raise FormatError(path, None, f"no line {name}:; expected KITTI's raw calibration")
    return found


def _size(path: Path, found: dict[str, tuple[int, Array]], key: str) -> tuple[int, int]:
    line, (width, height) = found[key]
    if not (width.is_integer() and height.is_integer() and min(width, height) >= 1):
        raise FormatError(path, line, f"{key} is {width:g} {height:g}; expected whole numbers of pixels")
    return int(width), int(height)


def _pinhole(path: Path, line: int, K: Array) -> Pinhole:
    fx, fy, cx, cy = K[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    if not np.array_equal(K, [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]):
        raise FormatError(path, line, "the matrix is not fx 0 cx, 0 fy cy, 0 0 1; expected that")
    try:
        return Pinhole(fx, fy, cx, cy)
    except ValueError as error:
        raise FormatError(path, line, str(error)) from None
