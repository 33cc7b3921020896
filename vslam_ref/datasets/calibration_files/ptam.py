"""PTAM's ``camera.cfg``: one variable, ``Camera.Parameters=[ fx fy cx cy omega ]``.

The first four are relative to the image's width and height, so that one file serves every resolution; which
one was used must be known from elsewhere.  PTAM subtracts half a pixel from the centre, because its pixel
(0, 0) is a pixel's centre and its relative 0 the image's outer edge; so do we.  A reader that leaves the half
out moves every ray by half a pixel, whatever the resolution.
"""

from __future__ import annotations

import re
from pathlib import Path

from vslam_ref.datasets.calibration_files.record import CameraFile, relative_sensor
from vslam_ref.datasets.text import FormatError, numbers, read_lines
from vslam_ref.geometry.cameras import Fov

VARIABLE = "Camera.Parameters"
RIGHT = f"expected {VARIABLE}=[ fx fy cx cy omega ]"


def read_ptam(path: Path | str, size: tuple[int, int]) -> CameraFile:
    """Read the camera; other variables of the file are passed over.

    Parameters
    ----------
    path : Path or str
        The file.
    size : (int, int)
        Width and height of the images, pixels.

    Raises
    ------
    FormatError
        Where the variable is missing, stands twice, or is not five numbers that make a camera.
    ValueError
        On a size below one pixel.
    """
    path = Path(path)
    if min(size) < 1:
        raise ValueError(f"size={size}: need (width, height), both at least 1")
    found: tuple[int, str] | None = None
    for line, text in read_lines(path):
        match = re.match(rf"{re.escape(VARIABLE)}\s*=\s*(.*)$", text.split("//")[0].strip())
        if match:
            if found is not None:
                raise FormatError(path, line, f"{VARIABLE} again; line {found[0]} has it already")
            found = line, match[1].strip().rstrip(";").strip()
    if found is None:
        raise FormatError(path, None, f"no {VARIABLE}; {RIGHT}")
    line, value = found
    if not (value.startswith("[") and value.endswith("]")):
        raise FormatError(path, line, f"{VARIABLE} is {value!r}; {RIGHT}")
    words = value[1:-1].split()
    if len(words) != 5:
        raise FormatError(path, line, f"{VARIABLE} has {len(words)} numbers; {RIGHT}")
    *sensor, omega = numbers(path, line, words, ("fx", "fy", "cx", "cy", "omega"))
    try:
        camera = Fov.from_params([*relative_sensor(sensor, size), abs(omega)])
    except ValueError as error:
        raise FormatError(path, line, str(error)) from None
    return CameraFile(camera, size)
