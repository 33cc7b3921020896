"""TUM monoVO's ``camera.txt``, as DSO reads it: four lines.

::

    fx fy cx cy omega          relative to the image's size if cx and cy are below 1, else pixels; FOV lens
    width height               of the recorded images
    crop | full | none | fx fy cx cy 0      the pinhole camera that the images are rectified to
    width height               of the rectified images

The first line may begin with a word that names the lens::

    FOV fx fy cx cy omega
    Pinhole fx fy cx cy                     a fifth number must be 0
    RadTan fx fy cx cy k1 k2 p1 p2          eight numbers without a word mean this one
    EquiDistant fx fy cx cy k1 k2 k3 k4     or KannalaBrandt

Relative centres are counted from the image's outer edge, so half a pixel is subtracted; absolute ones are
taken as they are, whole numbers at centres of pixels.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from vslam_ref.datasets.calibration_files.record import CameraFile, relative_sensor
from vslam_ref.datasets.text import FormatError, number, read_lines
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan

LENSES: dict[str, tuple[type[Camera], tuple[str, ...]]] = {
    "fov": (Fov, ("omega",)),
    "pinhole": (Pinhole, ("omega",)),
    "radtan": (Radtan, ("k1", "k2", "p1", "p2")),
    "equidistant": (Fisheye, ("k1", "k2", "k3", "k4")),
    "kannalabrandt": (Fisheye, ("k1", "k2", "k3", "k4")),
}
SENSOR = ("fx", "fy", "cx", "cy")
WORDS = ("crop", "full", "none")
LINES = "camera, size, crop | full | none | fx fy cx cy 0, size"


class TumMonoFile(NamedTuple):
    """The recording camera, and how the images are to be rectified.

    ``rectified`` is None where ``how`` is a word: then the program chooses the camera (``crop``: no black
    border, ``full``: no pixel lost, ``none``: no rectification).
    """

    recorded: CameraFile
    how: str
    rectified: CameraFile | None
    rectified_size: tuple[int, int]


def read_tum_mono(path: Path | str) -> TumMonoFile:
    """Read the file.

    Raises
    ------
    FormatError
        Where it is not as the module says.
    """
    path = Path(path)
    lines = list(read_lines(path))
    if len(lines) != 4:
        raise FormatError(path, lines[-1][0] if lines else None, f"{len(lines)} lines; expected 4: {LINES}")
    size, new_size = _size(path, *lines[1]), _size(path, *lines[3])
    recorded = CameraFile(_camera(path, *lines[0], size), size)
    line, how = lines[2]
    if how.lower() in WORDS:
        return TumMonoFile(recorded, how.lower(), None, new_size)
    if how.split()[0].isalpha():
        raise FormatError(path, line, f"{how!r}; expected {', '.join(WORDS)}, or fx fy cx cy 0")
    rectified = CameraFile(_camera(path, line, "Pinhole " + how, new_size), new_size)
    return TumMonoFile(recorded, "given", rectified, new_size)


def _camera(path: Path, line: int, text: str, size: tuple[int, int]) -> Camera:
    words = text.split()
    kind = words.pop(0).lower() if words[0].isalpha() else "radtan" if len(words) == 8 else "fov"
    if kind not in LENSES:
        raise FormatError(
            path, line, f"lens {kind!r}; expected FOV, Pinhole, RadTan, EquiDistant, or numbers"
        )
    make, lens = LENSES[kind]
    names = (*SENSOR, *lens)
    if len(words) != len(names) and not (kind == "pinhole" and len(words) == 4):
        raise FormatError(path, line, f"{len(words)} numbers; expected {len(names)}: {' '.join(names)}")
    values = [number(path, line, word, name) for word, name in zip(words, names, strict=False)]
    sensor = values[:4]
    if values[2] < 1 and values[3] < 1:
        sensor = relative_sensor(sensor, size)
    try:
        if kind != "pinhole":
            return make.from_params([*sensor, *values[4:], *[0.0] * (make is Radtan)])
        if values[4:] not in ([], [0.0]):
            raise ValueError(f"omega is {values[4]:g}; expected 0 for a pinhole")
        return Pinhole(*sensor)
    except ValueError as error:
        raise FormatError(path, line, str(error)) from None


def _size(path: Path, line: int, text: str) -> tuple[int, int]:
    words = text.split()
    values = [number(path, line, word, "size") for word in words]
    if len(values) != 2 or not all(v.is_integer() and 1 <= v < 2**31 for v in values):
        raise FormatError(path, line, f"size is {text!r}; expected width and height, whole numbers")
    return int(values[0]), int(values[1])
