"""The improved EKF of seed B: EKF-SLAM on a second-order Carleman lift of the state.

The paper writes "IEKF" for *improved* EKF.  It is neither the invariant nor the iterated EKF.

The lift (``lift``) replaces the angle by its sine and cosine and adds their products with the
positions, 11 vehicle states and 6 per landmark.  In these states the motion and the measurement are
linear, given the control.  Two forms of the filter are offered; they share no formula of the filter:

* ``form="lifted"`` (``lifted``): the paper's matrices B16-B28 with the whole covariance of 11 + 6 n
  states; its errata can be run as printed (``lift.Variant``);
* ``form="reduced"`` (``reduced``): the same pose estimates from 4 + 2 n states, an exact reduction;
  ``form="reduced-map"`` carries the map too, 4 + 4 n states.

:mod:`.book` is both forms for one run in full matrices, to be read.
"""

from __future__ import annotations

from numpy.typing import ArrayLike

from vslam_ref.filters.carleman_ekf.lift import AS_CORRECTED, Variant
from vslam_ref.filters.carleman_ekf.lifted import LiftedCarlemanEkf
from vslam_ref.filters.carleman_ekf.reduced import ReducedCarlemanEkf

FORMS = ("lifted", "reduced", "reduced-map")
MOMENTS = ("first_order", "gaussian")

__all__ = [
    "AS_CORRECTED",
    "FORMS",
    "MOMENTS",
    "LiftedCarlemanEkf",
    "ReducedCarlemanEkf",
    "Variant",
    "carleman_ekf",
]


def carleman_ekf(
    mean: ArrayLike,
    cov: ArrayLike,
    form: str = "reduced",
    capacity: int = 32,
    start: str = "first_order",
    control: str = "first_order",
) -> LiftedCarlemanEkf | ReducedCarlemanEkf:
    """Build the improved EKF of seed B in the form asked for.

    Parameters
    ----------
    mean, cov : array_like, shapes (3,) or (B, 3), and (3, 3) or (B, 3, 3)
        Start pose (x, y, theta) and its covariance.
    form : {"reduced", "reduced-map", "lifted"}
    capacity : int
        Landmarks to make room for at first.
    start, control : {"first_order", "gaussian"}
        How P0 and the control noise are lifted: by the Jacobian, or by the exact moments of a Gaussian.
    """
    if form not in FORMS:
        raise ValueError(f"form={form!r}: must be one of {', '.join(FORMS)}")
    if form == "lifted":
        return LiftedCarlemanEkf(mean, cov, capacity, start=start, control=control)
    return ReducedCarlemanEkf(
        mean, cov, capacity, start=start, control=control, with_map=form == "reduced-map"
    )
