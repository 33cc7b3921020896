"""g2o's text: what its lines say, and how they are written.

::

    VERTEX_SE2 id x y theta                       EDGE_SE2 i j x y theta  I11 I12 I13 I22 I23 I33
    VERTEX_SE3:QUAT id x y z qx qy qz qw          EDGE_SE3:QUAT i j ...  21 numbers, row by row
    VERTEX_SIM3:QUAT id x y z qx qy qz qw s       EDGE_SIM3:QUAT i j ...  28 numbers
    VERTEX_SIM3:EXPMAP id w(3) v(3) log-scale     EDGE_SIM3:EXPMAP i j w(3) v(3) log-scale  28 numbers
    FIX id ...

A pose is T_world_id, an edge T_i_j; the information is that of the error, in the order of the columns.  Of
SIM3:EXPMAP the file has the logarithm with the rotation first (its vertex lines may end in four numbers of a
camera).  g2o keeps the inverses of both in memory, which turns nothing around in the file.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.pose_graph_files.lines import Kind, Poses, unit_quaternions, upper
from vslam_ref.estimation.posegraph.spaces import Space
from vslam_ref.geometry import quaternion, se3, sim3

ROTATION_FIRST = np.array([3, 4, 5, 0, 1, 2, 6])
"""Where the house's (translation, rotation, log-scale) stand in g2o's order; its own inverse."""
SE2 = ("x", "y", "theta")
SE3 = ("x", "y", "z", "qx", "qy", "qz", "qw")
SIM3 = (*SE3, "scale")
EXPMAP = ("w1", "w2", "w3", "v1", "v2", "v3", "log-scale")
CAMERA = ("f1", "f2", "c1", "c2")


def _plane(x: Array) -> Poses:
    return Poses(x, np.zeros(len(x)))


def _rigid(x: Array) -> Poses:
    q, off = unit_quaternions(x[:, [6, 3, 4, 5]])
    return Poses(se3.from_rt(quaternion.matrix(q), x[:, :3]), off)


def _similar(x: Array) -> Poses:
    q, off = unit_quaternions(x[:, [6, 3, 4, 5]])
    scale = x[:, 7]
    good = scale > 0
    found = sim3.from_srt(np.where(good, scale, 1.0), quaternion.matrix(q), x[:, :3])
    return Poses(found, np.where(good, off, np.nan))


def _from_log(x: Array) -> Poses:
    xi = x[:, ROTATION_FIRST]
    xi[:, 6] = np.clip(xi[:, 6], -9.0, 9.0)  # beyond 8 the reader refuses it
    return Poses(sim3.exp(xi), np.zeros(len(x)))


def _reordered(values: Array) -> Array:
    full = upper(7)(values)
    return full[:, ROTATION_FIRST][:, :, ROTATION_FIRST]


VERTICES = {
    "VERTEX_SE2": Kind("g2o", "se2", SE2, _plane),
    "VERTEX_SE3:QUAT": Kind("g2o", "se3", SE3, _rigid),
    "VERTEX_SIM3:QUAT": Kind("g2o", "sim3", SIM3, _similar),
    "VERTEX_SIM3:EXPMAP": Kind("g2o", "sim3", EXPMAP, _from_log, CAMERA),
}
EDGES = {
    "EDGE_SE2": Kind("g2o", "se2", SE2, _plane, information=upper(3)),
    "EDGE_SE3:QUAT": Kind("g2o", "se3", SE3, _rigid, information=upper(6)),
    "EDGE_SIM3:QUAT": Kind("g2o", "sim3", SIM3, _similar, information=upper(7)),
    "EDGE_SIM3:EXPMAP": Kind("g2o", "sim3", EXPMAP, _from_log, information=_reordered),
}
FIX = "FIX"


def columns(space: Space, T: Array) -> Array:
    """Numbers of poses in g2o's order, (k, 3), (k, 7), or (k, 7) as SIM3:EXPMAP has them."""
    if space == "se2":
        return T
    if space == "sim3":
        return np.asarray(sim3.log(T))[:, ROTATION_FIRST]
    q = quaternion.from_matrix(T[:, :3, :3])
    return np.concatenate([T[:, :3, 3], q[:, 1:], q[:, :1]], 1)


def triangles(space: Space, information: Array) -> Array:
    """Upper triangles of information matrices in g2o's order."""
    if space == "sim3":
        information = information[:, ROTATION_FIRST][:, :, ROTATION_FIRST]
    rows, across = np.triu_indices(information.shape[-1])
    return information[:, rows, across]


TAGS = {
    "se2": ("VERTEX_SE2", "EDGE_SE2"),
    "se3": ("VERTEX_SE3:QUAT", "EDGE_SE3:QUAT"),
    "sim3": ("VERTEX_SIM3:EXPMAP", "EDGE_SIM3:EXPMAP"),
}
"""What is written for each space."""


def fixed_line(ids: Iterator[int]) -> str:
    """Return the FIX line of some vertices."""
    return " ".join([FIX, *map(str, ids)])
