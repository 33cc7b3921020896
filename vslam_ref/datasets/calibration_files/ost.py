"""``ost.txt``, which ROS' camera calibrator packs beside its YAML file.

::

    # oST version 5.0 parameters
    [image]
    width
    640
    height
    480
    [narrow_stereo]
    camera matrix
    fx 0 cx
    0 fy cy
    0 0 1
    distortion
    k1 k2 p1 p2 k3                eight numbers: rational

The file does not name its lens.  Four numbers may be those of plumb_bob or of equidistant, and are refused:
``ost.yaml``, beside it, says which.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.text import FormatError, number, read_lines
from vslam_ref.geometry.cameras import Camera, Radtan, Rational

MAX_BYTES = 2**16
LENSES: dict[int, type[Camera]] = {5: Radtan, 8: Rational}
HEADS = {"width": 1, "height": 1, "camera matrix": 3, "distortion": 1}
"""Names of the parts that are read, and how many lines of numbers follow."""


def read_ost(path: Path | str) -> CameraFile:
    """Read the camera; other parts of the file are passed over.

    Raises
    ------
    FormatError
        Where a part is missing, stands twice, or has not its numbers.
    """
    path = Path(path)
    found = _parts(path)
    for name in HEADS:
        if name not in found:
            raise FormatError(path, None, f"no part {name!r}; expected ost.txt of ROS' camera calibrator")
    K = np.array(found["camera matrix"][1:], dtype=np.float64)
    line = int(found["camera matrix"][0])  # numbers and lines share a list of floats
    if K.size != 9:
        raise FormatError(path, line, f"camera matrix has {K.size} numbers; expected 9")
    fx, _, cx, _, fy, cy = K[:6].tolist()
    if not np.array_equal(K, [fx, 0, cx, 0, fy, cy, 0, 0, 1]):
        raise FormatError(path, line, "camera matrix is not fx 0 cx, 0 fy cy, 0 0 1; expected that")
    k = found["distortion"][1:]
    if len(k) not in LENSES:
        hint = "; ost.yaml beside it names the lens: give that" if len(k) == 4 else ""
        raise FormatError(
            path, int(found["distortion"][0]), f"distortion has {len(k)} numbers; expected 5 or 8{hint}"
        )
    sides = []
    for name in ("width", "height"):
        value = found[name][1:]
        if len(value) != 1 or not value[0].is_integer() or not 1 <= value[0] < 2**20:
            raise FormatError(
                path, int(found[name][0]), f"{name} is {value}; expected a whole number of pixels"
            )
        sides.append(int(value[0]))
    try:
        camera = LENSES[len(k)](fx, fy, cx, cy, *k)
    except ValueError as error:
        raise FormatError(path, int(found["camera matrix"][0]), str(error)) from None
    return CameraFile(camera, (sides[0], sides[1]))


def _parts(path: Path) -> dict[str, list[float]]:
    """Line number and numbers of each part."""
    found: dict[str, list[float]] = {}
    name, left = "", 0
    for line, text in read_lines(path, MAX_BYTES):
        if text.lower() in HEADS:
            name = text.lower()
            if name in found:
                raise FormatError(path, line, f"{name} again; line {found[name][0]:g} has it already")
            found[name], left = [line], HEADS[name]
        elif left:
            found[name] += [number(path, line, word, name) for word in text.split()]
            left -= 1
    return found
