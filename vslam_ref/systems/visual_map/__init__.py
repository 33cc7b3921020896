"""Floor 4: a map of keyframes and points that visual systems share."""

from vslam_ref.systems.visual_map.adjust import Adjusted, adjust, local_active
from vslam_ref.systems.visual_map.measure import Looks, Measured, look
from vslam_ref.systems.visual_map.visibility import Visible, templates, visible
from vslam_ref.systems.visual_map.visual_map import Picture, VisualMap, neighbours, shared_points

__all__ = [
    "Adjusted",
    "Looks",
    "Measured",
    "Picture",
    "Visible",
    "VisualMap",
    "adjust",
    "local_active",
    "look",
    "neighbours",
    "shared_points",
    "templates",
    "visible",
]
