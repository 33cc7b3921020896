"""A trajectory, and the summary of a list of errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray


@dataclass(frozen=True)
class Trajectory:
    """Poses ``T_world_body`` of a body (a camera, a vehicle), in the order in which they were taken.

    Attributes
    ----------
    times : ndarray, shape (N,), or None
        Seconds, not falling.  None where only the order is known.
    t_world_body : ndarray, shape (N, 3)
        Where the body stands, metres in the world frame.
    R_world_body : ndarray, shape (N, 3, 3)
        How it is turned: ``X_world = R_world_body @ X_body + t_world_body``.

    Raises
    ------
    ValueError
        If the shapes do not fit together, a number is not finite, or times fall.
    """

    times: Array | None
    t_world_body: Array
    R_world_body: Array

    def __post_init__(self) -> None:
        count = len(self.t_world_body)
        if self.t_world_body.shape != (count, 3) or self.R_world_body.shape != (count, 3, 3):
            shapes = f"{self.t_world_body.shape} and rotations {self.R_world_body.shape}"
            raise ValueError(f"positions {shapes}: need (N, 3) and (N, 3, 3)")
        for name, values in (("positions", self.t_world_body), ("rotations", self.R_world_body)):
            if not np.isfinite(values).all():
                raise ValueError(f"{name} must be finite")
        if self.times is None:
            return
        if self.times.shape != (count,):
            raise ValueError(f"times {self.times.shape}: need ({count},), one for each pose")
        if not np.isfinite(self.times).all() or (np.diff(self.times) < 0).any():
            raise ValueError("times must be finite and must not fall")

    def __len__(self) -> int:
        return len(self.t_world_body)

    def take(self, index: IntArray) -> Trajectory:
        """Return the poses with these numbers."""
        times = None if self.times is None else self.times[index]
        return Trajectory(times, self.t_world_body[index], self.R_world_body[index])

    def later(self, offset: float) -> Trajectory:
        """Return the same poses with times moved by an offset in seconds.

        Raises
        ------
        ValueError
            If there are no times.
        """
        if self.times is None:
            raise ValueError(f"poses without times cannot be moved by {offset:g} s")
        return Trajectory(self.times + offset, self.t_world_body, self.R_world_body)


class Summary(NamedTuple):
    """Statistics of errors that are not negative, all in the unit of the errors.

    ``std`` is the root of the mean squared distance from the mean (divided by N, not N - 1), so that
    ``rmse**2 == mean**2 + std**2``.
    """

    rmse: float
    mean: float
    median: float
    max: float
    std: float


def summary(errors: ArrayLike) -> Summary:
    """Summarise errors, shape (N,), N >= 1, in any unit; the summary has the same unit.

    Raises
    ------
    ValueError
        If there is none.

    Examples
    --------
    >>> summary([0.0, 3.0, 3.0]).mean
    2.0
    """
    e = np.asarray(errors, dtype=np.float64)
    if e.ndim != 1 or len(e) == 0:
        raise ValueError(f"errors {e.shape}: need (N,), N >= 1")
    rmse = float(np.sqrt(np.mean(e**2)))
    return Summary(rmse, float(e.mean()), float(np.median(e)), float(e.max()), float(e.std()))
