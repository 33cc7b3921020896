"""Random inputs as short decimals: exponentials and products differ in the last bit between machines."""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.arrays import Array


def digits(values: Any, count: int = 12) -> Array:
    """Numbers of so many digits: what linear algebra gives differs in its last ones between machines."""
    rows = np.asarray(values, dtype=np.float64)
    kept = [float(f"{v:.{count}g}") for v in rows.ravel().tolist()]
    return np.array(kept).reshape(rows.shape)


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Positive number of 12 digits, its logarithm uniform."""
    return float(digits(np.exp(rng.uniform(np.log(low), np.log(high)))))


def rotation_vector(rng: np.random.Generator, low: float, high: float) -> Array:
    """Vector (3,) of any direction whose length is log-uniform; 12 digits."""
    axis = rng.standard_normal(3)
    return digits(log_uniform(rng, low, high) * axis / np.linalg.norm(axis))
