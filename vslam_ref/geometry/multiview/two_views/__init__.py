r"""Two pictures of one camera: how it moved between them, and whether they tell it at all.

======================  ===========================================================================
module                  holds
======================  ===========================================================================
``book``                the algorithms for one pair of pictures, to be read
``eight_point``         ``linear_essential``, ``linear_fundamental``, ``nearest_essential``
``five_point``          ``five_point_essentials``: all essential matrices of many samples of five
``seven_point``         ``seven_point_fundamentals``: one or three of seven pairs, without a camera
``homography``          ``fit_homography``, ``apply_homography``, ``plane_homography``
``decompose``           ``essential_motions`` (four), ``homography_motions`` (two, with normals)
``sampson_distance``    signed distances: ``sampson``, ``sampson_with_jacobians`` of a relative pose and its
                        five numbers, ``perturb``, ``essential_sampson``, ``homography_sampson``
``in_front``            ``cheirality``: squared distance of a pair from the nearest point in front; ``depths``
``consensus``           ``essential_consensus``, ``fundamental_consensus``, ``homography_consensus``: samples,
                        MSAC, adaptive ``Draws``
``choice``              ``choose``: the cheapest of several motions, its rivals, or why it is refused
``degenerate``          ``degeneracy``: no parallax, pure rotation, a plane, or none of them
======================  ===========================================================================

**One way through.**  Everything works in normalised positions ``xn (N, 2)``: pixels through the inverse of
the lens (:meth:`~vslam_ref.geometry.cameras.Camera.unproject`, divided by the third coordinate).
``sigma`` is the standard deviation of one coordinate in this unit: pixels over the focal length.  Costs
are per pair, in units of :math:`\sigma^2`; with ``sigma = 1 / f`` they are squared pixels::

    E = essential_consensus(xn_a, xn_b, rng, sigma=sigma)           # .model, .inliers, .cost, .reason
    H = homography_consensus(xn_a, xn_b, rng, sigma=sigma)
    motions = essential_motions(E.model)                            # (4, 4, 4) T_b_a, |t| = 1
    planes = homography_motions(H.model, xn_a[H.inliers])           # .T_b_a (2, 4, 4), .normal, .possible
    found = choose([*motions, *planes.T_b_a], names, xn_a, xn_b, sigma=sigma)  # .T_b_a, .cost, .rivals

Refining each motion on its Sampson distances, five numbers, iterates over the measurements, and so stands one
floor up: :mod:`vslam_ref.estimation.relative_pose`; its ``estimate_motion`` is this whole way with the
refinement. A numeric failure is a ``reason``, empty where all is well; input that makes no sense raises
ValueError.
"""

from vslam_ref.geometry.multiview.two_views.choice import Choice, apart, choose
from vslam_ref.geometry.multiview.two_views.consensus import (
    Consensus,
    Draws,
    draws_needed,
    essential_consensus,
    fundamental_consensus,
    homography_consensus,
    truncated_cost,
)
from vslam_ref.geometry.multiview.two_views.decompose import (
    PlanarMotions,
    essential_motions,
    homography_motions,
)
from vslam_ref.geometry.multiview.two_views.degenerate import (
    Degeneracy,
    Verdict,
    best_rotation,
    degeneracy,
    torr_criterion,
)
from vslam_ref.geometry.multiview.two_views.eight_point import (
    LinearEssential,
    linear_essential,
    linear_fundamental,
    nearest_essential,
)
from vslam_ref.geometry.multiview.two_views.five_point import FivePointEssentials, five_point_essentials
from vslam_ref.geometry.multiview.two_views.homography import (
    apply_homography,
    fit_homography,
    plane_homography,
)
from vslam_ref.geometry.multiview.two_views.in_front import Cheirality, cheirality, depths
from vslam_ref.geometry.multiview.two_views.sampson_distance import (
    SampsonJacobians,
    essential_sampson,
    homography_sampson,
    homography_squared,
    perturb,
    sampson,
    sampson_with_jacobians,
)
from vslam_ref.geometry.multiview.two_views.seven_point import SevenPointMatrices, seven_point_fundamentals

__all__ = [
    "Cheirality",
    "Choice",
    "Consensus",
    "Degeneracy",
    "Draws",
    "FivePointEssentials",
    "LinearEssential",
    "PlanarMotions",
    "SampsonJacobians",
    "SevenPointMatrices",
    "Verdict",
    "apart",
    "apply_homography",
    "best_rotation",
    "cheirality",
    "choose",
    "degeneracy",
    "depths",
    "draws_needed",
    "essential_consensus",
    "essential_motions",
    "essential_sampson",
    "fit_homography",
    "five_point_essentials",
    "fundamental_consensus",
    "homography_consensus",
    "homography_motions",
    "homography_sampson",
    "homography_squared",
    "linear_essential",
    "linear_fundamental",
    "nearest_essential",
    "perturb",
    "plane_homography",
    "sampson",
    "sampson_with_jacobians",
    "seven_point_fundamentals",
    "torr_criterion",
    "truncated_cost",
]
