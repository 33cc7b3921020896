"""Bundle adjustment: poses, points and intrinsics from everything that was seen, at once.

The smallest sum of reprojection errors is found by Levenberg-Marquardt.  A point meets only the views that
see it, so the points are eliminated first (Schur complement), and a system of the views remains.

====================  ============================================================================
module                holds
====================  ============================================================================
``problem``           scene, observations, covariances, what may move
``families``          lenses of several families: a block of the intrinsics for each
``projection``        residuals and Jacobians of all observations
``structure``         orders and columns: which view meets which at a point
``normal``            the blocks of the normal equations
``schur``             points eliminated, and back again
``reduced_system``    the system of the views: dense or banded Cholesky
``weights``           robust loss, fixed or adaptive scale
``adjustment``        what a descent asks: one damped step, and where it leads
``solver``            a problem, descended
``result``            what comes back
``book``              the same algorithm in plain loops, to be read, and to be compared with
``diagnosis``         what is wrong with a problem before anything is solved
``local``             the newest views and their neighbours only
``outliers``          wrong observations found and taken out
``gauge``             the seven coordinates that no image shows
``undamped``          the normal equations at a solution
``covariance``        of chosen poses and points
``lens_covariance``   of the intrinsics that all views share
``self_calibration``  the intrinsics freed, as far as the views determine them
====================  ============================================================================
"""

from vslam_ref.estimation.bundle import book, diagnosis, gauge, local, outliers
from vslam_ref.estimation.bundle.covariance import covariance
from vslam_ref.estimation.bundle.families import Families
from vslam_ref.estimation.bundle.problem import BundleProblem, Freedom, Observations, Scene, freedom
from vslam_ref.estimation.bundle.projection import reprojection
from vslam_ref.estimation.bundle.result import BundleResult
from vslam_ref.estimation.bundle.solver import Options, bundle_adjust
from vslam_ref.estimation.bundle.weights import Robust
from vslam_ref.estimation.least_squares import Iteration

__all__ = [
    "BundleProblem",
    "BundleResult",
    "Families",
    "Freedom",
    "Iteration",
    "Observations",
    "Options",
    "Robust",
    "Scene",
    "book",
    "bundle_adjust",
    "covariance",
    "diagnosis",
    "freedom",
    "gauge",
    "local",
    "outliers",
    "reprojection",
]
