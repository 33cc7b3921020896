"""Occupancy grids as files: pictures, and the maps of ROS' ``map_server``.

A map is two files: a picture and ``name.yaml``, which names it::

    image: static.png
    mode: trinary
    resolution: 0.1          # metres per pixel
    origin: [-25.6, -12.8, 0.0]   # x, y, turn of the lower left pixel's corner
    negate: 0
    occupied_thresh: 0.9
    free_thresh: 0.1

With ``negate: 0`` a pixel of grey g means occupied with p = (255 - g) / 255: black is occupied.  The
picture's first row is the map's last, since pixels go down and y goes up.  Rounding to 255 greys keeps every
decided cell decided and every other undecided.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.datasets.picture_size import require_size
from vslam_ref.datasets.text import FormatError
from vslam_ref.grids.lattice import MAX_CELLS, Lattice
from vslam_ref.grids.log_odds import DECIDED, LogOddsGrid, log_odds

Bytes = NDArray[np.uint8]
MAX_YAML = 64 * 1024


def grey(grid: LogOddsGrid) -> Bytes:
    """Return the picture (rows, columns) of a map: black occupied, white free, first row on top."""
    picture: Bytes = np.rint(255.0 * (1.0 - grid.probability))[::-1].astype(np.uint8)
    return picture


def png_bytes(picture: Bytes) -> bytes:
    """Return a picture, grey (rows, columns) or RGB (rows, columns, 3), as the content of a PNG file."""
    import cv2

    pixels = picture if picture.ndim == 2 else picture[..., ::-1]  # OpenCV's order is BGR
    done, data = cv2.imencode(".png", np.ascontiguousarray(pixels))
    if not done:
        raise ValueError(f"a picture of shape {picture.shape} cannot be written as PNG")
    content: bytes = data.tobytes()
    return content


def write_ros_map(folder: Path, name: str, grid: LogOddsGrid) -> None:
    """Write ``name.png`` and ``name.yaml`` into ``folder``."""
    (folder / f"{name}.png").write_bytes(png_bytes(grey(grid)))
    x, y = grid.origin_xy
    lines = [
        f"image: {name}.png",
        "mode: trinary",
        f"resolution: {grid.resolution!r}",
        f"origin: [{x!r}, {y!r}, 0.0]",
        "negate: 0",
        f"occupied_thresh: {DECIDED!r}",
        f"free_thresh: {round(1.0 - DECIDED, 12)!r}",
    ]
    (folder / f"{name}.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def read_ros_map(path: Path) -> LogOddsGrid:
    """Read a map that is not turned: the grey of a pixel becomes a probability, kept off 0 and 1.

    Raises
    ------
    FormatError
        If the YAML lacks a key or holds a wrong value, if the picture is missing or none, or if the origin
        is turned or not on the lattice of the resolution.
    """
    about = _yaml(path)
    resolution = _number(path, about, "resolution")
    origin = about.get("origin")
    if (
        not isinstance(origin, list)
        or len(origin) != 3
        or not all(_is_number(v) for v in origin)
        or origin[2] != 0
    ):
        raise FormatError(path, None, f"origin is {origin!r}; expected [x, y, 0.0]")
    if about.get("negate") not in (0, 1):
        raise FormatError(path, None, f"negate is {about.get('negate')!r}; expected 0 or 1")
    picture = _picture(path, about.get("image"))
    p = picture[::-1] / 255.0
    p = p if about["negate"] else 1.0 - p
    if not resolution > 0:
        raise FormatError(path, None, f"resolution is {resolution:g}; expected more than 0")
    corner = [v / resolution for v in origin[:2]]
    whole = [round(v) for v in corner]
    if max(abs(a - b) for a, b in zip(corner, whole, strict=True)) > 1e-6:
        raise FormatError(path, None, f"origin is {origin!r}; expected multiples of the resolution")
    shape = (picture.shape[0], picture.shape[1])
    least = 0.5 / 255.0
    return LogOddsGrid(
        Lattice(resolution, (whole[0], whole[1]), shape), log_odds(np.clip(p, least, 1.0 - least))
    )


def _yaml(path: Path) -> dict[str, Any]:
    import yaml

    with path.open("rb") as stream:
        data = stream.read(MAX_YAML + 1)
    if len(data) > MAX_YAML:
        raise FormatError(path, None, f"more than {MAX_YAML} bytes; is this a map's YAML?")
    try:
        about = yaml.safe_load(data.decode("utf-8"))
    except (yaml.YAMLError, ValueError, RecursionError) as error:  # an impossible date is a ValueError
        mark = getattr(error, "problem_mark", None)
        raise FormatError(path, mark.line + 1 if mark else None, "not YAML; expected a map's file") from None
    if not isinstance(about, dict):
        raise FormatError(path, None, "no keys; expected image, resolution, origin, negate")
    return about


def _is_number(value: Any) -> bool:
    """Whether it is a number of a size that a map may have; NaN is none."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -1e15 < value < 1e15


def _number(path: Path, about: dict[str, Any], key: str) -> float:
    value = about.get(key)
    if not _is_number(value):
        raise FormatError(path, None, f"{key} is {value!r}; expected a finite number")
    return float(value)  # type: ignore[arg-type]


def _picture(path: Path, name: Any) -> Array:
    import cv2

    try:
        there = isinstance(name, str) and (path.parent / name).is_file()
    except OSError:  # a name that no file can have
        there = False
    if not there:
        raise FormatError(path, None, f"image is {name!r}; expected a picture beside the YAML")
    require_size(path.parent / name, MAX_CELLS)
    try:
        picture = cv2.imdecode(np.fromfile(path.parent / name, np.uint8), cv2.IMREAD_GRAYSCALE)
    except cv2.error:  # empty, or too large for OpenCV
        picture = None
    if picture is None:
        raise FormatError(path.parent / name, None, "not a picture; expected PNG or PGM")
    if picture.size > MAX_CELLS:
        raise FormatError(path.parent / name, None, f"{picture.size} pixels; at most {MAX_CELLS}")
    return np.asarray(picture, dtype=np.float64)
