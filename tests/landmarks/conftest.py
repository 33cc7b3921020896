"""Grids made by hand, scans of known rooms, and one run of the whole loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.experiments.grids.following import localise
from vslam_ref.grids import Lattice, LogOddsGrid, MapConfig
from vslam_ref.systems.grid_slam import GridSlam, GridSlamConfig
from vslam_ref.worlds.floor_plan import CrowdConfig, FloorPlanConfig, LaserConfig, Recording, simulate

SURE = 5.0


def grid_of(
    cells: list[tuple[int, int]], shape: tuple[int, int] = (64, 64), value: float = SURE
) -> LogOddsGrid:
    """A map that is free but for some cells (row, column), 0.1 m wide, with its corner at (0, 0)."""
    log_odds = np.full(shape, -SURE)
    for row, column in cells:
        log_odds[row, column] = value
    return LogOddsGrid(Lattice(0.1, (0, 0), shape), log_odds)


@pytest.fixture
def make_grid() -> Callable[..., LogOddsGrid]:
    return grid_of


class HallRun(NamedTuple):
    """A run through the hall with the whole loop: the box is moved before the robot's eyes."""

    recording: Recording
    poses: np.ndarray
    slam: GridSlam


@pytest.fixture(scope="session")
def hall() -> HallRun:
    config = FloorPlanConfig(plan="hall", crowd=CrowdConfig(density=0.02), laser=LaserConfig(beams=541))
    recording = simulate(config, np.random.default_rng(6))
    poses, _, slam = localise(recording, GridSlamConfig(map=MapConfig(d_memory="text")))
    return HallRun(recording, poses, slam)
