"""Is a filter's covariance honest?  Consistency statistics of Monte Carlo runs.

A filter is *consistent* when its errors e and the covariances P it reports fit together.  For a
Gaussian error of covariance P in d dimensions ``e^T P^-1 e`` is chi-squared with d degrees of
freedom, so its mean over many independent runs must stay near d.

============================  =====================================================================
module                        holds
============================  =====================================================================
``book``                      all of it in plain loops, to be read
``nees``                      the normalised square of one error: pose, SE(2) logarithm, lifted
                              (singular) coordinates, innovations
``bands``                     what the mean over runs may do: chi-squared lines and bands, and
                              summaries of a whole curve (its maximum, its share above a line)
``bootstrap``                 how far a finding is from chance: resampling of whole runs
============================  =====================================================================

Whole runs are the only samples.  Two time points of one run are not independent of each other (the
error of the start is carried along), so neither a curve's points nor its crossings may be counted
as separate trials.
"""

from vslam_ref.metrics.consistency.bands import (
    Band,
    detectable_inflation,
    fraction_above,
    mean_band,
    mean_line,
    time_maximum,
    window_mean,
)
from vslam_ref.metrics.consistency.bootstrap import (
    Share,
    bootstrap_interval,
    mean_curves,
    percentile_interval,
    resample_weights,
    sample_band,
    share,
    share_interval,
    subset_weights,
)
from vslam_ref.metrics.consistency.nees import (
    NormalisedSquare,
    nees,
    nees_singular,
    nis,
)
from vslam_ref.metrics.consistency.pose_nees import (
    heading_vector_error,
    nees_pose,
    nees_se2,
    pose_error,
)

__all__ = [
    "Band",
    "NormalisedSquare",
    "Share",
    "bootstrap_interval",
    "detectable_inflation",
    "fraction_above",
    "heading_vector_error",
    "mean_band",
    "mean_curves",
    "mean_line",
    "nees",
    "nees_pose",
    "nees_se2",
    "nees_singular",
    "nis",
    "percentile_interval",
    "pose_error",
    "resample_weights",
    "sample_band",
    "share",
    "share_interval",
    "subset_weights",
    "time_maximum",
    "window_mean",
]
