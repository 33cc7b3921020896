"""ORB: corners of all scales, spread over the picture, with a direction and 256 bits each.

==================  =================================================================================
module              holds
==================  =================================================================================
``settings``        what can be chosen
``scales``          octaves: pictures that shrink by 1.2 each, and where a pixel of them lies
``candidates``      FAST-9 with a lower threshold where a cell has no corner at the higher one
``spread``          a quadtree that keeps the best of each of its leaves
``direction``       the intensity centroid
``description``     256 comparisons in the smoothed picture, turned with the direction
``pair_table``      which 256 pairs of pixels are compared, and how they were learned
``extraction``      all of it, from a picture to :class:`OrbFeatures`
==================  =================================================================================

Conventions are those of :mod:`vslam_ref.features`.  A descriptor is 32 bytes; bit k of byte j is comparison
8 j + k.  :mod:`vslam_ref.features.hamming` compares descriptors.
"""

from vslam_ref.features.orb.extraction import OrbFeatures, extract
from vslam_ref.features.orb.settings import OrbSettings

__all__ = ["OrbFeatures", "OrbSettings", "extract"]
