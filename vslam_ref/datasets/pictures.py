"""Pictures from files, as grey values, and back.

OpenCV decodes them.  What its decoders would write to the terminal is caught, and quoted in the error; sizes
are read before a picture is unpacked.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.datasets.picture_size import pnm_largest, require_size
from vslam_ref.datasets.text import FormatError
from vslam_ref.support.files import write_bytes

GreyImage = NDArray[np.uint8]

SUFFIXES = (".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".ppm", ".tif", ".tiff", ".webp")
MAX_PIXELS = 100_000_000
CUT_OFF = "Premature end"
"""What the JPEG decoder writes when it fills the rest of a picture with grey."""


class Picture(NamedTuple):
    """Values of a picture.

    Attributes
    ----------
    grey : ndarray of uint8, shape (H, W)
    colour : ndarray of uint8, shape (H, W, 3), or None
        Red, green, blue; None where the file has grey values only.
    bits : int
        Of a value in the file, 8 or 16; of 16 bits the upper range 0 to 65535 became 0 to 255.
    """

    grey: GreyImage
    colour: GreyImage | None = None
    bits: int = 8


def image_files(names: Sequence[Path | str]) -> list[Path]:
    """Images that are named: files as given, of folders all that end like an image, sorted by name.

    Raises
    ------
    FormatError
        If a name is neither file nor folder, or a folder has no image.
    """
    found: list[Path] = []
    for word in names:
        name = Path(word)
        if not str(word):
            raise FormatError(name, None, "an empty name; expected an image or a folder of images")
        if name.is_dir():
            inside = sorted(p for p in name.iterdir() if p.suffix.lower() in SUFFIXES and p.is_file())
            if not inside:
                raise FormatError(name, None, f"no image in this folder; expected {', '.join(SUFFIXES)}")
            found += inside
        elif name.is_file():
            found.append(name)
        else:
            raise FormatError(name, None, "no such file or folder")
    return found


def read_grey(path: Path | str) -> GreyImage:
    """Read an image as grey values (H, W), as it is stored: a note of how to turn it (EXIF) is not followed.

    A camera's parameters belong to the sensor's rows and columns, however it was held.

    Raises
    ------
    FormatError
        If the file is missing, no image, cut off, or larger than ``MAX_PIXELS``.
    """
    import cv2

    grey: GreyImage = _decoded(Path(path), cv2.IMREAD_GRAYSCALE).astype(np.uint8, copy=False)
    return grey


def read_picture(path: Path | str) -> Picture:
    """Read an image, grey or colour, of 8 or 16 bits, as it is stored (see :func:`read_grey`).

    Grey values of colours are 0.299 R + 0.587 G + 0.114 B.  An opacity is left out.

    Raises
    ------
    FormatError
        As :func:`read_grey`, and on values that are no whole numbers of 8 or 16 bits.
    """
    import cv2

    values = _decoded(Path(path), cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
    if values.dtype not in (np.uint8, np.uint16):
        raise FormatError(Path(path), None, f"values are {values.dtype}; expected whole ones of 8 or 16 bits")
    bits = 8 * values.dtype.itemsize
    if bits == 16:
        values = ((values.astype(np.uint32) + 128) // 257).astype(np.uint8)  # 65535 becomes 255
    return from_opencv(values, bits)


class Channels(NamedTuple):
    """Values of a picture as they are stored.

    Attributes
    ----------
    colours : ndarray, shape (H, W, 1 or 3)
        0 to 255; values of 16 bits are divided by 257, those of a PGM with another largest value stretched.
    opacity : ndarray, shape (H, W), or None
        0 (transparent) to 255; None where the file has none.
    """

    colours: Array
    opacity: Array | None


def read_channels(path: Path | str) -> Channels:
    """Read every channel of an image by itself, its opacity too.

    Raises
    ------
    FormatError
        As :func:`read_picture`.
    """
    import cv2

    path = Path(path)
    values = _decoded(path, cv2.IMREAD_UNCHANGED)
    if values.dtype not in (np.uint8, np.uint16):
        raise FormatError(path, None, f"values are {values.dtype}; expected whole ones of 8 or 16 bits")
    scaled: Array = values.reshape(*values.shape[:2], -1) / (257.0 if values.dtype == np.uint16 else 1.0)
    with path.open("rb") as stream:
        largest = pnm_largest(stream.read(1000))
    if values.dtype == np.uint8 and largest is not None:
        scaled *= 255.0 / largest
    return Channels(scaled[..., :3], scaled[..., 3]) if scaled.shape[2] == 4 else Channels(scaled, None)


def from_opencv(values: NDArray[Any], bits: int = 8) -> Picture:
    """Return grey and colour values of what OpenCV holds: uint8 (H, W), or (H, W, 3) as blue, green, red."""
    import cv2

    if values.ndim == 2:
        return Picture(values, None, bits)
    grey, colour = (cv2.cvtColor(values, code) for code in (cv2.COLOR_BGR2GRAY, cv2.COLOR_BGR2RGB))
    return Picture(grey.astype(np.uint8, copy=False), colour.astype(np.uint8, copy=False), bits)


def _decoded(path: Path, flags: int) -> NDArray[Any]:
    """What OpenCV makes of a file, checked before and after."""
    import cv2

    if not path.is_file():
        raise FormatError(path, None, "no such file")
    require_size(path, MAX_PIXELS)
    with complaints() as shown:
        try:
            image = cv2.imread(str(path), flags | cv2.IMREAD_IGNORE_ORIENTATION)
        except cv2.error as error:  # more than 2^30 pixels
            image = None
            shown.append(str(error.err))
    why = " ".join(" ".join(shown).split())
    if image is None:
        right = f"expected one of {', '.join(SUFFIXES)}"
        raise FormatError(path, None, f"no image that can be read{f' ({why})' if why else ''}; {right}")
    if CUT_OFF in why:
        raise FormatError(path, None, f"{why}: the picture is cut off; fetch it again")
    if image.shape[0] * image.shape[1] > MAX_PIXELS:
        size = f"{image.shape[1]}x{image.shape[0]}"
        raise FormatError(path, None, f"{size} pixels; at most {MAX_PIXELS} are read")
    found: NDArray[Any] = image
    return found


def write_png(path: Path, grey: GreyImage) -> None:
    """Write grey values (H, W) as a PNG: every value comes back."""
    import cv2

    done, data = cv2.imencode(".png", grey)
    if not done:
        raise ValueError(f"{path}: an image of shape {grey.shape}, {grey.dtype} cannot be written")
    write_bytes(path, data.tobytes())


@contextmanager
def complaints() -> Iterator[list[str]]:
    """Collect what the decoders write to the process's standard error: lines that name no file."""
    shown: list[str] = []
    sys.stderr.flush()
    with tempfile.TemporaryFile() as sink:
        kept = os.dup(2)
        try:
            os.dup2(sink.fileno(), 2)
            yield shown
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            sink.seek(0)
            shown.append(sink.read(1000).decode("utf-8", "replace"))
