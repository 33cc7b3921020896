"""Several views of one scene: from poses to points, and from points to poses.

=======================  ==========================================================================
module                   holds
=======================  ==========================================================================
``book``                 the algorithms for one point or camera, to be read
``views``                cameras and poses as arrays over views; rays and pixels of all of them
``epipolar``             what a point in one image says about the other
``closest_point``        where two rays pass closest, with exact Jacobians
``triangulation``        points from any number of views, by linear equations
``two_view_optimum``     the global optimum for two views, from a polynomial of degree six
``three_points``         every camera that sees three points where they were seen (P3P)
``resection``            a camera from six points and more, or four of a plane, by linear equations
``triples``              a camera from the best of many triples of points
``point_shape``          how wide, thin and stretched a set of points is; which points are far
``linear_pose``          the answer of these methods, and why there may be none
=======================  ==========================================================================

Point sets are aligned by :mod:`vslam_ref.geometry.alignment`.  What minimises a cost in pixels is one floor
up: points in :mod:`vslam_ref.estimation.triangulation`, poses in :mod:`vslam_ref.estimation.resection`.
"""

from vslam_ref.geometry.alignment import Alignment, align
from vslam_ref.geometry.multiview import book, three_points
from vslam_ref.geometry.multiview.closest_point import midpoint, midpoint_with_jacobians
from vslam_ref.geometry.multiview.epipolar import (
    epipolar_distance,
    essential_from_motion,
    fundamental_from_essential,
    relative_motion,
    sampson_distance,
)
from vslam_ref.geometry.multiview.linear_pose import LinearPose, PoseState
from vslam_ref.geometry.multiview.point_shape import nearness
from vslam_ref.geometry.multiview.point_state import PointState
from vslam_ref.geometry.multiview.resection import (
    dlt,
    planar_dlt,
    resect_linear,
    tilted_twin,
)
from vslam_ref.geometry.multiview.three_points import ThreePointPoses, p3p
from vslam_ref.geometry.multiview.triangulation import LinearPoints, triangulate_linear
from vslam_ref.geometry.multiview.triples import best_of_three
from vslam_ref.geometry.multiview.two_view_optimum import CorrectedPair, correct_pair
from vslam_ref.geometry.multiview.views import Views

__all__ = [
    "Alignment",
    "CorrectedPair",
    "LinearPoints",
    "LinearPose",
    "PointState",
    "PoseState",
    "ThreePointPoses",
    "Views",
    "align",
    "best_of_three",
    "book",
    "correct_pair",
    "dlt",
    "epipolar_distance",
    "essential_from_motion",
    "fundamental_from_essential",
    "midpoint",
    "midpoint_with_jacobians",
    "nearness",
    "p3p",
    "planar_dlt",
    "relative_motion",
    "resect_linear",
    "sampson_distance",
    "three_points",
    "tilted_twin",
    "triangulate_linear",
]
