"""Two views of a painted, tilted wall: matches, depths and poses are known exactly."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.systems.ptam.look import prepare
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.visual_map import PreparedPicture
from vslam_ref.worlds.pictures import painted_wall, picture

CAMERA = Pinhole(200.0, 200.0, 99.5, 74.5)
SIZE = (200, 150)
NORMAL, DISTANCE = np.array([0.15, 0.1, 0.98]), 2.0
"""The wall: points X of the first camera's frame with NORMAL . X = DISTANCE."""


class TwoViews(NamedTuple):
    """Pictures of the wall, the poses of their cameras (2, 4, 4), and the homography of the pixels."""

    camera: Pinhole
    pictures: tuple[PreparedPicture, PreparedPicture]
    T_cam_world: Array
    H_b_a: Array

    def truth(self, uv: Array) -> Array:
        """Points (n, 3) of the wall that pixels (n, 2) of the first picture see."""
        ray = self.camera.unproject(uv).bearing
        return np.asarray(DISTANCE * ray / (ray @ NORMAL)[:, None])


def homography(T_b_a: Array) -> Array:
    """Pixels of b from those of a, through the wall."""
    K = np.array([[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1.0]])
    plane = se3.rotation(T_b_a) + np.outer(se3.translation(T_b_a), NORMAL) / DISTANCE
    return np.asarray(K @ plane @ np.linalg.inv(K))


@pytest.fixture(scope="session")
def settings() -> Settings:
    return Settings()


@pytest.fixture(scope="session")
def wall(settings: Settings) -> TwoViews:
    """The second camera stands 0.16 to the right of the first, a little turned and nearer."""
    rng = np.random.default_rng(11)
    painted = painted_wall(rng, 260, SIZE)
    T_b_a = se3.exp([-0.16, 0.02, -0.05, 0.01, -0.03, 0.02])
    H = homography(T_b_a)
    images = [picture(painted, M, size=SIZE, noise=1.0, rng=rng) for M in (np.eye(3), H)]
    first, second = (prepare(k, image, settings.features) for k, image in enumerate(images))
    return TwoViews(CAMERA, (first, second), np.stack([se3.identity(), T_b_a]), H)
