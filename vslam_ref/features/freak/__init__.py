r"""FREAK: 512 comparisons of the means of 43 overlapping fields, laid out like those of a retina.

A. Alahi, R. Ortiz, P. Vandergheynst: FREAK: Fast Retina Keypoint, CVPR 2012.

==================  =================================================================================
module              holds
==================  =================================================================================
``pattern``         where the fields lie, how wide they are, which 45 pairs give the direction
``sampling``        the table of sums, and the mean of a box of any place and size
``description``     direction and 512 bits of given key points
``pair_table``      which 512 pairs of fields are compared, and how they were learned
``learning``        the rule that chose them
==================  =================================================================================

**What the paper says, and what it leaves open.**  With the mean :math:`I_i` of field i at :math:`p_i`,

.. math::

    o = \frac{1}{45} \sum_{(i, j)} (I_i - I_j) \frac{p_i - p_j}{|p_i - p_j|}, \qquad
    b_k = [\, I_{i_k} > I_{j_k} \,], \quad k = 0 \dots 511 .

The paper draws 43 fields whose sizes grow exponentially with the distance from the centre and overlap; it
gives no radius.  It smooths by Gaussians in the drawing, and leaves the filter to whoever needs speed.  So
these are choices of this library, each stated where it is made: seven rings of six fields and one in the
middle, ring radii with the ratio :math:`\sqrt 2`, a field half as wide as its ring's radius, every second
ring turned by 30 degrees (``pattern``); box means, exact below a pixel (``sampling``).  Neither scale nor
direction is quantised here: the pattern is computed for each key point instead of read from a table.

Where o is zero, as in a patch of one grey level, the direction is (1, 0), angle 0.
Conventions are those of :mod:`vslam_ref.features`.  A descriptor is 64 bytes; bit k of byte j is comparison
8 j + k.  :mod:`vslam_ref.features.hamming` compares descriptors.
"""

from vslam_ref.features.freak.description import FreakFeatures, describe

__all__ = ["FreakFeatures", "describe"]
