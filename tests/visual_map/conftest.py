"""An exact map: a curved row of keyframes, points before them, sightings without error, pictures of noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.features import Corners, detect, pyramid, small_image
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.systems.visual_map import PreparedPicture, VisualMap

CAMERA = Pinhole(150.0, 140.0, 63.5, 47.5)
SIZE = (128, 96)


def noise_picture(number: int) -> PreparedPicture:
    """Grey noise, the same for the same number; no corners."""
    image = np.random.default_rng(number).integers(0, 256, SIZE[::-1], dtype=np.uint8)
    levels = pyramid(image, 2)
    none: tuple[Corners, ...] = tuple(detect(level, 254) for level in levels)
    return PreparedPicture(number, levels, none, small_image(levels[1], 1))


def poses(count: int) -> Array:
    """Keyframes on an arc, all turned towards the points."""
    step = np.linspace(-0.6, 0.6, count)
    return np.stack([se3.exp([-s, 0.1 * s * s, 0.02 * s, 0.03 * s, 0.12 * s, 0.02]) for s in step])


@pytest.fixture
def make_map() -> Callable[..., VisualMap]:
    """Make a map of K keyframes and points, levels 0 and 1 in turn, each first seen by the first that can."""

    def make(keyframes: int = 5, points: int = 60, seed: int = 0) -> VisualMap:
        rng = np.random.default_rng(seed)
        made = VisualMap(CAMERA, SIZE[::-1], levels=2)
        T = poses(keyframes)
        for k in range(keyframes):
            made.add_keyframe(T[k], noise_picture(k))
        X = np.column_stack([rng.uniform(-0.9, 0.9, points), rng.uniform(-0.6, 0.6, points)])
        X = np.column_stack([X, rng.uniform(2.0, 3.5, points)])
        uv = CAMERA.pixel_from_world(T[:, None], X).uv
        inside = ((uv >= 8) & (uv < np.array(SIZE) - 8)).all(-1)
        for n in np.flatnonzero(inside.sum(0) >= 3):
            seen = np.flatnonzero(inside[:, n])
            number = made.add_points(X[n : n + 1], int(seen[0]), n % 2, uv[seen[0], n][None])
            for kf in seen[1:]:
                made.observe(int(kf), number, n % 2, uv[kf, n][None])
        return made

    return make
