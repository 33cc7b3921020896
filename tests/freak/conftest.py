"""Pictures for the tests of FREAK."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.worlds.pictures import painted_wall, picture

sys.path.insert(0, str(Path(__file__).parent))  # the commands import what stands beside them
Bytes = NDArray[np.uint8]


@pytest.fixture(scope="session")
def wall() -> Bytes:
    """A picture of 160 x 130 with noise of 2 grey levels."""
    rng = np.random.default_rng(18)
    return picture(painted_wall(rng, 120, (216, 216)), size=(216, 216), noise=2.0, rng=rng)[:130, :160].copy()
