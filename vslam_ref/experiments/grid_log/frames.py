"""The film of a log: S and the plain grid side by side, D in colour, the robot and what moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import IntArray
from vslam_ref.datasets.video import Film
from vslam_ref.experiments.grid_log.mapping import Moment
from vslam_ref.grids.lattice import Lattice
from vslam_ref.grids.log_odds import LogOddsGrid

Bytes = NDArray[np.uint8]

VERMILION, BLUE, SKY = (213, 94, 0), (0, 114, 178), (86, 180, 233)
MOST = 1280
"""Pixels of the larger side."""
GAP = 8


class Director:
    """Adds every n-th moment to a film, so that it has about ``frames`` pictures."""

    def __init__(self, film: Film, scans: int, frames: int) -> None:
        self.film, self.step = film, max(1, scans // max(frames, 1))

    def __call__(self, moment: Moment) -> None:
        """Look at a moment, and film it if it is its turn."""
        if moment.number % self.step == 0:
            self.film(picture(moment))


def picture(moment: Moment) -> Bytes:
    """Draw one moment: S with D on the left or on top, the plain grid beside it or below."""
    lattice = moment.static.lattice
    rows, columns = moment.window
    wide = columns.stop - columns.start > rows.stop - rows.start
    with_d = canvas(moment.static)
    paint(with_d, moment.clusters.cells, VERMILION)
    for track in moment.tracker.moved.values():
        if moment.tracker.tracks and track in moment.tracker.tracks:
            paint(with_d, lattice.cells_from_world(np.array(track.places)), SKY)
    plain = canvas(moment.plain)
    for image in (with_d, plain):
        paint(image, robot(lattice, moment.T_world_laser), BLUE)
    parts = [fitted(image[rows, columns], wide) for image in (with_d, plain)]
    axis = 0 if wide else 1
    shape = list(parts[0].shape)
    shape[axis] = GAP
    return np.concatenate([parts[0], np.full(shape, 255, np.uint8), parts[1]], axis=axis)


def canvas(grid: LogOddsGrid) -> Bytes:
    """RGB (rows, columns, 3) of a map, first row at the bottom."""
    shade = np.rint(255.0 * (1.0 - grid.probability)).astype(np.uint8)
    return np.repeat(shade[..., None], 3, axis=-1)


def paint(image: Bytes, cells: IntArray, colour: tuple[int, int, int]) -> None:
    """Colour cells (n, 2), those inside the picture."""
    inside = ((cells >= 0) & (cells < image.shape[:2])).all(axis=-1)
    image[cells[inside, 0], cells[inside, 1]] = colour


def robot(lattice: Lattice, T_world_laser: NDArray[np.float64]) -> IntArray:
    """Cells of a disc of 0.3 m with a nose."""
    reach = max(0.3, lattice.resolution)
    x, y = np.meshgrid(*(np.arange(-reach, reach + 1e-9, lattice.resolution / 2),) * 2)
    disc = np.stack([x, y], -1)[x**2 + y**2 <= reach**2]
    nose = np.linspace(0.0, 2.5 * reach, 12)[:, None] * [np.cos(T_world_laser[2]), np.sin(T_world_laser[2])]
    return lattice.cells_from_world(T_world_laser[:2] + np.vstack([disc, nose]))


def fitted(image: Bytes, wide: bool) -> Bytes:
    """Enlarge or shrink by a whole number so that two pictures fit, and put the first row on top."""
    rows, columns = image.shape[0] * (2 if wide else 1), image.shape[1] * (1 if wide else 2)
    times = MOST // max(rows, columns)
    if times >= 1:
        image = image.repeat(times, axis=0).repeat(times, axis=1)
    else:  # of each block the darkest pixel, so that walls stay
        n = -(-max(rows, columns) // MOST)
        image = np.pad(image, ((0, -image.shape[0] % n), (0, -image.shape[1] % n), (0, 0)), mode="edge")
        blocks = image.reshape(image.shape[0] // n, n, image.shape[1] // n, n, 3)
        image = blocks.min(axis=(1, 3))
    return image[::-1]
