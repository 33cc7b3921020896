"""Chapter 10: one reweighted step, and where a camera that goes on is next."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.estimation.pose_tracking import track_pose
from vslam_ref.geometry.camera_pose import DecayingVelocity
from vslam_ref.geometry.cameras import Pinhole

Array = NDArray[Any]


def _tukey_step(params: Array, X_world: Array, uv: Array, size: Array, start: Array) -> Array:
    found = track_pose(Pinhole(*params), X_world, uv, start, sigma_px=size, steps=1)
    if found.reason:
        raise ValueError(found.reason)
    return found.T_cam_world


def _predict(T_before: Array, T_now: Array, decay: float) -> Array:
    model = DecayingVelocity(np.zeros(6), float(decay), 1.0).update(T_before, T_now)
    return model.predict(T_now)


TABLE: Answers = {"tracking.tukey_step": _tukey_step, "tracking.predict": _predict}
