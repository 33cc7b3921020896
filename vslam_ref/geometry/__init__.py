"""Floor 1: rotations and rigid motions, in the plane and in space.

========================  ==========================================================================
module                    elements
========================  ==========================================================================
:mod:`.so2`               rotations of the plane, matrices (..., 2, 2)
:mod:`.se2`               rigid motions of the plane, pose vectors (..., 3)
:mod:`.so3`               rotations of space, matrices (..., 3, 3)
:mod:`.se3`               rigid motions of space, matrices (..., 4, 4)
:mod:`.sim3`              the same with a scale, matrices (..., 4, 4)
:mod:`.quaternion`        rotations of space, unit quaternions (..., 4), w first
:mod:`.camera_pose`       a camera's centre, its pose, its next pose
:mod:`.drawing`           samples of different numbers
:mod:`.multiview`         points from several views, and views from points
========================  ==========================================================================

The five groups offer the same functions under the same names.  Tangent vectors are ordered translation first,
xi = (rho, phi); perturbations act from the left, T <- Exp(xi) T.  Batch axes come first.
"""

from vslam_ref.geometry import camera_pose, quaternion, se2, se3, sim3, so2, so3

__all__ = ["camera_pose", "quaternion", "se2", "se3", "sim3", "so2", "so3"]
