"""Pose graphs: poses from what was measured between them.

Each edge says where one pose stands as seen from another, and how sure it is.  The poses that agree best with
all edges are found by Levenberg-Marquardt, on the sparse system that the edges span.

=================  ==================================================================================
module             holds
=================  ==================================================================================
``spaces``         SE(2), SE(3) and Sim(3) by their names
``graph``          nodes and edges as arrays; loops, parts, what is fixed
``errors``         the error of an edge, in two conventions, with Jacobians
``switching``      losses that tell false loops: switches, dynamic covariance scaling, a mixture
``pattern``        which blocks there are, the order of elimination, the sums
``fronts``         which columns are eliminated together; the solution of the sparse system
``system``         what a descent asks: one damped step, and where it leads
``solver``         a graph, descended; without the edges that were found to be false
``solution``       what may be asked of it, and what it answers
``starts``         poses to begin with: along the odometry, or by the chordal relaxation
``uncertainty``    covariances of chosen poses
``book``           the same algorithm in dense matrices, to be read, and to be compared with
=================  ==================================================================================
"""

from vslam_ref.estimation.posegraph import book, errors, spaces, starts, switching, uncertainty
from vslam_ref.estimation.posegraph.graph import PoseGraph
from vslam_ref.estimation.posegraph.solution import GraphSolution, Options
from vslam_ref.estimation.posegraph.solver import solve_graph
from vslam_ref.estimation.posegraph.starts import chordal_start, odometry_start
from vslam_ref.estimation.posegraph.uncertainty import marginal_covariances

__all__ = [
    "GraphSolution",
    "Options",
    "PoseGraph",
    "book",
    "chordal_start",
    "errors",
    "marginal_covariances",
    "odometry_start",
    "solve_graph",
    "spaces",
    "starts",
    "switching",
    "uncertainty",
]
