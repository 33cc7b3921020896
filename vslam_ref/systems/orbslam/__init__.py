"""ORB-SLAM: what PTAM does, with features that are recognised, a map that is thinned out, and a graph of it.

===================  ==============================================================================
module               holds
===================  ==============================================================================
``orbslam``          :class:`OrbSlam`: a picture in, a pose out, in a fixed order
``settings``         every number and its reason
``feature_map``      keyframes, features, points, and who shows what; covisibility
``spanning_tree``    the tree of the keyframes, and how it survives culling
``describe``         how a point looks, by all its sightings
``look``             features of a picture
``window_search``    the feature most alike in a window
``projection``       points where a pose puts them
``start``            two pictures to a first map, or why not yet
``tracker``          the pose of every picture
``policy``           which pictures become keyframes
``mapper``           what happens to these
``recognition``      places that were seen before, in pictures alone
``essential_graph``  the pairs along which the error of a loop is spread
``loops``            loop closing
``loop_settings``    its numbers
===================  ==============================================================================

A system takes pictures; it opens no files and draws nothing.
"""

from vslam_ref.systems.orbslam.orbslam import STAGES, OrbSlam
from vslam_ref.systems.orbslam.settings import Settings

KERNELS = (
    "bundle", "bundle_schur", "curves", "features", "fronts", "hamming", "orb", "points", "pose",
    "vocabulary", "windows",
)  # fmt: skip
"""Modules of compiled loops that a run needs, for those who prepare them before they look at a clock."""

__all__ = ["KERNELS", "STAGES", "OrbSlam", "Settings"]
