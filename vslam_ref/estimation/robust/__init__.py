"""Robust loss: how much one error may cost, and how strongly it may pull.

A residual x, in units of its scale sigma, costs rho(x).  Everything else follows from rho:

==================  ==================  ==========================================================
name                formula             meaning
==================  ==================  ==========================================================
cost                rho(x)              what is minimised; half a square for small errors
influence           psi(x) = rho'(x)    how strongly one error pulls at the estimate
weight              w(x) = psi(x)/x     its factor in reweighted least squares
root of the weight  sqrt(w)             what a row of residual and Jacobian is multiplied by
curvature           rho''(x)            what Newton's method would use in place of w
==================  ==================  ==========================================================

==================  ===========================================================================
module              holds
==================  ===========================================================================
``losses``          L2, Huber, Cauchy, Geman-McClure, Tukey (A2.8)
``as_printed``      A2.8 taken as a loss, as printed: runnable, and wrong
``scale``           sigma from the median of the errors themselves; small samples
``efficiency``      what robustness costs when all errors are honest; 95 % constants
``conventions``     the same losses in the forms of Ceres, SciPy, GTSAM, OpenCV and PTAM
==================  ===========================================================================
"""

from vslam_ref.estimation.robust.as_printed import TukeyAsPrinted
from vslam_ref.estimation.robust.efficiency import TUNED_95, covariance_factor, efficiency, tuned
from vslam_ref.estimation.robust.losses import L2, LOSSES, Cauchy, GemanMcClure, Huber, Loss, Tukey
from vslam_ref.estimation.robust.scale import (
    MAD_1D,
    MAD_NORM_2D,
    Scale,
    mad_scale,
    norm_scale,
    small_sample_factor,
)

__all__ = [
    "L2",
    "LOSSES",
    "MAD_1D",
    "MAD_NORM_2D",
    "TUNED_95",
    "Cauchy",
    "GemanMcClure",
    "Huber",
    "Loss",
    "Scale",
    "Tukey",
    "TukeyAsPrinted",
    "covariance_factor",
    "efficiency",
    "mad_scale",
    "norm_scale",
    "small_sample_factor",
    "tuned",
]
