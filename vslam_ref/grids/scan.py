"""A laser scan, and which of its beams say something.

==============  ================================  ====================================================
kind            reading                           what it says
==============  ================================  ====================================================
hit             0 < range < max_range             free up to there, something at the end
no return       range >= max_range, or +inf       nothing, or free all the way: ``MapConfig.no_return``
not a number    NaN                               nothing
not positive    zero, negative, -inf              nothing (closer than the scanner can measure, or broken)
==============  ================================  ====================================================

Nothing is dropped in silence: :class:`BeamCounts` adds up.  Ranges are in metres, angles in radians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array


class ScanLike(Protocol):
    """What a map needs of a scan; :class:`Scan` has it."""

    @property
    def angles(self) -> Array:
        """Directions of the beams in the laser's frame (B,), radians."""
        ...

    @property
    def ranges(self) -> Array:
        """Measured distances (B,), metres."""
        ...

    @property
    def max_range(self) -> float:
        """Distance from which a reading means that nothing came back, metres."""
        ...

    @property
    def time(self) -> float:
        """Seconds."""
        ...


class Scan(NamedTuple):
    """One scan: ``angles (B,)``, ``ranges (B,)`` in the laser's frame; ``max_range``; ``time``, seconds."""

    angles: Array
    ranges: Array
    max_range: float
    time: float


@dataclass(frozen=True)
class LaserScanner:
    """Geometry of a scanner: ``beams`` directions from ``first_angle`` on, ``step`` apart.

    Parameters
    ----------
    beams : int
    first_angle, step : float
        Radians; 0 is straight ahead, positive to the left.
    max_range : float
        Metres.

    Raises
    ------
    ValueError
        If the number of beams is not positive, or a number is not finite or the range not positive.

    Examples
    --------
    >>> LaserScanner(3, -np.pi / 2, np.pi / 2, 10.0).angles.round(3)
    array([-1.571,  0.   ,  1.571])
    """

    beams: int
    first_angle: float
    step: float
    max_range: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        if self.beams < 1:
            raise ValueError(f"beams={self.beams}: a scanner needs at least one")
        if not (math.isfinite(self.first_angle) and math.isfinite(self.step)):
            raise ValueError(f"first_angle={self.first_angle}, step={self.step}: must be finite")
        if not self.max_range > 0:
            raise ValueError(f"max_range={self.max_range} m: must be positive")

    @property
    def angles(self) -> Array:
        """Directions (B,) in the laser's frame."""
        return self.first_angle + self.step * np.arange(self.beams, dtype=np.float64)

    def scan(self, ranges: Array, time: float) -> Scan:
        """Return the scan of ``ranges`` (B,) at ``time``.

        Raises
        ------
        ValueError
            If the number of ranges is not that of the beams.
        """
        if np.shape(ranges) != (self.beams,):
            raise ValueError(f"ranges of shape {np.shape(ranges)}: this scanner has {self.beams} beams")
        return Scan(self.angles, np.asarray(ranges, dtype=np.float64), self.max_range, float(time))


class BeamCounts(NamedTuple):
    """How many beams were of each kind."""

    hits: int = 0
    no_return: int = 0
    not_a_number: int = 0
    not_positive: int = 0

    @property
    def beams(self) -> int:
        """All of them."""
        return sum(self)

    def plus(self, other: BeamCounts) -> BeamCounts:
        """Return the sums."""
        return BeamCounts(*(a + b for a, b in zip(self, other, strict=True)))


class Beams(NamedTuple):
    """Beams that say something: ``angles (n,)``, ``lengths (n,)``, ``hit (n,)``; and counts of every kind."""

    angles: Array
    lengths: Array
    hit: NDArray[np.bool_]
    counts: BeamCounts


def sort_beams(scan: ScanLike, usable_range: float, no_return_is_free: bool) -> Beams:
    """Sort out the beams of a scan, and cut them at ``usable_range``: beyond, they say nothing.

    Raises
    ------
    ValueError
        If angles and ranges do not fit together, an angle or the time is not finite, or ``max_range`` is not
        positive.
    """
    angles, ranges = np.asarray(scan.angles, np.float64), np.asarray(scan.ranges, np.float64)
    if angles.ndim != 1 or angles.shape != ranges.shape:
        raise ValueError(f"{ranges.shape} ranges for {angles.shape} angles: need one range per beam")
    if not np.isfinite(angles).all():
        raise ValueError("angles of a scan must be finite")
    if not scan.max_range > 0:
        raise ValueError(f"max_range {scan.max_range!r} m: must be positive")
    if not math.isfinite(scan.time):
        raise ValueError(f"time {scan.time!r} s of a scan: must be finite")
    nan, low = np.isnan(ranges), ranges <= 0
    beyond = ranges >= scan.max_range
    good = ~(nan | low | beyond)
    counts = BeamCounts(int(good.sum()), int(beyond.sum()), int(nan.sum()), int(low.sum()))
    used = good | beyond if no_return_is_free else good
    reach = min(usable_range, scan.max_range)
    ranges = ranges[used]
    hit = good[used] & (ranges <= usable_range)
    return Beams(angles[used], np.minimum(ranges, reach), hit, counts)


def unit_vectors(angles: ArrayLike) -> Array:
    """Directions (..., 2) of angles (...,), radians.

    Examples
    --------
    >>> unit_vectors([0.0, np.pi / 2]).round(12)
    array([[1., 0.],
           [0., 1.]])
    """
    a = np.asarray(angles, dtype=np.float64)
    return np.stack([np.cos(a), np.sin(a)], -1)


class ScanReport(NamedTuple):
    """What became of one scan: its beams by kind, and whether its stamp did not move forward."""

    beams: BeamCounts
    backward: bool
