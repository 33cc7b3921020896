"""Floor 2: what can be found again in an image.

==================  =================================================================================
module              holds
==================  =================================================================================
``levels``          levels of 2 x 2 means, and the half pixel between them
``fast``            FAST-9 to FAST-12, exact, with the largest threshold as score
``corners``         :class:`Corners` in row order; peaks; the smaller eigenvalue of Shi and Tomasi
``templates``       8 x 8 patches, seen through an affine map
``patch_search``    the corner that looks most like a template: ZMSSD or ZNCC
``refinement``      between the pixels: inverse compositional, with an offset of brightness
``following``       points from image to image, and back as a check
``hamming``         binary descriptors: bits that differ, and pairs
``guided``          pairs near predicted places
``orb``             corners of all scales with a direction and 256 bits each
``freak``           512 bits of key points of any scale, from 43 fields like a retina's
``small_images``    a tiny blurred image, and how the camera turned between two of them
``book``            the same in plain loops, as chapter 08 reads it
==================  =================================================================================

An image is ``uint8`` of shape (H, W).  Pixels are (x, y), x to the right, y down, (0, 0) the *centre* of the
top-left pixel; whole ones are called ``xy``, others ``uv``.  This room reads no files: images are given.
No module has the name of a function: ``from vslam_ref.features import search`` is the function.
"""

from vslam_ref.features.corners import Corners, detect, is_peak, shi_tomasi
from vslam_ref.features.fast import corner_score, segment_test
from vslam_ref.features.following import Followed, View, follow
from vslam_ref.features.levels import finest_from_level, halve, level_from_finest, level_sigma, pyramid
from vslam_ref.features.patch_search import Found, search, zmssd, zncc
from vslam_ref.features.refinement import Refined, State, refine
from vslam_ref.features.small_images import (
    PlaneMotion,
    SmallImage,
    moved_by,
    plane_motion,
    rotation,
    small_image,
)
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
    "moved_by",
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
