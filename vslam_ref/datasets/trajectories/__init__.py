"""Trajectories in the formats of TUM, KITTI and EuRoC, read and written without losing a bit.

=======  ==============================================================================================
format   one line is
=======  ==============================================================================================
tum      ``time tx ty tz qx qy qz qw``: seconds, metres, unit quaternion with w **last**
kitti    ``r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz``: the upper three rows of the matrix; no time
euroc    ``time,tx,ty,tz,qw,qx,qy,qz``: **nanoseconds** (whole), metres, quaternion with w **first**;
         velocity (VINS), and biases (EuRoC), may follow and are not read
=======  ==============================================================================================

All three are read as ``T_world_body``.  ``#``, ``%`` and ``//`` begin a comment, ``.gz`` is unpacked.

*What programs write is read.*  Blanks, tabs, commas or semicolons part the columns, also at the end of a
line.  Names of the columns, in the first line or in a comment above the data, say what they are, in which
order and unit; without names, times since 1970 tell their unit by their size.

====================================  =================================================================
what is odd                           what is done, and told in ``notes``
====================================  =================================================================
lines out of order                    the poses are put in the order of time
several poses of one time             of equal times only the first is paired with another trajectory
``nan``, or zeros for a quaternion    lost frames: left out (as by TUM's own program)
times in milli-, micro-, nanoseconds  read as such
columns that nothing names            passed over, if the length of the quaternion shows the others
====================================  =================================================================

*Nothing is lost.*  Numbers are written with the fewest digits that read back as the same double.  Two
things of a file are not part of a :class:`~vslam_ref.metrics.trajectory.poses.Trajectory`: quaternions as
they stand there (rounded, so not of unit length; the rotation matrices are those of the normalised
quaternions), and whole nanoseconds (a double holds seconds since 1970 to 2.4e-7 s).  :class:`AsRead` keeps
them, and :func:`write` gives them back.

*Nothing wrong gets in.*  A quaternion whose length, or a matrix whose R^T R, is off by more than
``UNIT_TOLERANCE`` is refused, and so is a line with more or fewer columns than the others: the last one too,
if a program was stopped while it wrote it.
"""

from vslam_ref.datasets.trajectories.columns import UNIT_TOLERANCE
from vslam_ref.datasets.trajectories.formats import FORMATS, AsRead, TrajectoryFile
from vslam_ref.datasets.trajectories.reading import (
    detect,
    read,
    read_euroc,
    read_kitti,
    read_tum,
)
from vslam_ref.datasets.trajectories.writing import to_text, write

__all__ = [
    "FORMATS",
    "UNIT_TOLERANCE",
    "AsRead",
    "TrajectoryFile",
    "detect",
    "read",
    "read_euroc",
    "read_kitti",
    "read_tum",
    "to_text",
    "write",
]
