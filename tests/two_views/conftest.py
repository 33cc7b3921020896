"""Scenes of two cameras: points in space, on a plane, far away; exact or with noise and wrong pairs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.geometry import se3, so3

FOCAL = 500.0
"""Pixels; a sigma of one pixel is 1 / FOCAL."""


class Pair(NamedTuple):
    T_b_a: np.ndarray
    X_a: np.ndarray
    a: np.ndarray
    b: np.ndarray


def make_pair(
    rng: np.random.Generator,
    points: int = 100,
    kind: str = "space",
    *,
    sigma_px: float = 0.0,
    wrong: float = 0.0,
    turn: float = 0.2,
) -> Pair:
    """Two pictures of points some four baselines away; the first share ``wrong`` of the pairs is random."""
    t = rng.normal(size=3)
    T = se3.from_rt(so3.exp(rng.normal(0, turn, 3)), t / np.linalg.norm(t))
    X = rng.uniform(-1, 1, (points, 3)) * [2.0, 2.0, 1.5] + [0, 0, 5.0]
    if kind == "plane":
        X[:, 2] = 5.0 + 0.4 * X[:, 0] - 0.2 * X[:, 1]
    if kind == "far":
        X *= rng.choice([1.0, 1000.0], (points, 1), p=[0.3, 0.7])
    if kind == "turn":
        T[:3, 3] = 0.0
    Y = se3.act(T, X)
    a, b = X[:, :2] / X[:, 2:], Y[:, :2] / Y[:, 2:]
    a, b = (x + rng.normal(0, 1, x.shape) * sigma_px / FOCAL for x in (a, b))
    n = int(wrong * points)
    b[:n] = rng.uniform(-0.4, 0.4, (n, 2))
    return Pair(T, X, a, b)


@pytest.fixture(scope="session")
def pair():
    """The maker of pairs itself."""
    return make_pair
