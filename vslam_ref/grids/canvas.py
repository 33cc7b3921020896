"""What every map that is drawn from scans does: sort beams, keep the clock, grow, count.

A map is a dictionary of layers on one :class:`Lattice`; a subclass says what a scan does to them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.grids.beam_marks import BeamsInCells
from vslam_ref.grids.lattice import Lattice
from vslam_ref.grids.scan import BeamCounts, ScanLike, ScanReport, sort_beams, unit_vectors


class Canvas:
    """Layers on a growing lattice.

    Attributes
    ----------
    lattice : Lattice
    layers : dict of str to ndarray, shape (rows, columns)
    scans, backward_stamps : int
        Scans so far, and those whose stamp was not later than that of the scan before.
    beams : BeamCounts
        All beams so far, by kind.
    time : float
        The clock: the last stamp, or the next larger number where a stamp did not move forward; -inf at
        first.
    """

    def __init__(
        self, resolution: float, usable_range: float, no_return: str, fills: dict[str, float]
    ) -> None:
        self.lattice = Lattice(resolution)
        self._usable_range, self._no_return_is_free = usable_range, no_return == "free"
        self._fills = fills
        self.layers = {name: np.zeros((0, 0)) for name in fills}
        self.scans = self.backward_stamps = 0
        self.beams = BeamCounts()
        self.time = -math.inf

    def update(self, T_world_laser: ArrayLike, scan: ScanLike) -> ScanReport:
        """Take in one scan.

        Parameters
        ----------
        T_world_laser : array_like, shape (3,)
            Pose (x, y, theta) of the laser in the world, metres and radians.
        scan : ScanLike

        Returns
        -------
        ScanReport
            The scan's beams by kind, and whether its stamp did not move forward.

        Raises
        ------
        ValueError
            If the pose is not three finite numbers, angles and ranges do not fit together, the time is not
            finite, or the map would exceed its limit of cells.  The map is then as it was.
        """
        pose = np.asarray(T_world_laser, dtype=np.float64)
        if pose.shape != (3,) or not np.isfinite(pose).all():
            raise ValueError(f"pose {T_world_laser!r}: need three finite numbers x, y, theta")
        beams = sort_beams(scan, self._usable_range, self._no_return_is_free)
        ends_world = pose[:2] + beams.lengths[:, None] * unit_vectors(pose[2] + beams.angles)
        points = np.vstack([pose[:2], ends_world])
        self.reserve(points)
        backward = scan.time <= self.time
        self.time = math.nextafter(self.time, math.inf) if backward else float(scan.time)
        self.scans += 1
        self.backward_stamps += backward
        self.beams = self.beams.plus(beams.counts)
        if len(beams.lengths):
            in_cells = self.lattice.lattice_from_world(points)
            self._draw(BeamsInCells(in_cells[0], in_cells[1:], beams.hit))
        return ScanReport(beams.counts, backward)

    def _draw(self, beams: BeamsInCells) -> None:
        """Change the layers by beams given in cells from the lattice's corner."""
        raise NotImplementedError

    def reserve(self, points: Array) -> None:
        """Grow until world points (N, 2) lie inside, with a cell to spare for rounding.

        Raises
        ------
        ValueError
            If the map would exceed its limit of cells.  It is then as it was.
        """
        margin = self.lattice.resolution
        larger = self.lattice.grown(points.min(axis=0) - margin, points.max(axis=0) + margin)
        if larger is not self.lattice:
            old = self.lattice
            layers = {name: larger.moved(a, old, self._fills[name]) for name, a in self.layers.items()}
            self.lattice, self.layers = larger, layers
