"""Floor 1: rotations and rigid motions of the plane (of space: in later chapters).

Tangent vectors are ordered translation first, xi = (rho, phi); perturbations act from the left,
T <- Exp(xi) T.  Batch axes come first.
"""

from vslam_ref.geometry import se2, so2

__all__ = ["se2", "so2"]
