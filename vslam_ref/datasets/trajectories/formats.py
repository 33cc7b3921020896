"""What the three formats are, and what a file holds beside a trajectory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import quaternion
from vslam_ref.metrics.trajectory.poses import Trajectory

FORMATS = ("tum", "kitti", "euroc")

TUM = ("time", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
KITTI = ("r11", "r12", "r13", "tx", "r21", "r22", "r23", "ty", "r31", "r32", "r33", "tz")
EUROC = ("time [ns]", "tx", "ty", "tz", "qw", "qx", "qy", "qz")


class AsRead(NamedTuple):
    """What a file holds beyond a trajectory's doubles; None where the format has no such thing.

    Attributes
    ----------
    quaternions : ndarray, shape (N, 4), or None
        (w, x, y, z) with the file's digits, not normalised.
    nanoseconds : ndarray of int, shape (N,), or None
    """

    quaternions: Array | None = None
    nanoseconds: IntArray | None = None


class TrajectoryFile(NamedTuple):
    """A trajectory and what its file said.

    Attributes
    ----------
    trajectory : Trajectory
        In the order of time.
    format : str
        "tum", "kitti" or "euroc".
    as_read : AsRead
        For :func:`write`.
    unit_error : float
        How far the worst quaternion's length is from 1, or the worst entry of R^T R from the identity.
    repeated : int
        Poses with the time of an earlier line.
    notes : tuple of str
        What is odd in the file and harmless, a sentence each.
    places : ndarray of int, shape (N,), or None
        Which line of poses of the file, from 0, each pose is; lost frames are left out.
    lines : int
        How many lines of poses the file has.
    w_first : bool or None
        Whether the first number of each quaternion was read as w; None for matrices.
    """

    trajectory: Trajectory
    format: str
    as_read: AsRead
    unit_error: float
    repeated: int
    notes: tuple[str, ...] = ()
    places: IntArray | None = None
    lines: int = 0
    w_first: bool | None = None


def seconds(ns: IntArray) -> Array:
    """Seconds of nanoseconds, shape (N,); whole seconds apart, as 1e18 ns do not fit a double."""
    return np.asarray(ns // 10**9 + ns % 10**9 / 1e9)


def matrices(quaternions: Array) -> Array:
    """Rotation matrices (N, 3, 3) of the normalised quaternions wxyz (N, 4)."""
    return quaternion.matrix(quaternion.normalise(quaternions))
