"""Pose graphs of other programs, in this package's conventions.

===========  ===========================================  =======  =====================================
module       format                                       in, out  converts
===========  ===========================================  =======  =====================================
``g2o``      g2o's text: SE2, SE3:QUAT, SIM3 (2), FIX     in, out  quaternions xyzw; order of Sim(3)
``toro``     TORO's and GTSAM's text: VERTEX2, EDGE2,     in, out  order of the information in the plane;
             VERTEX3, EDGE3                                        roll, pitch, yaw
===========  ===========================================  =======  =====================================

A file may mix both, as GTSAM writes; ``reading`` goes through its lines.  Every reader answers with
:class:`PoseGraphFile`; every error is one line with file, line and what is right.  Lines of other kinds are
counted and told.  Vertices without a pose and graphs in several parts are no errors here: who solves the
graph decides.
"""

from vslam_ref.datasets.pose_graph_files.reading import read_pose_graph
from vslam_ref.datasets.pose_graph_files.record import PoseGraphFile
from vslam_ref.datasets.pose_graph_files.writing import pose_graph_text, write_pose_graph

__all__ = ["PoseGraphFile", "pose_graph_text", "read_pose_graph", "write_pose_graph"]
