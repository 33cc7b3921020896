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

import numpy as np
from numpy.typing import NDArray

from vslam_ref.datasets.picture_size import require_size
from vslam_ref.datasets.text import FormatError
from vslam_ref.support.files import write_bytes

GreyImage = NDArray[np.uint8]

SUFFIXES = (".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".ppm", ".tif", ".tiff", ".webp")
MAX_PIXELS = 100_000_000
CUT_OFF = "Premature end"
"""What the JPEG decoder writes when it fills the rest of a picture with grey."""


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

    path = Path(path)
    if not path.is_file():
        raise FormatError(path, None, "no such file")
    require_size(path, MAX_PIXELS)
    with _complaints() as shown:
        try:
            image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        except cv2.error as error:  # more than 2^30 pixels
            image = None
            shown.append(str(error.err))
    why = " ".join(" ".join(shown).split())
    if image is None:
        right = f"expected one of {', '.join(SUFFIXES)}"
        raise FormatError(path, None, f"no image that can be read{f' ({why})' if why else ''}; {right}")
    if CUT_OFF in why:
        raise FormatError(path, None, f"{why}: the picture is cut off; fetch it again")
    if image.size > MAX_PIXELS:
        raise FormatError(
            path, None, f"{image.shape[1]}x{image.shape[0]} pixels; at most {MAX_PIXELS} are read"
        )
    grey: GreyImage = image.astype(np.uint8, copy=False)
    return grey


def write_png(path: Path, grey: GreyImage) -> None:
    """Write grey values (H, W) as a PNG: every value comes back."""
    import cv2

    done, data = cv2.imencode(".png", grey)
    if not done:
        raise ValueError(f"{path}: an image of shape {grey.shape}, {grey.dtype} cannot be written")
    write_bytes(path, data.tobytes())


@contextmanager
def _complaints() -> Iterator[list[str]]:
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
