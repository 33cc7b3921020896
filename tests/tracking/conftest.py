"""A small map of a rendered desk: exact poses and points, and pictures to track."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.features import finest_from_level
from vslam_ref.systems.ptam.look import prepare, strong_corners
from vslam_ref.systems.ptam.settings import FeatureSettings
from vslam_ref.systems.visual_map import PreparedPicture, VisualMap
from vslam_ref.worlds.rendered import RenderedScene, scene

SIZE = (160, 120)
FEATURES = FeatureSettings(least_eigenvalue=40.0)


class Desk(NamedTuple):
    """The scene, a map with pictures 0 and 6 as keyframes, and three pictures made ready: 0, 6 and 9."""

    scene: RenderedScene
    map: VisualMap
    pictures: dict[int, PreparedPicture]

    def pose(self, k: int) -> Array:
        return np.asarray(self.scene.T_cam_world[k])


@pytest.fixture(scope="session")
def desk() -> Desk:
    """Points lie on the things themselves: corners of a keyframe, with the depth that the scene has there."""
    made = scene("desk", size=SIZE, frames=10)
    pictures = {k: prepare(k, made.frame(k), FEATURES) for k in (0, 6, 9)}
    found = VisualMap(made.camera, (SIZE[1], SIZE[0]))
    for k in (0, 6):
        kf = found.add_keyframe(made.T_cam_world[k], pictures[k])
        for level in range(4):
            corner = strong_corners(pictures[k], level, FEATURES)[: (70, 50, 30, 15)[level]]
            uv = finest_from_level(pictures[k].corners[level].xy[corner], level)
            X = made.surface(k, uv)
            there = np.isfinite(X).all(1)
            found.add_points(X[there], kf, level, uv[there])
    return Desk(made, found, pictures)
