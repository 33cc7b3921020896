"""Landmarks taken from what stays, and a robot that localises by them while people walk about (A4.4).

====================  ==============================================================================
module                holds
====================  ==============================================================================
``lines``             corners in one scan: straight runs, their crossings, covariances
``map_corners``       corners of S itself, weighted by its probabilities
``association``       gates, signatures, look-alikes
``landmark_map``      how landmarks are chosen, and how a bad choice is found out and withdrawn
``field``             distances to what is static, with slopes
``matching``          a scan against a map: correlative search, then Gauss-Newton
``pose_update``       a match given to a filter that also holds landmarks
====================  ==============================================================================

The whole loop of pose, S, D and landmarks is :mod:`vslam_ref.systems.grid_slam`; its filter is
:class:`vslam_ref.filters.ekf_slam.EkfSlam`.  innovation = measured - predicted.
"""

from vslam_ref.grids.landmarks.association import Association, Signature, associate, gate, look_alike
from vslam_ref.grids.landmarks.field import DistanceField, distance_field, sample, scan_residuals
from vslam_ref.grids.landmarks.landmark_map import Landmark, LandmarkConfig, LandmarkMap, seen_through
from vslam_ref.grids.landmarks.lines import CornerConfig, ScanCorners, cross, scan_corners
from vslam_ref.grids.landmarks.map_corners import MapCornerConfig, MapCorners, map_corners, static_along_arms
from vslam_ref.grids.landmarks.matching import Match, MatchConfig, correlative, match_scan, thin

__all__ = [
    "Association",
    "CornerConfig",
    "ScanCorners",
    "DistanceField",
    "Landmark",
    "LandmarkConfig",
    "LandmarkMap",
    "MapCornerConfig",
    "MapCorners",
    "Match",
    "MatchConfig",
    "Signature",
    "associate",
    "correlative",
    "cross",
    "distance_field",
    "gate",
    "look_alike",
    "map_corners",
    "match_scan",
    "sample",
    "scan_corners",
    "scan_residuals",
    "seen_through",
    "static_along_arms",
    "thin",
]
