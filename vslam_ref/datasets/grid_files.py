"""Occupancy grids as files: pictures, and the maps of ROS' ``map_server``.

A map is two files: a picture and ``name.yaml``, which names it::

    image: static.png        # beside the YAML, or by a path from there
    mode: trinary            # may be missing; or scale, raw
    resolution: 0.1          # metres per pixel
    origin: [-25.6, -12.8, 0.0]   # x, y, turn of the lower left pixel's corner
    negate: 0
    occupied_thresh: 0.9
    free_thresh: 0.1

With ``negate: 0`` a pixel of grey g means occupied with p = (255 - g) / 255: black is occupied.  What a cell
becomes is told by the mode, see :mod:`.map_cells`.  The picture's first row is the map's last, since pixels
go down and y goes up.  Rounding to 255 greys keeps every decided cell decided and every other undecided.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array
from vslam_ref.datasets.map_cells import cells_of, graded_cells, read_rule
from vslam_ref.datasets.picture_size import require_size
from vslam_ref.datasets.pictures import Channels, read_channels
from vslam_ref.datasets.yaml_nodes import Node, read_yaml
from vslam_ref.geometry import se2
from vslam_ref.grids.lattice import MAX_CELLS, Lattice
from vslam_ref.grids.log_odds import DECIDED, LogOddsGrid, log_odds

Bytes = NDArray[np.uint8]
LARGEST = 1e15
"""Of a number in the YAML; the lattice counts cells in whole numbers."""
OFF_LATTICE = 1e-6
"""Cells by which an origin may be off the world's lattice and count as on it: printed digits."""


@dataclass(frozen=True)
class RosMap:
    """A map that may stand anywhere and be turned: a grid in a frame of its own, and where that frame is.

    Parameters
    ----------
    grid : LogOddsGrid
        The cells in the map's frame.
    T_world_map : ndarray, shape (3,)
        (x, y, turn) of the map's frame in the world: metres and radians, counterclockwise.  Zeros where the
        origin lies on the world's lattice and is not turned: then the frames are the same.
    notes : tuple of str
        What is odd in the file and harmless.
    """

    grid: LogOddsGrid
    T_world_map: Array
    notes: tuple[str, ...] = ()

    @property
    def resolution(self) -> float:
        """Side of a cell, metres."""
        return self.grid.resolution

    @property
    def probability(self) -> Array:
        """Probability that a cell is occupied (rows, columns); the first row is the lowest of the map."""
        return self.grid.probability

    @property
    def yaw(self) -> float:
        """Turn of the map in the world, radians, counterclockwise."""
        return float(self.T_world_map[2])

    @property
    def origin_xy(self) -> tuple[float, float]:
        """World coordinates of the lower left corner of cell [0, 0], metres."""
        x, y = se2.act(self.T_world_map, self.grid.origin_xy).tolist()
        return x, y

    def map_from_world(self, xy_world: ArrayLike) -> Array:
        """World points (N, 2) in the frame of the grid, metres."""
        points: Array = se2.act(se2.inverse(self.T_world_map), np.atleast_2d(xy_world))
        return points

    def at(self, xy_world: ArrayLike) -> Array:
        """Log-odds (N,) at world points (N, 2); 0, unknown, outside."""
        return self.grid.at(self.map_from_world(xy_world))

    def world_from_cells(self, cells: ArrayLike) -> Array:
        """World coordinates (N, 2) of the centres of cells (N, 2), given as (row, column)."""
        points: Array = se2.act(self.T_world_map, self.grid.lattice.world_from_cells(cells))
        return points


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


def read_ros_map(path: Path, *, graded: bool = False) -> RosMap:
    """Read a map as ROS' map_server does: thresholds decide, in the way that the mode says.

    Parameters
    ----------
    path : Path
        The YAML.
    graded : bool
        Whether every grey is the probability of its cell instead, whatever mode and thresholds say: what
        :func:`write_ros_map` wrote comes back to half a grey step.

    Raises
    ------
    FormatError
        If the YAML lacks a key or holds a wrong value, or if the picture is missing or unreadable.
    """
    top = read_yaml(path)
    rule = read_rule(top)
    resolution = top.get("resolution").number()
    if not 0 < resolution < LARGEST:
        raise top.get("resolution").error(f"resolution is {resolution:g}; expected more than 0")
    origin = top.get("origin").vector()
    if len(origin) != 3 or not (np.abs(origin) < LARGEST).all():
        raise top.get("origin").error(f"origin is {origin.tolist()}; expected [x, y, turn]")
    picture = _picture(top.get("image"))
    p, notes = graded_cells(picture, rule) if graded else cells_of(picture, rule)
    least = 0.5 / 255.0
    levels = log_odds(np.clip(p[::-1], least, 1.0 - least))
    corner = origin[:2] / resolution
    whole = np.round(corner)
    if origin[2] == 0 and np.abs(corner - whole).max() <= OFF_LATTICE:
        lattice = Lattice(resolution, (int(whole[0]), int(whole[1])), levels.shape)
        return RosMap(LogOddsGrid(lattice, levels), se2.identity(), notes)
    return RosMap(LogOddsGrid(Lattice(resolution, (0, 0), levels.shape), levels), origin, notes)


def _picture(node: Node) -> Channels:
    path = node.path.parent / node.text()
    try:
        there = path.is_file()
        beside = (node.path.parent / PurePosixPath(node.text().replace("\\", "/")).name).is_file()
    except (OSError, ValueError):  # a name that no file can have
        there = beside = False
    if not there:
        right = "expected a picture beside the YAML, or its path from there"
        if beside and node.text():
            name = PurePosixPath(node.text().replace("\\", "/")).name
            right = f"no such file here, but one of its name lies beside the YAML: write 'image: {name}'"
        raise node.error(f"image is {node.text()!r}; {right}")
    require_size(path, MAX_CELLS)
    return read_channels(path)
