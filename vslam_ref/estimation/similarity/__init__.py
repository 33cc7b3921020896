"""The similarity between two keyframes that saw the same points: what closes a loop.

Each keyframe has its own idea of where the points are, in its own frame and with its own unit of length.  The
two differ by a similarity; some of the matches are wrong.

=============  ======================================================================================
module         holds
=============  ======================================================================================
``matches``    points of two keyframes, and how far a similarity sends them from where both saw them
``estimate``   samples of three points, the best one refined by reprojection, and who agrees with it
``book``       the same algorithm, one match after another, to be read and to be compared with
=============  ======================================================================================
"""

from vslam_ref.estimation.similarity import book
from vslam_ref.estimation.similarity.estimate import (
    DRAWS,
    SimilarityEstimate,
    estimate_similarity,
    refine_similarity,
)
from vslam_ref.estimation.similarity.matches import (
    LIMIT,
    PointMatches,
    agreeing,
    both_images,
    both_images_with_jacobians,
    distance_ratio,
    distance_ratio_with_jacobians,
    squared,
)

__all__ = [
    "DRAWS",
    "LIMIT",
    "PointMatches",
    "SimilarityEstimate",
    "agreeing",
    "book",
    "both_images",
    "both_images_with_jacobians",
    "distance_ratio",
    "distance_ratio_with_jacobians",
    "estimate_similarity",
    "refine_similarity",
    "squared",
]
