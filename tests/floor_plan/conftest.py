"""Recordings that several tests look at."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.worlds.floor_plan import CrowdConfig, FloorPlanConfig, LaserConfig, Recording, simulate


@pytest.fixture(scope="session")
def office_run() -> Recording:
    """14 s in the office among people: the chair is carried, and the first door is passed."""
    config = FloorPlanConfig(crowd=CrowdConfig(density=0.15), laser=LaserConfig(beams=181), duration=14.0)
    return simulate(config, np.random.default_rng(3))


@pytest.fixture(scope="session")
def hall_run() -> Recording:
    """A short run in the hall without people."""
    config = FloorPlanConfig(plan="hall", crowd=CrowdConfig(density=0.0))
    return simulate(config, np.random.default_rng(5))
