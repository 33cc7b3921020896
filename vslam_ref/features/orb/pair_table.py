"""Which pixels are compared: 256 pairs, x and y of the first pixel and of the second, from the centre."""

from __future__ import annotations

import numpy as np

PAIRS = np.random.default_rng(0).integers(-13, 14, (256, 4))
