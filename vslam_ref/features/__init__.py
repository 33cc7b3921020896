"""Floor 2: what can be found again in an image.

==================  =================================================================================
module              holds
==================  =================================================================================
``pyramid``         levels of 2 x 2 means, and the half pixel between them
``segment_test``    FAST-9 to FAST-12, exact, with the largest threshold as score
``corners``         :class:`Corners` in row order; peaks; the smaller eigenvalue of Shi and Tomasi
``templates``       8 x 8 patches, seen through an affine map
``search``          the corner that looks most like a template: ZMSSD or ZNCC
``refine``          between the pixels: inverse compositional, with an offset of brightness
``follow``          points from image to image, and back as a check
``small_image``     a tiny blurred image, and how the camera turned between two of them
``book``            the same in plain loops, as chapter 08 reads it
==================  =================================================================================

An image is ``uint8`` of shape (H, W).  Pixels are (x, y), x to the right, y down, (0, 0) the *centre* of the
top-left pixel; whole ones are called ``xy``, others ``uv``.  This room reads no files: images are given.
"""

from vslam_ref.features.corners import Corners, detect, is_peak, shi_tomasi
from vslam_ref.features.follow import Followed, View, follow
from vslam_ref.features.pyramid import finest_from_level, halve, level_from_finest, level_sigma, pyramid
from vslam_ref.features.refine import Refined, State, refine
from vslam_ref.features.search import Found, search, zmssd, zncc
from vslam_ref.features.segment_test import corner_score, segment_test
from vslam_ref.features.small_image import PlaneMotion, SmallImage, plane_motion, rotation, small_image
from vslam_ref.features.templates import Templates, cut, sampling, search_level, warp

__all__ = [
    "Corners",
    "Followed",
    "Found",
    "PlaneMotion",
    "Refined",
    "SmallImage",
    "State",
    "Templates",
    "View",
    "corner_score",
    "cut",
    "detect",
    "finest_from_level",
    "follow",
    "halve",
    "is_peak",
    "level_from_finest",
    "level_sigma",
    "plane_motion",
    "pyramid",
    "refine",
    "rotation",
    "sampling",
    "search",
    "search_level",
    "segment_test",
    "shi_tomasi",
    "small_image",
    "warp",
    "zmssd",
    "zncc",
]
