"""Chapter 17: consistency."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.filters import vehicle
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.metrics import consistency


def _nees(error: Array, P: Array) -> float:
    found = consistency.nees(error, P)
    if found.invalid_count:
        raise ValueError("P is not positive definite")
    return float(found.value)


def _runs(N: int, x: Array, P: Array, control: Array, cov_u: Array, wheelbase: float, dt: float) -> Array:
    """One prediction in N worlds at once."""
    rng = np.random.default_rng()
    starts = x + rng.standard_normal((N, 3)) @ np.linalg.cholesky(P).T
    controls = control + rng.standard_normal((N, 2)) @ np.linalg.cholesky(cov_u).T
    truth = vehicle.propagate(starts, vehicle.ackermann(controls, wheelbase, dt))
    slam = EkfSlam(np.tile(x, (N, 1)), P)
    slam.predict(vehicle.ackermann_increment(np.tile(control, (N, 1)), cov_u, wheelbase, dt))
    return consistency.nees_pose(truth, *slam.pose()).value


TABLE: Answers = {
    "consistency.nees": _nees,
    "consistency.pose_error": lambda truth, estimate: consistency.pose_error(truth, estimate),
    "consistency.band": lambda runs, dof, confidence: dict(
        zip(("low", "high"), consistency.mean_band(runs, dof, confidence), strict=True)
    ),
    "consistency.bound": lambda runs, dof, confidence: consistency.mean_line(runs, dof, confidence),
    "consistency.runs": _runs,
}
