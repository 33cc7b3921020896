"""Chapter 04: robust losses, scales, and the noise they are made for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.estimation.robust.losses import LOSSES
from vslam_ref.estimation.robust.scale import mad_scale, norm_scale

Array = NDArray[Any]

TABLE: Answers = {
    **{
        f"loss.{what}": lambda name, c, x, what=what: getattr(LOSSES[name](c), what)(x)
        for what in ("cost", "influence", "weight")
    },
    "scale.mad": lambda errors: mad_scale(errors).sigma,
    "scale.norm": lambda errors: norm_scale(errors).sigma,
    "noise.gaussian": lambda N, sigma: sigma * np.random.default_rng().standard_normal(int(N)),
}
