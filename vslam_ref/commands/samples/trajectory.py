"""An estimated and a true trajectory in TUM's format."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.commands.samples import Made
from vslam_ref.datasets import trajectories
from vslam_ref.worlds.camera_flight import estimate, fly

ATE_RMSE_M = 0.05
TURN_RMSE_RAD = 0.01

README = f"""\
A camera flies two rounds of a closed curve; an estimate of its path is off by a slow drift and white noise.

format: TUM, lines 'time tx ty tz qx qy qz qw'; groundtruth.txt at 20 Hz, estimate.txt at 10 Hz
true:   the estimate has a world frame of its own. After the best rigid motion its absolute error (ATE, RMSE)
        is {ATE_RMSE_M} m exactly: what 'vslam-ref evaluate' must find."""


def make(folder: Path, rng: np.random.Generator) -> Made:
    """Write both paths."""
    truth = fly()
    found = estimate(truth.take(np.arange(0, len(truth), 2)), ATE_RMSE_M, TURN_RMSE_RAD, rng)
    trajectories.write(folder / "groundtruth.txt", truth, "tum")
    trajectories.write(folder / "estimate.txt", found, "tum")
    command = "vslam-ref evaluate samples/trajectory/estimate.txt samples/trajectory/groundtruth.txt"
    known = {"pairs": len(found), "ate_rmse": ATE_RMSE_M, "turn_rmse_rad": TURN_RMSE_RAD}
    return Made(README, (command, f"{command} --plot errors.svg"), known)
