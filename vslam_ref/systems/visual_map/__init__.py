"""Floor 4: a map of keyframes and points that visual systems share."""

from vslam_ref.systems.visual_map.adjusting import Adjusted, adjust, adjust_with_camera, local_active
from vslam_ref.systems.visual_map.keyframe_map import KeyframeMap, neighbours, shared_points
from vslam_ref.systems.visual_map.measure import Located, Looks, look
from vslam_ref.systems.visual_map.visibility import Visible, templates, visible
from vslam_ref.systems.visual_map.visual_map import PreparedPicture, VisualMap

__all__ = [
    "Adjusted",
    "KeyframeMap",
    "Looks",
    "Located",
    "PreparedPicture",
    "Visible",
    "VisualMap",
    "adjust",
    "adjust_with_camera",
    "local_active",
    "look",
    "neighbours",
    "shared_points",
    "templates",
    "visible",
]
