"""Scenes for the tests: cameras on an arc around points, every lens, poses far from the identity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.geometry import camera_pose, se3, so3
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan
from vslam_ref.geometry.multiview import Views

LENSES: dict[str, Camera] = {
    "pinhole": Pinhole(500.0, 520.0, 320.0, 240.0),
    "fov": Fov(300.0, 310.0, 320.0, 240.0, 0.93),
    "radtan": Radtan(458.0, 457.0, 367.0, 248.0, -0.28, 0.07, 2e-4, 1e-4, 0.0),
    "fisheye": Fisheye(200.0, 205.0, 320.0, 240.0, -0.01, 0.02, -0.01, 0.002),
}


class Scene(NamedTuple):
    views: Views
    X: np.ndarray
    uv: np.ndarray


def poses_on_an_arc(count: int, distance: float = 5.0, angle: float = 1.2) -> np.ndarray:
    """Cameras at one distance from the middle, looking at it; the whole turned and moved in the world."""
    world = se3.exp([0.7, -1.1, 2.0, 0.4, -0.9, 0.5])
    poses = []
    for a in np.linspace(-angle / 2, angle / 2, count):
        R = so3.exp([0.1 * a, a, 0.3 * a])
        poses.append(camera_pose.pose_from_centre(R, -distance * R[2]))
    return se3.compose(np.array(poses), world)


def make_scene(lens: str, views: int = 3, points: int = 40, seed: int = 0) -> Scene:
    rng = np.random.default_rng(seed)
    T = poses_on_an_arc(views)
    middle = se3.act(se3.inverse(T[0]), [0.0, 0.0, 5.0])
    X = middle + rng.uniform(-1.0, 1.0, (points, 3))
    all_views = Views(LENSES[lens], T)
    seen = all_views.project(X)
    assert seen.valid.all()
    return Scene(all_views, X, seen.uv)


@pytest.fixture(params=list(LENSES))
def lens_scene(request: pytest.FixtureRequest) -> Scene:
    return make_scene(request.param)


@pytest.fixture
def scene() -> Scene:
    return make_scene("pinhole")


@pytest.fixture(scope="session")
def make():
    """The maker of scenes itself."""
    return make_scene


@pytest.fixture(scope="session")
def arc():
    return poses_on_an_arc
