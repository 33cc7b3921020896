"""A map of features without pictures: keyframes on an arc, points before them, descriptors drawn."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.features.orb import OrbFeatures
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.systems.orbslam.feature_map import DescribedPicture, FeatureMap

CAMERA = Pinhole(150.0, 140.0, 63.5, 47.5)
SHAPE = (96, 128)


class Drawn(NamedTuple):
    """A map, and which of its points each keyframe was told to see: ``sees[kf] = {feature: point}``."""

    map: FeatureMap
    sees: dict[int, dict[int, int]]


def picture(number: int, uv: np.ndarray, rng: np.random.Generator) -> DescribedPicture:
    """Features at given places, octaves 0 to 3 in turn."""
    count = len(uv)
    features = OrbFeatures(
        uv,
        np.arange(count) % 4,
        np.zeros(count),
        np.ones(count),
        rng.integers(0, 256, (count, 32), dtype=np.uint8),
    )
    return DescribedPicture(number, features, np.full(count, 100, np.uint8))


@pytest.fixture
def draw_map() -> Callable[..., Drawn]:
    """Make a map of K keyframes and N points; each keyframe sees a random share of them, exactly placed."""

    def draw(keyframes: int = 6, points: int = 40, share: float = 0.5, seed: int = 0) -> Drawn:
        rng = np.random.default_rng(seed)
        made, sees = FeatureMap(CAMERA, SHAPE, 8, 1.2), {}
        X = np.column_stack([rng.uniform(-0.6, 0.6, (points, 2)), rng.uniform(2.0, 3.5, points)])
        which = rng.random((keyframes, points)) < share
        which[:2] = True  # two sightings at least
        for k in range(keyframes):
            step = 0.8 * k / max(keyframes - 1, 1) - 0.4
            T = se3.exp([-step, 0.05 * step, 0.02, 0.03, 0.12 * step, 0.02])
            uv = CAMERA.pixel_from_world(T, X[which[k]]).uv
            made.add_keyframe(T, picture(10 * k, np.concatenate([uv, [[5.0, 5.0]]]), rng))
        numbers = made.add_points(X, 0)
        for k in range(keyframes):
            seen = numbers[which[k]]
            made.see(k, np.arange(len(seen)), seen)
            sees[k] = dict(enumerate(seen.tolist()))
        made.refresh(numbers)
        return Drawn(made, sees)

    return draw
