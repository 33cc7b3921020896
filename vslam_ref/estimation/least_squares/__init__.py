"""Levenberg-Marquardt for small dense problems: minimise half the sum of squares of r(x), or of rho(r(x)).

One iteration, in this order:

1. residual r and Jacobian J at x; with a robust loss, rows multiplied by the root of their weight;
2. scale D, the lengths of the columns of J; damping lambda;
3. step: least squares of ``[J; sqrt(lambda) D] step = [-r; 0]`` by QR, never by ``J^T J``;
4. gain: what the step really won, over what the linear model promised;
5. gain > 0: go there and damp less; otherwise stay and damp more.

==================  ==========================================================================
module              holds
==================  ==========================================================================
``book``            the algorithm of the chapter, to be read
``descend``         the loop, and the reasons to end it; shared by every solver of the package
``questions``       what the loop asks of a problem
``options``         when it ends
``damping``         Nielsen's rule, Ceres' trust region, and none at all (Gauss-Newton)
``problem``         residuals and Jacobians, given or numeric; the robust loss; bad values
``linear``          the damped step by QR, and covariances
``solver``          ``minimise``: a problem, descended
``result``          what comes back: solution, reason, history
==================  ==========================================================================
"""

from vslam_ref.estimation.least_squares.damping import Ceres, Damping, Nielsen, Undamped
from vslam_ref.estimation.least_squares.descend import Descent, descend
from vslam_ref.estimation.least_squares.linear import Covariance, covariance, damped_step
from vslam_ref.estimation.least_squares.options import Options
from vslam_ref.estimation.least_squares.problem import Problem, numeric_jacobian
from vslam_ref.estimation.least_squares.questions import LinearModel, Questions, Step
from vslam_ref.estimation.least_squares.result import Iteration, Reason, Solution
from vslam_ref.estimation.least_squares.solver import minimise

__all__ = [
    "Ceres",
    "Covariance",
    "Damping",
    "Descent",
    "Iteration",
    "LinearModel",
    "Nielsen",
    "Options",
    "Problem",
    "Questions",
    "Reason",
    "Solution",
    "Step",
    "Undamped",
    "covariance",
    "damped_step",
    "descend",
    "minimise",
    "numeric_jacobian",
]
