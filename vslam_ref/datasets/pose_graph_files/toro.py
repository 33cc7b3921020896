"""TORO's text, which is GTSAM's, too: what its lines say, and how they are written.

::

    VERTEX2 id x y theta                    EDGE2 i j x y theta  I11 I12 I22 I33 I13 I23     (this order!)
    VERTEX3 id x y z roll pitch yaw         EDGE3 i j x y z roll pitch yaw  21 numbers, row by row

In the plane TORO writes the information of (forward, sideward, turn) block by block, not row by row.  Files
that hold it row by row under the same tags exist; they show themselves, since in TORO's order their matrices
are not positive definite.  R = Rz(yaw) Ry(pitch) Rx(roll), and the information of the three angles is taken
for that of the rotation vector, as GTSAM does: for small errors at small angles they are the same.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.pose_graph_files.lines import Kind, Poses, ordered, upper
from vslam_ref.estimation.posegraph.spaces import Space
from vslam_ref.geometry import se3, so3

TORO_ROWS, TORO_COLUMNS = np.array([0, 0, 1, 2, 0, 1]), np.array([0, 1, 1, 2, 2, 2])
PLANE = ("x", "y", "theta")
SPACE = ("x", "y", "z", "roll", "pitch", "yaw")
X, Y, Z = np.eye(3)


def rotation_of(angles: Array) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll) of angles (k, 3) = (roll, pitch, yaw), (k, 3, 3)."""
    roll, pitch, yaw = (angles[:, k, None] for k in range(3))
    return np.asarray(so3.exp(yaw * Z) @ so3.exp(pitch * Y) @ so3.exp(roll * X))


def angles_of(R: Array) -> Array:
    """Roll, pitch, yaw (k, 3) of rotations (k, 3, 3); where the pitch is a right angle, with the roll 0.

    Examples
    --------
    >>> angles_of(rotation_of(np.array([[0.1, -0.2, 3.0]]))).round(12).tolist()
    [[0.1, -0.2, 3.0]]
    """
    pitch = np.arctan2(-R[:, 2, 0], np.hypot(R[:, 0, 0], R[:, 1, 0]))
    upright = np.hypot(R[:, 2, 1], R[:, 2, 2]) < 1e-12
    roll = np.where(upright, 0.0, np.arctan2(R[:, 2, 1], R[:, 2, 2]))
    yaw = np.where(upright, np.arctan2(-R[:, 0, 1], R[:, 1, 1]), np.arctan2(R[:, 1, 0], R[:, 0, 0]))
    return np.stack([roll, pitch, yaw], -1)


def _plane(x: Array) -> Poses:
    return Poses(x, np.zeros(len(x)))


def _space(x: Array) -> Poses:
    return Poses(se3.from_rt(rotation_of(x[:, 3:]), x[:, :3]), np.zeros(len(x)))


by_blocks = ordered(3, TORO_ROWS, TORO_COLUMNS)
VERTICES = {
    **dict.fromkeys(("VERTEX2", "VERTEX"), Kind("toro", "se2", PLANE, _plane)),
    "VERTEX3": Kind("toro", "se3", SPACE, _space),
}
ENTRIES = ("I11", "I12", "I22", "I33", "I13", "I23")
EDGE2 = Kind("toro", "se2", PLANE, _plane, information=by_blocks, entries=ENTRIES)
EDGES = {
    **dict.fromkeys(("EDGE2", "EDGE", "ODOMETRY"), EDGE2),
    "EDGE3": Kind("toro", "se3", SPACE, _space, information=upper(6)),
}
TAGS = {"se2": ("VERTEX2", "EDGE2"), "se3": ("VERTEX3", "EDGE3")}


def columns(space: Space, T: Array) -> Array:
    """Numbers of poses, (k, 3) or (k, 6)."""
    if space == "se2":
        return T
    return np.concatenate([T[:, :3, 3], angles_of(T[:, :3, :3])], 1)


def triangles(space: Space, information: Array) -> Array:
    """Information in TORO's order."""
    if space == "se2":
        return information[:, TORO_ROWS, TORO_COLUMNS]
    rows, across = np.triu_indices(6)
    return information[:, rows, across]
