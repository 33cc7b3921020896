"""Small pose graph files in every format, and what a right record of one is."""

from __future__ import annotations

import numpy as np

from vslam_ref.datasets.pose_graph_files import PoseGraphFile
from vslam_ref.estimation.posegraph import chordal_start, odometry_start, solve_graph
from vslam_ref.estimation.posegraph.spaces import rotations

SE2 = """\
VERTEX_SE2 0 0 0 0
VERTEX_SE2 1 1.02 0.01 1.56
VERTEX_SE2 2 1.01 0.97 3.13
VERTEX_SE2 3 0.02 1.03 -1.58
FIX 0
EDGE_SE2 0 1 1 0 1.57 50 2 0 50 0 100
EDGE_SE2 1 2 1 0 1.57 50 -2 1 50 0 100
EDGE_SE2 2 3 1 0 1.57 50 0 0 50 0 100
EDGE_SE2 3 0 1.1 0.1 1.5 5 0 0 5 0 10
"""
SE3 = """\
VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1
VERTEX_SE3:QUAT 1 1 0 0.1 0 0 0.70711 0.70711
VERTEX_SE3:QUAT 2 1 1 0.2 0 0 1 0
EDGE_SE3:QUAT 0 1 1 0 0.1 0 0 0.70711 0.70711 10 0 0 0 0 1 10 0 0 0 0 10 0 0 0 40 0 0 40 0 40
EDGE_SE3:QUAT 1 2 1 0 0.1 0 0.01 0.7071 0.70711 10 0 0 0 0 0 10 0 0 0 0 10 0 0 0 40 0 0 40 0 40
EDGE_SE3:QUAT 0 2 1 1.1 0.2 0.01 0 1 0 10 0 0 0 0 0 10 0 0 0 0 10 0 0 0 40 0 0 40 0 40
"""
TORO2 = """\
VERTEX2 0 0 0 0
VERTEX2 1 0.995 0.08 0.015
VERTEX2 2 1.99 0.1 0.02
EDGE2 1 0 -0.998 0.04 -0.008 1 0.1 1 1 0 0
EDGE2 2 1 -1.003 0.02 -0.006 1 0 1 1 0 0.2
EDGE2 2 0 -2.0 0.06 -0.014 1 0 1 1 0 0
EQUIV 2 0
"""
TORO3 = """\
VERTEX3 0 0 0 0 0 0 0
VERTEX3 1 1 0 0.1 0.1 -0.1 1.5
EDGE3 0 1 1 0 0.1 0.1 -0.1 1.5 10 0 0 0 0 0 10 0 0 0 0 10 0 0 0 100 0 0 100 0 25
EDGE3 1 2 1 0 0.1 0.0 -0.1 1.5 10 0 0 0 0 0 10 0 0 0 0 10 0 0 0 100 0 0 100 0 25
"""
_28 = " ".join("1" if i == j else "0" for i in range(7) for j in range(i, 7))
SIM3 = f"""\
VERTEX_SIM3:QUAT 4 0 0 0 0 0 0 1 1
VERTEX_SIM3:QUAT 9 1 0 0 0 0 0.1 0.995 1.1
EDGE_SIM3:QUAT 4 9 1 0 0 0 0 0.1 0.995 1.1 {_28}
"""
EXPMAP = f"""\
VERTEX_SIM3:EXPMAP 0 0 0 0 0 0 0 0 1 1 0 0
VERTEX_SIM3:EXPMAP 1 0.1 0.2 0.3 1 2 3 0.05 1 1 0 0
EDGE_SIM3:EXPMAP 0 1 0.1 0.2 0.3 1 2 3 0.05 {_28}
"""
TEXTS = {"se2": SE2, "se3": SE3, "toro2": TORO2, "toro3": TORO3, "sim3": SIM3, "expmap": EXPMAP}


def pose_graph_wrong(file: PoseGraphFile) -> str:
    """Rotations are rotations, ids go up, and the graph can be begun and solved without a complaint."""
    graph = file.graph
    for T in (graph.T_world, graph.measured):
        R = rotations(graph.space, T)
        if len(R) and np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(R.shape[-1])).max() > 1e-9:
            return "a rotation is none"
    if not (np.diff(file.ids) > 0).all():
        return "ids do not go up"
    starts = [odometry_start(graph)]
    try:
        starts.append(chordal_start(graph))
    except ValueError as error:  # information of one edge 1e30 times that of another
        if "its system is singular" not in str(error):
            raise
    for start in starts:
        if not np.isfinite(start).all():
            return "a start is not finite"
        found = solve_graph(graph.at(start))
        if not np.isfinite(found.graph.T_world).all():
            return "a solution is not finite"
    return ""
