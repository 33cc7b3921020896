"""A simulated robot among landmarks, written in MRCLAM format: reader and runner without any real data."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.datasets import mrclam
from vslam_ref.systems.slam_log import RobotCalibration, simulated
from vslam_ref.worlds import figure_eight

LANDMARKS = np.array([[0.5, 4.2], [-3.8, 0.4], [0.3, -4.0], [4.1, 0.2], [2.9, 3.1], [-2.7, -3.0]])
CALIBRATION = RobotCalibration(
    sigma_distance=0.02, sigma_turn=0.02, sigma_drift=0.02, sigma_range=0.05, sigma_bearing=0.02
)


class World(NamedTuple):
    """Times (T,), true poses (T, 3) and the folder a log of it lies in."""

    folder: Path
    times: np.ndarray
    poses: np.ndarray


@pytest.fixture
def make_world(tmp_path: Path) -> Callable[..., World]:
    """Return a writer of worlds; call it with a name, a noise (or None for none) and a seed."""

    def make(name: str, noise: RobotCalibration | None, seed: int = 0, seconds: float = 60.0) -> World:
        folder = tmp_path / name
        folder.mkdir(exist_ok=True)
        world = figure_eight.drive(figure_eight.EightConfig(seconds=seconds, turn_rate=0.3), LANDMARKS)
        rng = np.random.default_rng(seed) if noise is not None else None
        log, truth = simulated.log(world, noise or RobotCalibration(), rng)
        mrclam.write(folder, 1, log, truth)
        return World(folder, world.times, world.poses)

    return make


@pytest.fixture
def calibration() -> RobotCalibration:
    """Noises of the simulated world."""
    return CALIBRATION
