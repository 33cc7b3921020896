"""Pictures for the tests of ORB."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.worlds.pictures import painted_wall, picture

Bytes = NDArray[np.uint8]


@pytest.fixture(scope="session")
def wall() -> Bytes:
    """A picture of 216 x 216 with noise of 2 grey levels: its first octaves have whole sizes."""
    rng = np.random.default_rng(14)
    return picture(painted_wall(rng, 150, (216, 216)), size=(216, 216), noise=2.0, rng=rng)
