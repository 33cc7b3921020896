"""Floor 4: a map of keyframes and points that visual systems share."""

from vslam_ref.systems.visual_map.adjusting import Adjusted, adjust, adjust_with_camera, local_active
from vslam_ref.systems.visual_map.measure import Located, Looks, look
from vslam_ref.systems.visual_map.visibility import Visible, templates, visible
from vslam_ref.systems.visual_map.visual_map import PreparedPicture, VisualMap, neighbours, shared_points

__all__ = [
    "Adjusted",
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
