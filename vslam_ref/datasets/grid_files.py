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

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.datasets.picture_size import require_size
from vslam_ref.datasets.pictures import read_grey
from vslam_ref.datasets.yaml_nodes import Node, read_yaml
from vslam_ref.grids.lattice import MAX_CELLS, Lattice
from vslam_ref.grids.log_odds import DECIDED, LogOddsGrid, log_odds

Bytes = NDArray[np.uint8]
LARGEST = 1e15
"""Of a number in the YAML; the lattice counts cells in whole numbers."""


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
        If the YAML lacks a key or holds a wrong value, if the picture is missing or unreadable, or if the
        origin is turned or not on the lattice of the resolution.
    """
    top = read_yaml(path)
    resolution, at = top.get("resolution").number(), top.get("origin")
    if not 0 < resolution < LARGEST:
        raise top.get("resolution").error(f"resolution is {resolution:g}; expected more than 0")
    origin = at.vector()
    if len(origin) != 3 or origin[2] != 0 or not (np.abs(origin) < LARGEST).all():
        raise at.error(f"origin is {origin.tolist()}; expected [x, y, 0.0]")
    negate = top.get("negate").choice({"0": False, "1": True})
    picture = _picture(top.get("image"))
    p = picture[::-1] / 255.0
    corner = origin[:2] / resolution
    if np.abs(corner - np.round(corner)).max() > 1e-6:
        raise at.error(f"origin is {origin.tolist()}; expected multiples of the resolution")
    first = tuple(int(v) for v in np.round(corner))
    least = 0.5 / 255.0
    lattice = Lattice(resolution, (first[0], first[1]), (picture.shape[0], picture.shape[1]))
    return LogOddsGrid(lattice, log_odds(np.clip(p if negate else 1.0 - p, least, 1.0 - least)))


def _picture(node: Node) -> Array:
    path = node.path.parent / node.text()
    try:
        there = path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        there = False
    if not there:
        raise node.error(f"image is {node.text()!r}; expected a picture beside the YAML")
    require_size(path, MAX_CELLS)
    return read_grey(path).astype(np.float64)
