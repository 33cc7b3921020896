"""Pictures for the tests of image features."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.worlds.pictures import painted_wall, picture

Bytes = NDArray[np.uint8]


@pytest.fixture(scope="session")
def wall() -> Bytes:
    """A picture of 240 x 320 with noise of 2 grey levels."""
    rng = np.random.default_rng(8)
    return picture(painted_wall(rng, 250, (320, 240)), size=(320, 240), noise=2.0, rng=rng)
