"""filterpy under the vectors (an optional wheel): its extended Kalman filter, and its NEES.

The filter wants F, Q, H and h from its user: :mod:`.motion_models`.  It knows no new landmarks and no angles,
so there is no ``ekf.augment``, and the heading is wrapped here.
"""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np
from motion_models import drive, heading_wrapped, sight
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers, answer_from

Array = NDArray[np.float64]


def answer(function: str, inputs: dict[str, Any]) -> Any:
    """Answer one question with filterpy."""
    if importlib.util.find_spec("filterpy") is None:
        raise NotImplementedError("filterpy is not installed")
    return answer_from(TABLE, function, inputs)


def _filter(x: Array, P: Array, measured: int) -> Any:
    from filterpy.kalman import ExtendedKalmanFilter

    kalman = ExtendedKalmanFilter(dim_x=len(x), dim_z=measured)
    kalman.x, kalman.P = x.copy(), P.copy()
    return kalman


def _predict(x: Array, P: Array, control: Array, cov_u: Array, wheelbase: float, dt: float) -> dict[str, Any]:
    moved, F, Q = drive(x, control, cov_u, wheelbase, dt)
    kalman = _filter(x, P, 2)
    kalman.F, kalman.Q = F, Q
    kalman.predict_x = lambda u=0: setattr(kalman, "x", moved)  # the documented way: its own is F x
    kalman.predict()
    return {"x": kalman.x, "P": kalman.P}


def _update(x: Array, P: Array, ids: Array, z: Array, cov_z: Array) -> dict[str, Any]:
    kalman = _filter(x, P, 2 * len(ids))
    kalman.R = np.kron(np.eye(len(ids)), cov_z)
    kalman.update(z.ravel(), lambda s: sight(s, ids)[1], lambda s: sight(s, ids)[0])
    return {"x": heading_wrapped(kalman.x), "P": kalman.P}


def _nees(error: Array, P: Array) -> float:
    from filterpy.stats import NEES

    return float(NEES(error[None], 0.0 * error[None], P[None])[0])


TABLE: Answers = {"ekf.predict": _predict, "ekf.update": _update, "consistency.nees": _nees}
